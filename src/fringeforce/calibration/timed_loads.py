"""A log of loads by time beside the frames that it belongs to."""

from __future__ import annotations

from dataclasses import dataclass

from fringeforce.base.arrays import Array
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.load_log import LoadLog


@dataclass(frozen=True, eq=False)
class TimedLoads:
    """A log of loads by time, and when the frames were taken.

    Attributes
    ----------
    log : LoadLog
        The log.
    times : ndarray, shape (F,)
        Of the frames [s].
    delay, unsure : float
        By how much the log is behind, at first, and how far that may be wrong [s].
    """

    log: LoadLog
    times: Array
    delay: float
    unsure: float

    def at(self, delay: float) -> BenchLoads:
        """Loads of the frames for one delay of the log [s]."""
        return self.log.at(self.times, delay)
