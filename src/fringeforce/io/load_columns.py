"""Columns of tables of loads as people write them: separators, decimal signs, names and units."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.base.errors import FileFormatError
from fringeforce.base.storage import HDF5

UNITS = {
    **{name: ("length", size) for name, size in (("m", 1.0), ("mm", 1e-3), ("um", 1e-6))},
    **{name: ("force", size) for name, size in (("n", 1.0), ("mn", 1e-3), ("kn", 1e3))},
    **{name: ("time", size) for name, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6))},
    "degc": ("temperature", 1.0),
    **{name: ("angle", size) for name, size in (("deg", np.pi / 180), ("rad", 1.0))},
}
"""What stands behind the last underscore of a name: a kind of quantity, and its size in SI units.
Case does not count: nobody presses with meganewtons."""
USUAL = {"length": "mm", "force": "N", "time": "s", "angle": "deg", "temperature": "degC"}
NAMES: dict[str, dict[str, tuple[str, float]]] = {
    "": {
        **dict.fromkeys(("frame", "image"), ("frame", 1.0)),
        **dict.fromkeys(("tactel", "taxel"), ("tactel", 1.0)),
        "contact": ("contact", 1.0),
    },
    "time": dict.fromkeys(("time", "t", "timestamp"), ("time", 1.0)),
    "angle": {"angle": ("angle", 1.0)},
    "temperature": dict.fromkeys(("temperature", "temp"), ("temperature", 1.0)),
    "length": {
        **dict.fromkeys(("x", "place", "position", "pos", "pos_x", "x_pos"), ("x", 1.0)),
        **dict.fromkeys(("y", "pos_y", "y_pos"), ("y", 1.0)),
        **dict.fromkeys(("width", "contact_width"), ("width", 1.0)),
        **dict.fromkeys(("radius", "indenter_radius"), ("radius", 1.0)),
        **dict.fromkeys(("diameter", "indenter_diameter"), ("radius", 0.5)),
        **dict.fromkeys(("x_std", "y_std", "place_std", "position_std"), ("place_std", 1.0)),
        "width_std": ("width_std", 1.0),
    },
    "force": {
        **dict.fromkeys(("normal", "normal_force", "n", "fn", "f_n"), ("normal", 1.0)),
        **dict.fromkeys(("tangential", "shear", "ft", "f_t"), ("tangential", 1.0)),
        **dict.fromkeys(("tangential_x", "fx", "f_x", "force_x"), ("tangential_x", 1.0)),
        **dict.fromkeys(("tangential_y", "fy", "f_y", "force_y"), ("tangential_y", 1.0)),
        **dict.fromkeys(("fz", "f_z", "force_z"), ("normal", -1.0)),
        **dict.fromkeys(("reaction_fx", "reaction_x"), ("tangential_x", -1.0)),
        **dict.fromkeys(("reaction_fy", "reaction_y"), ("tangential_y", -1.0)),
        **dict.fromkeys(("reaction_fz", "reaction_z"), ("normal", 1.0)),
        "magnitude": ("magnitude", 1.0),
        "force_std": ("force_std", 1.0),
        **dict.fromkeys(("normal_std", "fz_std", "fn_std"), ("normal_std", 1.0)),
        **dict.fromkeys(
            ("tangential_std", "tangential_x_std", "fx_std"), ("tangential_x_std", 1.0)
        ),
        **dict.fromkeys(("tangential_y_std", "fy_std"), ("tangential_y_std", 1.0)),
    },
}
"""What each name means, by the kind of its unit, and its size in that meaning.  Components fx, fy
and fz are of the force on the sensor, whose z points out of the surface; reactions are what acts on
the indenter."""
ALIKE = 0.8
"""Likeness (difflib's ratio) from which an unknown name is taken for a misspelt one."""
LONGEST = 200
"""Characters of a cell or of the names of columns; longer ones are of another kind of file."""
MOST = 1000
"""Columns of a table."""
EMPTY = {"", "-", "nan", "none", "null", "n/a"}
"""Cells in which nothing is stated."""


@dataclass(frozen=True, eq=False)
class Columns:
    """Numbers of a table of loads in SI units, by what they mean.

    Attributes
    ----------
    name : str
        Of the file.
    values : dict
        Each of shape (rows,), by meaning; not a number where a cell is empty.
    written : dict
        Names of the columns as written, by meaning.
    lines : sequence of int
        Where each row stands.
    line : str
        What its number counts.
    header : sequence of str
        All names as written.
    """

    name: str
    values: dict[str, Array]
    written: dict[str, str]
    lines: Sequence[int]
    line: str
    header: Sequence[str]

    def where(self, row: int) -> str:
        """A row in words."""
        return f"{self.name}, {self.line} {self.lines[row]}"

    def get(self, *meanings: str) -> Array:
        """The first of some columns that the table has; not a number if none."""
        for meaning in meanings:
            if meaning in self.values:
                return self.values[meaning]
        return np.full(len(self.lines), np.nan)


def load_columns(path: str | os.PathLike[str]) -> Columns:
    """Read the columns of a table of loads: CSV of any usual kind, or HDF5.

    Cells are separated by commas, semicolons, tabs or blanks, as the header is; decimal signs are
    points or commas; lines that begin with # are remarks.  In HDF5 files each column is a dataset
    of one dimension in the group `loads`, or in the file itself; a unit that its name does not tell
    may be in its attribute `units`.

    Raises
    ------
    FileFormatError
        If the file is missing, or a name or a cell cannot be understood; the message names the
        line.
    """
    name = Path(path).name
    if Path(path).suffix.lower() in HDF5:
        header, rows, line = *_from_hdf5(path), "row"
        lines = range(1, len(rows) + 1)
    else:
        (_, header), *found = _cells(path, _text(path)) or [(0, [])]
        lines, rows = [number for number, _ in found], [cells for _, cells in found]
        line = "line"
    if len(header) > MOST or any(len(cell) > LONGEST for cell in header):
        raise FileFormatError(
            f"{name} has {len(header)} columns, the longest name of {max(map(len, header))} "
            f"characters; a table of loads has up to {MOST} of up to {LONGEST}."
        )
    if {"status", "normal_N", "magnitude_N"} <= set(header):  # each force twice
        raise FileFormatError(
            f"{name} holds readings, as `fringeforce read` writes them, and no loads; write a "
            "table with the columns frame, tactel or x_mm, normal_N and tangential_N alone."
        )
    chosen: dict[str, tuple[int, float]] = {}
    for place, written in enumerate(header):
        known = _meaning(name, written)
        if known is None:
            continue
        meaning, size = known
        if meaning in chosen and meaning != "place_std":
            other = header[chosen[meaning][0]]
            raise FileFormatError(
                f"{name}: the columns {other} and {written} say the same; leave one out."
            )
        chosen[meaning] = place, size
    for number, cells in zip(lines, rows, strict=True):
        if len(cells) > len(header):
            raise FileFormatError(
                f"{name}, {line} {number} has {len(cells)} cells for {len(header)} columns; where "
                "commas are decimal signs, separate cells by semicolons or tabs."
            )
        cells += [""] * (len(header) - len(cells))
    values = {}
    for meaning, (place, size) in chosen.items():
        texts = [cells[place] for cells in rows]
        try:
            with np.errstate(over="ignore"):  # what overflows is refused with the others
                values[meaning] = size * _numbers(texts, meaning)
        except ValueError as reason:
            row, words = reason.args
            if len(texts[row]) > LONGEST:
                words = f"has {len(texts[row])} characters and is not a number"
            raise FileFormatError(
                f"{name}, {line} {lines[row]}: {header[place]} {words}."
            ) from None
    written = {meaning: header[place] for meaning, (place, _) in chosen.items()}
    return Columns(name, values, written, lines, line, header)


def _text(path: str | os.PathLike[str]) -> str:
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise FileFormatError(
            f"{path} cannot be read as a table of loads: {error.strerror}."
        ) from None
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")  # as spreadsheets of old write


def _cells(path: str | os.PathLike[str], text: str) -> list[tuple[int, list[str]]]:
    """Numbers of lines, and their cells, the header first."""
    lines = [(k, line) for k, line in enumerate(text.splitlines(), 1) if line.strip()]
    remarks = [k for k, (_, line) in enumerate(lines) if not line.lstrip().startswith("#")]
    start = remarks[0] if remarks else 0
    # numpy writes the header as a remark: numbers alone are none
    if start and not re.search(r"[a-df-z]", lines[start][1].lower().replace("nan", "")):
        number, line = lines[start - 1]
        lines[start - 1] = number, line.lstrip().lstrip("#")
    kept = [(k, line) for k, line in lines if not line.lstrip().startswith("#")]
    if not kept:
        return []
    counts = {sign: kept[0][1].count(sign) for sign in "\t;,"}
    sign = max(counts, key=lambda one: counts[one])
    if '"' not in text:
        parts = [(number, line.split(sign if counts[sign] else None)) for number, line in kept]
        return [(number, [cell.strip() for cell in cells]) for number, cells in parts]
    try:
        rows = (next(csv.reader([line], delimiter=sign, skipinitialspace=True)) for _, line in kept)
        return [(n, [c.strip() for c in row]) for (n, _), row in zip(kept, rows, strict=True)]
    except csv.Error as error:
        raise FileFormatError(f"{path} cannot be read as a table of loads: {error}.") from None


def _from_hdf5(path: str | os.PathLike[str]) -> tuple[list[str], list[list[str]]]:
    try:
        with h5py.File(path, "r") as file:
            group = file.get("loads")
            group = group if isinstance(group, h5py.Group) else file
            found = dict(_datasets(group))
    except OSError as error:
        reason = "there is no such file" if isinstance(error, FileNotFoundError) else error
        raise FileFormatError(f"{path} cannot be read as a table of loads: {reason}.") from None
    sizes = {name: len(values) for name, values in found.items()}
    if len(set(sizes.values())) > 1:
        shown = ", ".join(f"{name} {size}" for name, size in sizes.items())
        raise FileFormatError(
            f"{Path(path).name}: columns of loads have different lengths ({shown}); give one value "
            "of each for every load."
        )
    columns = [[str(value) for value in values.tolist()] for values in found.values()]
    return list(found), [list(row) for row in zip(*columns, strict=True)]


def _datasets(group: h5py.Group) -> Iterator[tuple[str, Any]]:
    for name, values in group.items():
        if isinstance(values, h5py.Dataset) and values.ndim == 1:
            unit = values.attrs.get("units", "")
            told = name.rpartition("_")[2].lower() in UNITS
            if isinstance(unit, str) and unit.lower() in UNITS and not told:
                name = f"{name}_{unit}"
            yield name, values.asstr()[()] if h5py.check_string_dtype(values.dtype) else values[()]


def _meaning(file: str, written: str) -> tuple[str, float] | None:
    """What a column means and the size of its unit; None if it is of no concern."""
    plain = re.sub(r"[^a-z0-9]+", "_", written.lower().replace("µ", "u").replace("μ", "u"))
    plain = plain.strip("_")
    name, _, unit = plain.rpartition("_")
    kind, size = UNITS.get(unit, ("", 1.0)) if name else ("", 1.0)
    name = name if kind else plain
    if found := NAMES[kind].get(name):
        return found[0], found[1] * size
    if plain in NAMES["time"]:  # a date tells its unit itself
        return "date", 1.0
    for other, names in NAMES.items():
        if not kind and other and name in names:
            raise FileFormatError(
                f"{file}: the column {written} has no unit; name it {name}_{USUAL[other]}. Loads "
                "have normal_N and tangential_N, or magnitude_N and angle_deg, and a place x_mm."
            )
    known = [f"{one}_{USUAL[k]}" if k else one for k, names in NAMES.items() for one in names]
    lowered = {one.lower(): one for one in known}
    if close := get_close_matches(plain, [one for one in lowered if len(one) > 3], 1, ALIKE):
        raise FileFormatError(
            f"{file}: there is no column {written}; did you mean {lowered[close[0]]}? Give it a "
            "name of its own if it is something else."
        )
    return None


def _numbers(texts: list[str], meaning: str) -> Array:
    """Numbers of a column; a ValueError tells the row and what is wrong."""
    try:
        if meaning != "date" and not any("_" in text for text in texts):
            found = np.array(texts, dtype=float)
            if not np.isinf(found).any():
                return found
    except ValueError:
        pass
    found = np.empty(len(texts))
    for row, text in enumerate(texts):
        try:
            found[row] = _number(text, meaning)
        except ValueError as reason:
            raise ValueError(row, str(reason)) from None
    return found


def _number(text: str, meaning: str) -> float:
    cell = text.strip()
    if cell.lower() in EMPTY:
        return np.nan
    if meaning == "date":
        try:
            return datetime.fromisoformat(cell).timestamp()
        except ValueError:
            raise ValueError(
                f"= {cell!r} is no date such as 2026-05-01T12:00:00.25; name the column time_s if "
                "it counts seconds"
            ) from None
    if "," in cell and "." in cell:
        raise ValueError(f"= {cell!r} has two decimal signs; leave out those of thousands")
    try:
        value = float(cell.replace(",", ".").replace("_", "?"))  # Python's 1_000 is no number
    except ValueError:
        raise ValueError(f"= {cell!r} is not a number") from None
    if not np.isfinite(value):
        raise ValueError(f"= {cell!r} must be finite")
    return value
