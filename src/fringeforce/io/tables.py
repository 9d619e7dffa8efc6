"""Forces as CSV, one row for each tactel of each frame."""

from __future__ import annotations

import csv
import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TextIO

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.base.errors import FileFormatError
from fringeforce.base.storage import whole_file
from fringeforce.contacts.resultant import Resultant
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.io.load_columns import load_columns
from fringeforce.io.load_rows import forces_of, frame_numbers, tactel_numbers
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
    table = load_columns(path)
    values = forces_of(table, components)
    named = np.isfinite(table.get("tactel")) | values.any(axis=1)
    frame, tactel = frame_numbers(table), tactel_numbers(table, tactels, named)
    if not table.lines:
        raise FileFormatError(f"{path} holds no loads; give one row for each loaded tactel.")
    forces = np.zeros((frame.max() + 1, tactels, len(components)))
    forces[frame[named], tactel[named]] = values[named]
    return forces


def load_temperatures(path: str | os.PathLike[str]) -> tuple[Array, Array]:
    """Read a log of temperatures: columns time_s and temperature_degC.

    Returns
    -------
    times, temperatures : ndarray, shape (rows,)
        [s], ascending, and [degC].

    Raises
    ------
    FileFormatError
        If a column or a number is missing, there are no rows, or times do not ascend.
    """
    table = load_columns(path)
    times, warm = table.get("time"), table.get("temperature")
    if not (len(times) and np.isfinite(times).all() and np.isfinite(warm).all()):
        raise FileFormatError(
            f"{table.name} is no log of temperatures: it needs the columns time_s and "
            "temperature_degC, with a number in every row."
        )
    if (np.diff(times) <= 0).any():
        row = int(np.argmax(np.diff(times) <= 0)) + 1
        raise FileFormatError(f"{table.where(row)}: times have to ascend; sort the log.")
    return times, warm


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
    columns = ("tactel", *reading_columns(components))
    return _save(path, columns, readings, lambda reading: enumerate(_cells(reading), start=1))


CONTACT = ("x_mm", "width_mm", "normal_N", "tangential_N")
PAD_CONTACT = (
    *("x_mm", "y_mm", "long_mm", "short_mm", "orientation_deg"),
    *("normal_N", "tangential_x_N", "tangential_y_N", "spin_Nmm"),
)
"""Numbers of a contact on the skin of a strip and of a pad, which have deviations too."""


def contact_columns(components: tuple[str, ...] = Sensor.components) -> tuple[str, ...]:
    """Names of the numbers of a contact on a skin, and of their deviations."""
    columns = CONTACT if len(components) == 2 else PAD_CONTACT
    parts = (name.rpartition("_") for name in columns)
    return *columns, *(f"{name}_std_{unit}" for name, _, unit in parts)


def contact_cells(contact: Resultant) -> list[float]:
    """Numbers of `contact_columns`."""
    std = contact.std
    if len(contact.force) == 2:
        values = [contact.centre[0] * 1e3, (contact.width or 0.0) * 1e3, *contact.force]
        wide = [std[5] * 1e3, (contact.width_std or 0.0) * 1e3, *std[:2]]
        return [float(value) for value in (*values, *wide)]
    turn = np.degrees(1.0)
    found = np.concatenate([contact.values[6:] * 1e3, contact.force, [contact.spin * 1e3]])
    spread = np.concatenate([std[6:] * 1e3, std[:3], [contact.spin_std * 1e3]])
    found[4], spread[4] = found[4] / 1e3 * turn, min(spread[4] / 1e3 * turn, 90.0)
    return [*found.tolist(), *spread.tolist()]


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
    columns = contact_columns(components)

    def rows(reading: Reading) -> Iterable[tuple[int, Iterable[float]]]:
        if reading.total is None:
            return [(0, [np.nan] * len(columns))]
        return enumerate(map(contact_cells, (reading.total, *reading.contacts)))

    return _save(path, ("contact", *columns), readings, rows)


def _save(
    path: str | os.PathLike[str],
    columns: Iterable[str],
    readings: Iterable[Reading],
    rows: Callable[[Reading], Iterable[tuple[int, Iterable[float]]]],
) -> Counter[str]:
    """Write what `rows` gives for every reading, a number and values each; count the statuses."""
    statuses: Counter[str] = Counter()
    with _new_table(path) as file:
        writer = csv.writer(file)
        writer.writerow(["frame", *columns, "status"])
        for frame, reading in enumerate(readings):
            status = reading.status.name
            statuses[status] += 1
            for number, values in rows(reading):
                writer.writerow([frame, number, *(f"{value:.6g}" for value in values), status])
    return statuses


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
