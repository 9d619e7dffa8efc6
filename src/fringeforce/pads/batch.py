"""Readings of a recording of a pad, as arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.pads.reading import PadReading
from fringeforce.reading.reading import Status

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class PadBatch:
    """Readings of k frames.

    Attributes
    ----------
    forces : ndarray, shape (k, n, 3)
        N, T_x, T_y of every tactel [N]; not a number for bad frames.
    std : ndarray, shape (k, n, 3)
        Their standard deviations [N].
    chi2 : ndarray, shape (k,)
        Reduced chi-square.
    status : ndarray of Status, shape (k,)
        The verdicts.
    tracked : ndarray of bool, shape (k,)
        Whether a frame was followed from the last one rather than searched.
    covariance : ndarray, shape (k, 3n, 3n), or None
        Of the forces, tactel after tactel [N^2], if it was asked for.
    """

    forces: Array
    std: Array
    chi2: Array
    status: NDArray[np.object_]
    tracked: Mask
    covariance: Array | None

    @classmethod
    def of(cls, frames: int, tactels: int, covariance: bool) -> PadBatch:
        """Room for so many frames."""
        forces, std = np.full((2, frames, tactels, 3), np.nan)
        whole = np.full((frames, 3 * tactels, 3 * tactels), np.nan) if covariance else None
        status = np.full(frames, Status.BAD_FRAME, dtype=object)
        return cls(forces, std, np.full(frames, np.nan), status, np.zeros(frames, bool), whole)

    def __len__(self) -> int:
        return len(self.status)

    def store(self, row: int, reading: PadReading) -> None:
        """Fill in one frame."""
        self.forces[row], self.std[row] = reading.forces, reading.std
        self.chi2[row], self.status[row] = reading.chi2, reading.status
        self.tracked[row] = reading.tracked
        if self.covariance is not None:
            self.covariance[row] = reading.covariance
