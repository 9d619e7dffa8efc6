"""What every study hands over: a figure, a table, and one paragraph of plain words."""

from __future__ import annotations

import csv
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

from matplotlib.axes import Axes

from fringeforce.base.storage import writing
from fringeforce.plotting import axes as plot

NARROW = 12
"""Characters to which titles of columns are broken on a terminal, where numbers are shorter."""


def percent(share: float, digits: int = 0) -> str:
    """A share in per cent, as text."""
    return f"{1e2 * share:.{digits}f} %"


@dataclass(frozen=True)
class StudyResult:
    """The outcome of a study.

    Attributes
    ----------
    name : str
        Name of the files.
    header : tuple of str
        Titles of the table's columns.
    rows : tuple of tuple of str
        The table.
    text : str
        What it means, computed from the numbers.
    draw : callable
        Draws the figure on axes.
    size : (float, float)
        Size of the figure [inch].
    """

    name: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    text: str
    draw: Callable[[Axes], None]
    size: tuple[float, float] = (8.0, 4.2)

    def lines(self) -> list[str]:
        """Table and text for a terminal."""
        heads = [
            textwrap.wrap(title, max([NARROW, *(len(row[place]) for row in self.rows)]))
            for place, title in enumerate(self.header)
        ]
        height = max(map(len, heads))
        titles = zip(*([""] * (height - len(head)) + head for head in heads), strict=True)
        table = [*titles, *self.rows]
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        shown = [
            "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
            for row in table
        ]
        return [*shown, "", *textwrap.wrap(self.text, 92)]

    def save(self, folder: Path) -> list[Path]:
        """Write NAME.png, NAME.csv and NAME.txt.

        Raises
        ------
        FileFormatError
            If the folder cannot be made or written to.
        """
        table = StringIO()
        csv.writer(table, lineterminator="\n").writerows([self.header, *self.rows])
        paths = [folder / f"{self.name}.{ending}" for ending in ("png", "csv", "txt")]
        with writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
            with plot.figure(*self.size) as (canvas, ax):
                self.draw(ax)
                canvas.savefig(paths[0])
            paths[1].write_text(table.getvalue(), encoding="utf-8")
            paths[2].write_text("\n".join(textwrap.wrap(self.text, 92)) + "\n", encoding="utf-8")
        return paths
