"""Forces as CSV, one row for each tactel of each frame."""

from __future__ import annotations

import csv
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import FileFormatError
from fringeforce.base.storage import whole_file
from fringeforce.reading.pads.reading import PadReading
from fringeforce.reading.reading import Reading

Array = NDArray[np.float64]

CARTESIAN = ("normal_N", "tangential_N")
POLAR = ("magnitude_N", "angle_deg")
PAD = ("normal_N", "tangential_x_N", "tangential_y_N")
READING = (
    *CARTESIAN, *POLAR,
    "normal_std_N", "tangential_std_N", "magnitude_std_N", "angle_std_deg",
)  # fmt: skip
PAD_READING = (*PAD, *(name.replace("_N", "_std_N") for name in PAD))


def load_forces(path: str | os.PathLike[str], tactels: int) -> Array:
    """Read loads: frame, tactel and either normal_N, tangential_N or magnitude_N, angle_deg.

    Parameters
    ----------
    path : path
        Path of the CSV file.  Frames count from 0 and tactels from 1, leftmost first; tactels that
        a frame does not name are not loaded.  Without a frame column all rows are one frame.
    tactels : int
        Number of tactels of the sensor.

    Returns
    -------
    ndarray, shape (k, tactels, 2)
        Normal and tangential forces [N].

    Raises
    ------
    FileFormatError
        If the file is missing or a row cannot be used; the message names its line.
    """
    columns, forces = _loads(path, tactels, (CARTESIAN, POLAR))
    if columns == POLAR:
        size, angle = forces[..., 0], np.radians(forces[..., 1])
        forces = np.stack([size * np.cos(angle), size * np.sin(angle)], axis=-1)
    return forces


def load_pad_forces(path: str | os.PathLike[str], tactels: int) -> Array:
    """Read loads of a pad: frame, tactel and normal_N, tangential_x_N, tangential_y_N.

    As `load_forces`, but for the shape of the result, (k, tactels, 3) [N].
    """
    return _loads(path, tactels, (PAD,))[1]


def save_forces(path: str | os.PathLike[str], forces: ArrayLike) -> None:
    """Write loads as `load_forces` reads them; forces have the shape (k, n, 2) [N]."""
    _save_forces(path, CARTESIAN, forces)


def save_pad_forces(path: str | os.PathLike[str], forces: ArrayLike) -> None:
    """Write loads as `load_pad_forces` reads them; forces have the shape (k, n, 3) [N]."""
    _save_forces(path, PAD, forces)


def save_readings(path: str | os.PathLike[str], readings: Iterable[Reading]) -> Counter[str]:
    """Write readings, one row for each tactel of each frame, whole or not at all.

    Parameters
    ----------
    path : path
        Path of the CSV file.
    readings : iterable of Reading
        One for each frame.

    Returns
    -------
    Counter
        Frames by the name of their status.

    Raises
    ------
    FileFormatError
        If the file cannot be written.
    """
    return _save_readings(path, READING, readings, _strip_columns)


def save_pad_readings(path: str | os.PathLike[str], readings: Iterable[PadReading]) -> Counter[str]:
    """Write readings of a pad, as `save_readings` does those of a strip."""
    return _save_readings(path, PAD_READING, readings, lambda r: np.hstack([r.forces, r.std]))


def _save_forces(path: str | os.PathLike[str], names: Sequence[str], forces: ArrayLike) -> None:
    with _new_table(path) as file:
        writer = csv.writer(file)
        writer.writerow(["frame", "tactel", *names])
        for frame, load in enumerate(np.asarray(forces, dtype=float).tolist()):
            for tactel, force in enumerate(load, start=1):
                cells = [repr(value) for _, value in zip(names, force, strict=True)]
                writer.writerow([frame, tactel, *cells])


def _strip_columns(reading: Reading) -> Array:
    return np.column_stack(
        [
            reading.forces, reading.magnitude, reading.angle,
            reading.std, reading.magnitude_std, reading.angle_std,
        ]
    )  # fmt: skip


def _save_readings(
    path: str | os.PathLike[str],
    names: Sequence[str],
    readings: Iterable[Any],
    columns: Callable[[Any], Array],
) -> Counter[str]:
    statuses: Counter[str] = Counter()
    with _new_table(path) as file:
        writer = csv.writer(file)
        writer.writerow(["frame", "tactel", *names, "status"])
        for frame, reading in enumerate(readings):
            statuses[reading.status.name] += 1
            for tactel, values in enumerate(columns(reading), start=1):
                cells = [f"{value:.6g}" for value in values]
                writer.writerow([frame, tactel, *cells, reading.status.name])
    return statuses


@contextmanager
def _new_table(path: str | os.PathLike[str]) -> Iterator[TextIO]:
    """A text file that takes its name only once it is complete."""
    with whole_file(path) as place, open(place, "w", newline="", encoding="utf-8") as file:
        yield file


def _loads(
    path: str | os.PathLike[str], tactels: int, kinds: Sequence[tuple[str, ...]]
) -> tuple[tuple[str, ...], Array]:
    """Which columns a table has, and what stands in them, shape (k, tactels, columns)."""
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file, skipinitialspace=True)
            columns = _force_columns(path, reader.fieldnames or (), kinds)
            rows = list(_rows(path, reader, columns, tactels))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        if isinstance(error, FileFormatError):
            raise
        reason = error.strerror if isinstance(error, OSError) else error
        raise FileFormatError(f"{path} cannot be read as a table of forces: {reason}.") from None
    if not rows:
        raise FileFormatError(f"{path} holds no loads; give one row for each loaded tactel.")
    loads = np.zeros((max(frame for frame, *_ in rows) + 1, tactels, len(columns)))
    for frame, tactel, values in rows:
        loads[frame, tactel] = values
    return columns, loads


def _force_columns(
    path: str | os.PathLike[str], names: Sequence[str], kinds: Sequence[tuple[str, ...]]
) -> tuple[str, ...]:
    for columns in kinds:
        if {"tactel", *columns} <= set(names):
            return columns
    wanted = " or with ".join(f"{', '.join(columns[:-1])} and {columns[-1]}" for columns in kinds)
    raise FileFormatError(
        f"{Path(path).name} has the columns {', '.join(names) or '(none)'}; a table of forces "
        f"needs tactel with {wanted}."
    )


def _rows(
    path: str | os.PathLike[str],
    reader: csv.DictReader[str],
    columns: tuple[str, ...],
    tactels: int,
) -> Iterator[tuple[int, int, list[float]]]:
    seen: set[tuple[int, int]] = set()
    for row in reader:
        where = f"{Path(path).name}, line {reader.line_num}"
        try:
            frame, tactel = int(row.get("frame") or 0), int(row["tactel"])
            values = [float(row[column]) for column in columns]
        except (TypeError, ValueError):
            raise FileFormatError(f"{where}: {dict(row)} is not a row of numbers.") from None
        if not 1 <= tactel <= tactels or frame < 0:
            raise FileFormatError(
                f"{where}: frame {frame}, tactel {tactel}; frames count from 0 and this sensor's "
                f"tactels from 1 to {tactels}."
            )
        if (frame, tactel) in seen:
            raise FileFormatError(f"{where}: tactel {tactel} of frame {frame} is given twice.")
        if not np.isfinite(values).all():
            shown = " and ".join(f"{value:g}" for value in values)
            raise FileFormatError(f"{where}: forces must be finite, not {shown}.")
        seen.add((frame, tactel))
        yield frame, tactel - 1, values
