"""Readings as CSV, one row for each tactel of each line or image, named as in `tables`.

Of a skin there is one row for each contact of each line, after one of all together, contact 0.
"""

from __future__ import annotations

import os

import numpy as np

from fringeforce.acquisition.sinks.contact_rows import contact_rows, is_skin
from fringeforce.acquisition.sinks.csv_rows import prepare, rows
from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.base.storage import writing
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.io.tables import POLAR_STD, contact_columns, reading_columns


class CsvSink(Sink):
    """Appends to a CSV file; what was written reaches the system before more is taken.

    Parameters
    ----------
    path : path
        Path of the file, which is written anew.
    sensor : Sensor or Pad
        Design of the sensor.

    Raises
    ------
    FileFormatError
        If the file cannot be written.
    """

    interval = 0.05

    def __init__(self, path: str | os.PathLike[str], sensor: Sensor | Pad) -> None:
        self.name = f"CSV {os.fspath(path)}"
        if is_skin(sensor):
            what, numbers = "contact", contact_columns(sensor.components)
        else:
            what = "tactel"
            numbers = [name for name in reading_columns(sensor.components) if name not in POLAR_STD]
        columns = "frame", what, "time_s", *numbers, "chi2", "status"
        with writing(path):
            self._file = open(path, "wb")  # noqa: SIM115
        prepare()
        self._file.write((",".join(columns) + "\r\n").encode())
        self._file.flush()

    def write(self, readings: Readings) -> None:
        """Append a block."""
        made = _rows if readings.resultants is None else _contact_rows
        self._file.write(made(readings))
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _rows(readings: Readings) -> bytes:
    """All rows of a block."""
    forces, std = readings.forces, readings.std
    chi2 = np.broadcast_to(readings.chi2[:, None, None], (*forces.shape[:2], 1))
    columns = [forces, std, chi2]
    if forces.shape[2] == 2:
        normal, tangential = np.moveaxis(forces, 2, 0)
        polar = np.hypot(normal, tangential), np.degrees(np.arctan2(tangential, normal))
        columns.insert(1, np.stack(polar, axis=2))
    words = np.array([status.name for status in readings.status], dtype=bytes)
    return rows(readings.first, readings.timestamps, np.concatenate(columns, axis=2), words)


def _contact_rows(readings: Readings) -> bytes:
    """All rows of a block of a skin's readings."""
    text = list[str]()
    for i, contacts in enumerate(contact_rows(readings)):
        begin = readings.first + i, f"{readings.timestamps[i]:.6f}"
        end = f"{readings.chi2[i]:.6g},{readings.status[i].name}\r\n"
        for number, row in enumerate(contacts):
            cells = ",".join(f"{value:.6g}" for value in row)
            text.append(f"{begin[0]},{number},{begin[1]},{cells},{end}")
    return "".join(text).encode()
