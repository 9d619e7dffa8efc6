"""Whether what is left of a frame looks like noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GROUP = 16
"""Neighbouring pixels that are summed to find a misfit that noise would average away."""
FEW = 2
"""Numbers for each unknown below which it is not clear how much of them the unknowns absorb."""
DEVIATIONS = 6.0
"""Standard deviations of pure noise beyond which a misfit is real."""


def reduced_chi_square(residuals: Array, unknowns: int) -> float:
    """Mean square of the residuals per degree of freedom; one for pure noise.

    Parameters
    ----------
    residuals : ndarray, shape (P,)
        Residuals in units of the noise.
    unknowns : int
        Loads that were fitted.
    """
    return float(residuals @ residuals) / max(len(residuals) - unknowns, 1)


def is_noise(residuals: Array, unknowns: int, deviations: float = DEVIATIONS) -> bool:
    """Whether residuals are as small and as unordered as noise.

    Two tests: their mean square, and the mean square of sums over neighbouring pixels.  A wrong
    model leaves waves that are far longer than a pixel, and the second test sees them when they are
    still small against the noise of one pixel.

    Parameters
    ----------
    residuals : ndarray, shape (P,)
        Residuals in units of the noise, in the order of the pixels.
    unknowns : int
        Loads that were fitted.
    deviations : float
        Standard deviations of pure noise that are allowed.
    """
    sums = group_sums(residuals[:, None])[:, 0]
    return all(
        float(values @ values) < freedom + deviations * np.sqrt(2 * freedom)
        for values in (residuals, sums)
        for freedom in (degrees_of_freedom(len(values), unknowns),)
    )


def degrees_of_freedom(values: int, unknowns: int) -> int:
    """Mean sum of squares of what is left of so many numbers of unit noise, at least.

    Loads absorb one for each, if the numbers are many; where they are few, as sums over neighbours
    are for a coarse camera, what is absorbed depends on the fringes, and nothing is counted on.
    """
    return values - unknowns if values >= FEW * unknowns else values


def group_sums(values: Array) -> Array:
    """Sums over neighbouring pixels, scaled to keep unit noise, shape (P // GROUP, ...)."""
    groups = len(values) // GROUP
    sums = values[: groups * GROUP].reshape(groups, GROUP, -1).sum(axis=1)
    return sums / np.sqrt(GROUP)
