"""Readings of a recording as arrays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import prod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.arrays import numbers
from fringeforce.base.errors import InputError
from fringeforce.reading.reading import Reading, Status

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Progress = Callable[[int], None]
"""Called with numbers of frames as they are done, from any thread."""


@dataclass(frozen=True, eq=False)
class Batch:
    """Readings of k frames, as arrays.

    Attributes
    ----------
    forces : ndarray, shape (k, n, components)
        Forces of n tactels as in a single reading [N]: normal and tangential ones of a strip, N,
        T_x, T_y of a pad; not a number for bad frames.
    std : ndarray, shape of the forces
        Their standard deviations [N].
    chi2 : ndarray, shape (k,)
        Reduced chi-square.
    status : ndarray of Status, shape (k,)
        The verdicts.
    tracked : ndarray of bool, shape (k,)
        Whether a frame was followed from the last one rather than searched.
    covariance : ndarray, shape (k, n * components, n * components), or None
        Of each frame's forces in the order of `forces[i].ravel()` [N^2], if it was asked for.
    resultants : ndarray of tuple of Resultant, shape (k,), or None
        Of a skin: all contacts of a frame together, then each, the strongest first; empty tuples
        of frames of which there is nothing to say.  None of tactels.

    Examples
    --------
    >>> model = ff.characterize(ff.load_sensor("saad"))
    >>> frames = model.expose([ff.polar(1.0, angle=10, n=11)] * 3, rng=0)
    >>> batch = ff.Reader(model).read_batch(frames)
    >>> len(batch), batch.forces.shape, batch.covariance.shape
    (3, (3, 11, 2), (3, 22, 22))
    """

    forces: Array
    std: Array
    chi2: Array
    status: NDArray[np.object_]
    tracked: Mask
    covariance: Array | None
    resultants: NDArray[np.object_] | None = None

    @classmethod
    def of(
        cls, frames: int, shape: tuple[int, ...], covariance: bool, resultants: bool = False
    ) -> Batch:
        """Workspace for readings of so many frames, with forces of this shape each."""
        forces, std = np.full((2, frames, *shape), np.nan)
        whole = np.full((frames, prod(shape), prod(shape)), np.nan) if covariance else None
        status = np.full(frames, Status.BAD_FRAME, dtype=object)
        felt = np.empty(frames, dtype=object) if resultants else None
        if felt is not None:
            felt.fill(())
        chi2 = np.full(frames, np.nan)
        return cls(forces, std, chi2, status, np.zeros(frames, bool), whole, felt)

    def __len__(self) -> int:
        return len(self.status)

    def __getitem__(self, rows: slice) -> Batch:
        """Some of the frames; its arrays are views."""
        arrays = {name: array[rows] for name, array in vars(self).items() if array is not None}
        return replace(self, **arrays)

    def store(self, row: int, reading: Reading) -> None:
        """Fill in one frame."""
        self.forces[row], self.std[row] = reading.forces, reading.std
        self.chi2[row], self.status[row] = reading.chi2, reading.status
        self.tracked[row] = reading.tracked
        if self.covariance is not None:
            self.covariance[row] = reading.covariance
        if self.resultants is not None and reading.total is not None:
            self.resultants[row] = (reading.total, *reading.contacts)


def grey_levels(values: ArrayLike) -> NDArray[Any]:
    """Grey levels in their own type if they are plain real numbers, or else as floats.

    Raises
    ------
    ValueError
        If they are no numbers.
    """
    levels = np.asarray(values)
    if isinstance(values, np.ma.MaskedArray) or levels.dtype.kind not in "uif":
        return numbers(values, "Grey levels")
    return levels


def checked_recording(frames: ArrayLike, shape: tuple[int, ...]) -> NDArray[Any]:
    """Frames as an array of shape (k, ...).

    Parameters
    ----------
    frames : array_like
        Grey levels.
    shape : tuple of int
        Of each of the sensor's frames.

    Raises
    ------
    InputError
        If they are none of this sensor.
    """
    try:
        levels = grey_levels(frames)
    except ValueError as error:
        raise InputError(f"A recording is an array of grey levels, not this: {error}.") from None
    if levels.shape[1:] != shape:
        raise InputError(
            f"A recording of shape {levels.shape} and type {levels.dtype} does not fit; this "
            f"sensor's are numbers of shape (frames, {', '.join(map(str, shape))})."
        )
    return levels
