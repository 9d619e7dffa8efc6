"""Whether what is left of a frame looks like noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GROUP = 16
"""Neighbouring pixels that are summed to find a misfit that noise would average away."""
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


def is_noise(
    residuals: Array, unknowns: int, deviations: float = DEVIATIONS, taken: float | None = None
) -> bool:
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
    taken : float, optional
        Degrees of freedom that the fit takes from the sums; see `absorbed`.  As many as loads if
        not given, which is the most that it can be.
    """
    sums = group_sums(residuals[:, None])[:, 0]
    fitted = unknowns if taken is None else taken
    return all(
        float(values @ values) < freedom + deviations * np.sqrt(2 * freedom)
        for values, lost in ((residuals, unknowns), (sums, fitted))
        for freedom in (max(len(values) - lost, 1),)
    )


def absorbed(slope: Array, influence: Array, covariance: Array) -> float:
    """Degrees of freedom that fitted loads take from sums over neighbouring pixels.

    The trace of the part of the fit's projection that the sums see; it falls short of the number of
    loads where fringes are no wider than the pixels that are summed.

    Parameters
    ----------
    slope : ndarray, shape (P,)
        Derivative of the grey level by the phase, in units of the noise.
    influence : ndarray, shape (P, m)
        Influence matrix [rad/N].
    covariance : ndarray, shape (m, m)
        Of the fitted loads, from noise alone [N^2].
    """
    tangent = group_sums(slope[:, None] * influence)
    return float(np.clip(((tangent @ covariance) * tangent).sum(), 0, len(covariance)))


def group_sums(values: Array) -> Array:
    """Sums over neighbouring pixels, scaled to keep unit noise, shape (P // GROUP, ...)."""
    groups = len(values) // GROUP
    sums = values[: groups * GROUP].reshape(groups, GROUP, -1).sum(axis=1)
    return sums / np.sqrt(GROUP)
