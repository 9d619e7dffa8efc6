"""Readings as CSV, one row for each tactel of each line, in the columns of `fringeforce.tables`."""

from __future__ import annotations

import os

import numpy as np

from fringeforce.errors import FileFormatError
from fringeforce.sinks.csv_rows import rows
from fringeforce.sinks.sink import Readings, Sink
from fringeforce.tables import CARTESIAN, POLAR

DEVIATIONS = ("normal_std_N", "tangential_std_N")
COLUMNS = ("frame", "tactel", "time_s", *CARTESIAN, *POLAR, *DEVIATIONS, "chi2", "status")


class CsvSink(Sink):
    """Appends to a CSV file; what was written reaches the system before more is taken.

    Parameters
    ----------
    path : path
        Of the file, which is written anew.

    Raises
    ------
    FileFormatError
        If the file cannot be written.
    """

    interval = 0.05

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.name = f"CSV {os.fspath(path)}"
        try:
            self._file = open(path, "wb")  # noqa: SIM115
        except OSError as error:
            raise FileFormatError(f"{path} cannot be written: {error.strerror}.") from None
        self._file.write((",".join(COLUMNS) + "\r\n").encode())
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
    normal, tangential = readings.forces[:, 0], readings.forces[:, 1]
    columns = (
        normal,
        tangential,
        np.hypot(normal, tangential),
        np.degrees(np.arctan2(tangential, normal)),
        readings.std[:, 0],
        readings.std[:, 1],
        np.broadcast_to(readings.chi2[:, None], normal.shape),
    )
    words = np.array([status.name for status in readings.status], dtype=bytes)
    return rows(readings.first, readings.timestamps, np.stack(columns, axis=2), words)
