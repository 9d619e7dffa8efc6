"""Forces as CSV, one row for each tactel of each frame."""

from __future__ import annotations

import csv
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.base.errors import FileFormatError
from fringeforce.base.storage import whole_file
from fringeforce.contacts.resultant import Resultant
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.reading.reading import Reading

COMPONENTS = {len(names): names for names in (Sensor.components, Pad.components)}
"""Names of the components of a force, by their number."""
POLAR, POLAR_STD = ("magnitude_N", "angle_deg"), ("magnitude_std_N", "angle_std_deg")


def force_columns(components: Sequence[str]) -> tuple[str, ...]:
    """Names of the columns of forces."""
    return tuple(f"{name}_N" for name in components)


def reading_columns(components: Sequence[str]) -> tuple[str, ...]:
    """Names of the columns of readings: forces and deviations, of a strip in polar form too."""
    polar, polar_std = (POLAR, POLAR_STD) if len(components) == 2 else ((), ())
    std = (f"{name}_std_N" for name in components)
    return *force_columns(components), *polar, *std, *polar_std


def load_forces(
    path: str | os.PathLike[str], tactels: int, components: tuple[str, ...] = Sensor.components
) -> Array:
    """Read loads: frame, tactel and forces, of a strip also as magnitude_N and angle_deg.

    Parameters
    ----------
    path : path
        Path of the CSV file.  Frames count from 0 and tactels from 1, leftmost first; tactels that
        a frame does not name are not loaded.  Without a frame column all rows are one frame.
    tactels : int
        Number of tactels of the sensor.
    components : tuple of str
        `components` of the sensor, a strip if not given: normal_N, tangential_N; of a pad normal_N,
        tangential_x_N, tangential_y_N.

    Returns
    -------
    ndarray, shape (k, tactels, components)
        Forces [N].

    Raises
    ------
    FileFormatError
        If the file is missing or a row cannot be used; the message names its line.
    """
    kinds = [force_columns(components), *([POLAR] if len(components) == 2 else [])]
    columns, forces = _loads(path, tactels, kinds)
    if columns == POLAR:
        size, angle = forces[..., 0], np.radians(forces[..., 1])
        forces = np.stack([size * np.cos(angle), size * np.sin(angle)], axis=-1)
    return forces


def save_forces(path: str | os.PathLike[str], forces: ArrayLike) -> None:
    """Write loads as `load_forces` reads them; forces have the shape (k, n, components) [N].

    Raises
    ------
    FileFormatError
        If the file cannot be written.
    """
    loads = np.asarray(forces, dtype=float)
    with _new_table(path) as file:
        writer = csv.writer(file)
        writer.writerow(["frame", "tactel", *force_columns(COMPONENTS[loads.shape[-1]])])
        for frame, load in enumerate(loads):
            for tactel, values in enumerate(load.tolist(), start=1):
                writer.writerow([frame, tactel, *map(repr, values)])


def save_readings(
    path: str | os.PathLike[str],
    readings: Iterable[Reading],
    components: tuple[str, ...] = Sensor.components,
) -> Counter[str]:
    """Write readings, one row for each tactel of each frame, whole or not at all.

    Parameters
    ----------
    path : path
        Path of the CSV file.
    readings : iterable of Reading
        One for each frame.
    components : tuple of str
        `components` of the sensor, a strip if not given.

    Returns
    -------
    Counter
        Frames by the name of their status.

    Raises
    ------
    FileFormatError
        If the file cannot be written.
    """
    statuses: Counter[str] = Counter()
    with _new_table(path) as file:
        writer = csv.writer(file)
        writer.writerow(["frame", "tactel", *reading_columns(components), "status"])
        for frame, reading in enumerate(readings):
            statuses[reading.status.name] += 1
            for tactel, values in enumerate(_cells(reading), start=1):
                cells = [f"{value:.6g}" for value in values]
                writer.writerow([frame, tactel, *cells, reading.status.name])
    return statuses


CONTACT = ("x_mm", "width_mm", "normal_N", "tangential_N")
PAD_CONTACT = (
    *("x_mm", "y_mm", "long_mm", "short_mm", "orientation_deg"),
    *("normal_N", "tangential_x_N", "tangential_y_N", "spin_Nmm"),
)
"""Columns of a contact on the skin of a strip and of a pad, which have deviations too."""


def save_contacts(
    path: str | os.PathLike[str],
    readings: Iterable[Reading],
    components: tuple[str, ...] = Sensor.components,
) -> Counter[str]:
    """Write readings of a skin, one row for each contact of each frame, whole or not at all.

    Contacts count from 1, the strongest first; 0 is all of them together.

    Parameters
    ----------
    path : path
        Path of the CSV file.
    readings : iterable of Reading
        One for each frame.
    components : tuple of str
        `components` of the sensor, a strip if not given.

    Returns
    -------
    Counter
        Frames by the name of their status.

    Raises
    ------
    FileFormatError
        If the file cannot be written.
    """
    statuses: Counter[str] = Counter()
    columns, cells_of = (
        (CONTACT, _contact_cells) if len(components) == 2 else (PAD_CONTACT, _pad_contact_cells)
    )
    with _new_table(path) as file:
        writer = csv.writer(file)
        std = (f"{name.rpartition('_')[0]}_std_{name.rpartition('_')[2]}" for name in columns)
        writer.writerow(["frame", "contact", *columns, *std, "status"])
        for frame, reading in enumerate(readings):
            statuses[reading.status.name] += 1
            whole = () if reading.total is None else (reading.total,)
            for number, contact in enumerate((*whole, *reading.contacts)):
                cells = [f"{value:.6g}" for value in cells_of(contact)]
                writer.writerow([frame, number, *cells, reading.status.name])
            if not whole:
                writer.writerow([frame, 0, *["nan"] * 2 * len(columns), reading.status.name])
    return statuses


def _contact_cells(contact: Resultant) -> list[float]:
    """Numbers of `CONTACT` and their deviations."""
    std = contact.std
    values = [contact.centre[0] * 1e3, (contact.width or 0.0) * 1e3, *contact.force]
    return [*values, std[5] * 1e3, (contact.width_std or 0.0) * 1e3, *std[:2]]


def _pad_contact_cells(contact: Resultant) -> list[float]:
    """Numbers of `PAD_CONTACT` and their deviations."""
    std, turn = contact.std, np.degrees(1.0)
    values = np.concatenate([contact.values[6:] * 1e3, contact.force, [contact.spin * 1e3]])
    wide = np.concatenate([std[6:] * 1e3, std[:3], [contact.spin_std * 1e3]])
    values[4], wide[4] = values[4] / 1e3 * turn, min(wide[4] / 1e3 * turn, 90.0)
    return [*values, *wide]


def _cells(reading: Reading) -> Array:
    """Numbers of `reading_columns`, a row for each tactel."""
    if reading.forces.shape[1] != 2:
        return np.hstack([reading.forces, reading.std])
    return np.column_stack(
        [
            reading.forces, reading.magnitude, reading.angle,
            reading.std, reading.magnitude_std, reading.angle_std,
        ]
    )  # fmt: skip


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
