"""Tables of `measured/NAME.txt` as numbers: those in boxes, and those with columns by position."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

HEADING = 3
"""Lines of a record before its empty line: the command, date and machine, versions."""


@dataclass(frozen=True)
class Table:
    """Names of columns, and rows of cells as they were printed."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def texts(self, column: str) -> list[str]:
        """The cells of a column."""
        if column not in self.columns:
            raise KeyError(f"no column {column!r}; there are {', '.join(self.columns)}")
        place = self.columns.index(column)
        return [row[place] for row in self.rows]

    def numbers(self, column: str) -> list[float]:
        """The cells of a column as numbers, per cent as they are; what is none is not a number."""
        return [number(text) for text in self.texts(column)]

    def pairs(self, first: str, second: str) -> list[tuple[str, str]]:
        """The cells of two columns."""
        return list(zip(self.texts(first), self.texts(second), strict=True))


def number(text: str) -> float:
    """The first number of a cell."""
    found = re.search(r"[-+]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?", text)
    return float(found[0].replace(",", "")) if found else float("nan")


def heading(path: Path) -> list[str]:
    """What was run, when and on what."""
    return path.read_text(encoding="utf-8").splitlines()[:HEADING]


def boxed(path: Path) -> list[Table]:
    """Every table in a box.  A row whose first cell is empty goes on with the one above."""
    tables: list[Table] = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("┃"):
            names = tuple(cell.strip() for cell in line.strip("┃").split("┃"))
            if tables and not tables[-1].rows:  # a heading of two lines
                above = tables.pop().columns
                names = tuple(f"{a} {b}".strip() for a, b in zip(above, names, strict=True))
            tables.append(Table(names, ()))
        elif line.startswith("│"):
            cells = tuple(cell.strip() for cell in line.strip("│").split("│"))
            rows = tables[-1].rows
            if not cells[0] and rows:
                joined = zip(rows[-1], cells, strict=True)
                rows, cells = rows[:-1], tuple(f"{a} {b}".strip() for a, b in joined)
            tables[-1] = Table(tables[-1].columns, (*rows, cells))
    return tables


def aligned(path: Path, first: str) -> Table:
    """The table below the line that begins with `first`, whose columns end where their names do.

    A name is one word; one that comes again is counted, `OK`, `OK 2`.  The first cell of a row
    ends at two spaces, and an empty line ends the table.
    """
    lines = iter(path.read_text(encoding="utf-8").splitlines())
    head = next((line for line in lines if line.split()[:1] == [first]), None)
    if head is None:
        raise KeyError(f"no table whose first column is {first!r}")
    words = list(re.finditer(r"\S+", head))
    seen = Counter[str]()
    names = []
    for word in words:
        seen[word[0]] += 1
        names.append(word[0] if seen[word[0]] == 1 else f"{word[0]} {seen[word[0]]}")
    found = []
    for line in lines:
        if not line.strip():
            break
        label = re.match(r"\s*\S+(?: \S+)*", line)
        assert label is not None
        end = label.end()
        cells = [(end + word.end(), word[0]) for word in re.finditer(r"\S+", line[end:])]
        found.append((label[0].strip(), cells))
    ends = _ends([word.end() for word in words], [end for _, cells in found for end, _ in cells])
    rows = []
    for label, cells in found:
        row = [label, *[""] * (len(names) - 1)]
        for end, text in cells:
            place = min(range(1, len(names)), key=lambda k: abs(ends[k] - end))
            row[place] = f"{row[place]} {text}".strip()
        rows.append(tuple(row))
    return Table(tuple(names), tuple(rows))


def _ends(names: list[int], cells: list[int]) -> list[int]:
    """Ends of the columns: those of their names, all moved by what fits the cells best."""

    def misfit(shift: int) -> int:
        return sum(min(abs(name + shift - cell) for name in names[1:]) for cell in cells)

    shift = min(range(-3, 4), key=lambda shift: (misfit(shift), abs(shift)))
    return [name + shift for name in names]
