"""What every sink is: something that readings are written to, a block at a time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from fringeforce.acquisition.consecutive import Consecutive
from fringeforce.reading.reading import Status

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Readings(Consecutive):
    """Readings of consecutive lines, or images of a pad.

    Attributes
    ----------
    first : int
        Running number of the first line.
    timestamps : ndarray, shape (k,)
        When every line was exposed [s since 1970].
    forces, std : ndarray, shape (k, n, components)
        Forces of n tactels and their standard deviations [N]: N and T of a strip, N, T_x and T_y of
        a pad.
    chi2 : ndarray, shape (k,)
        Reduced chi-squares.
    status : sequence of Status, length k
        Verdicts.
    lines : ndarray, shape (k, *frame_shape)
        The grey levels that were read.
    resultants : ndarray of tuple of Resultant, shape (k,), or None
        Contacts on a skin, as of `fringeforce.reading.batch.Batch`; None of tactels.
    """

    COLUMNS = ("timestamps", "forces", "std", "chi2", "status", "lines", "resultants")
    first: int
    timestamps: Array
    forces: Array
    std: Array
    chi2: Array
    status: Sequence[Status]
    lines: Array
    resultants: Array | None = None


class Sink(ABC):
    """A place for readings.

    Attributes
    ----------
    name : str
        What to call it.
    interval : float
        Time for which readings are gathered before they are written together; none for a sink
        that passes every block on at once [s].
    """

    name: str
    interval: float = 0.0

    @abstractmethod
    def write(self, readings: Readings) -> None:
        """Take a block; what CSV and HDF5 files took survives any end of this process.

        Raises
        ------
        OSError
            If there is no room or no way any more.
        """

    @abstractmethod
    def close(self) -> None:
        """Finish."""

    @property
    def remark(self) -> str:
        """What a person should know, such as clients that are too slow; empty if nothing."""
        return ""
