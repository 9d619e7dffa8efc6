"""Readings as CSV, one row for each tactel of each line or image, named as in `tables`."""

from __future__ import annotations

import os

import numpy as np

from fringeforce.acquisition.sinks.csv_rows import prepare, rows
from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.base.storage import writing
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.io.tables import POLAR_STD, reading_columns


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
        numbers = [name for name in reading_columns(sensor.components) if name not in POLAR_STD]
        columns = "frame", "tactel", "time_s", *numbers, "chi2", "status"
        with writing(path):
            self._file = open(path, "wb")  # noqa: SIM115
        prepare()
        self._file.write((",".join(columns) + "\r\n").encode())
        self._file.flush()

    def write(self, readings: Readings) -> None:
        """Append a block."""
        self._file.write(_rows(readings))
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
