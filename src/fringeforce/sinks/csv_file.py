"""Readings as CSV, one row for each tactel of each line, in the columns of `fringeforce.tables`."""

from __future__ import annotations

import os

import numpy as np

from fringeforce.errors import FileFormatError
from fringeforce.sinks.sink import Readings, Sink
from fringeforce.tables import CARTESIAN, POLAR

DEVIATIONS = ("normal_std_N", "tangential_std_N")
COLUMNS = ("frame", "tactel", "time_s", *CARTESIAN, *POLAR, *DEVIATIONS, "chi2", "status")
ROW = "%d,%d,%.6f" + 7 * ",%.6g" + ",%s\r\n"


class CsvSink(Sink):
    """Appends to a CSV file; every block reaches the system before the next is taken.

    Parameters
    ----------
    path : path
        Of the file, which is written anew.

    Raises
    ------
    FileFormatError
        If the file cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.name = f"CSV {os.fspath(path)}"
        try:
            self._file = open(path, "w", newline="", encoding="utf-8")  # noqa: SIM115
        except OSError as error:
            raise FileFormatError(f"{path} cannot be written: {error.strerror}.") from None
        self._file.write(",".join(COLUMNS) + "\r\n")
        self._file.flush()

    def write(self, readings: Readings) -> None:
        """Append a block."""
        self._file.write(_rows(readings))
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def _rows(readings: Readings) -> str:
    """All rows of a block, formatted at once: five times faster than row by row."""
    k, _, n = readings.forces.shape
    normal, tangential = readings.forces[:, 0], readings.forces[:, 1]
    columns = (
        np.repeat(np.arange(readings.first, readings.first + k), n),
        np.tile(np.arange(1, n + 1), k),
        np.repeat(readings.timestamps, n),
        normal,
        tangential,
        np.hypot(normal, tangential),
        np.degrees(np.arctan2(tangential, normal)),
        readings.std[:, 0],
        readings.std[:, 1],
        np.repeat(readings.chi2, n),
        np.repeat(np.array([status.name for status in readings.status], dtype=object), n),
    )
    cells = np.empty((k * n, len(columns)), dtype=object)
    for place, column in enumerate(columns):
        cells[:, place] = np.ravel(column)
    return ROW * (k * n) % tuple(cells.ravel().tolist())
