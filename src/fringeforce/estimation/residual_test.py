"""Whether what is left of a frame looks like noise: the one test, at a stated false-alarm rate.

The squares of f independent residuals of pure noise add up to a chi-square number of f degrees of
freedom; a sum beyond the limit that noise exceeds with a given chance is a misfit.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

Array = NDArray[np.float64]

GROUP = 16
"""Neighbouring pixels that are summed to find a misfit that noise would average away."""
FALSE_ALARM = 1e-7
"""Chance that noise alone exceeds a limit, beyond which a frame is not of its model: once in five
minutes at 30,000 frames per second."""
FALSE_VERDICT = 1e-5
"""Chance that noise alone has a frame judged wrongly: that the right explanation is refused, or
that some load explains it better than no contact.  The latter costs no more than a frame of loads
that are near zero, and what is touched lightly shows earlier."""
PLAIN = 0.01
"""Chance of noise below which residuals are not plainly noise: of a hundred good explanations one
is looked at again."""
NEARLY_EXPLAINED = 1.2
"""Reduced chi-square below which what is left may be due to what is not fitted yet."""


def square_limit(freedom: float, chance: float = FALSE_ALARM) -> float:
    """Sum of squares that noise of some degrees of freedom, at least one, exceeds by chance.

    Parameters
    ----------
    freedom : float
        Degrees of freedom.
    chance : float
        The false-alarm rate.
    """
    return float(chdtri(max(freedom, 1.0), chance))


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
    residuals: Array,
    unknowns: int,
    chance: float = FALSE_ALARM,
    taken: float | None = None,
    grouped: bool = True,
) -> bool:
    """Whether residuals are as small and as unordered as noise.

    The sum of their squares is tested, and that of the squared sums over neighbouring pixels.  A
    wrong model leaves waves that are far longer than a pixel, and those sums show them when they
    are still small against the noise of one pixel.

    Parameters
    ----------
    residuals : ndarray, shape (P,)
        Residuals in units of the noise, in the order of the pixels.
    unknowns : int
        Loads that were fitted.
    chance : float
        The false-alarm rate of each of the two.
    taken : float, optional
        Degrees of freedom that the fit takes from the sums; see `absorbed`.  As many as loads if
        not given, which is the most that it can be.
    grouped : bool
        Whether the sums are tested as well.
    """
    tests = [(residuals, float(unknowns))]
    if grouped:
        sums = group_sums(residuals[:, None])[:, 0]
        tests.append((sums, unknowns if taken is None else taken))
    return all(
        float(values @ values) < square_limit(len(values) - lost, chance) for values, lost in tests
    )


def bumps_are_noise(residuals: Array, shortest: int, chance: float = FALSE_ALARM) -> bool:
    """Whether no stretch of residuals adds up to more than noise would.

    A weak load leaves a bump no shorter than the cover is thick, which the squares of all residuals
    hide.  Stretches of `shortest` pixels and of twice, four times, ... as many are tested, with the
    chance shared between them.

    Parameters
    ----------
    residuals : ndarray, shape (P,)
        In units of the noise; zero where a pixel is not used.
    shortest : int
        Pixels of the shortest stretch.
    chance : float
        The false-alarm rate of all together.
    """
    sums = np.concatenate([[0.0], np.cumsum(residuals)])
    lengths = [n for k in range(4) if (n := max(shortest, 1) << k) < len(sums)]
    tested = sum(len(sums) - n for n in lengths)
    largest = max((np.square(sums[n:] - sums[:-n]).max() / n for n in lengths), default=0.0)
    return bool(largest < square_limit(1, chance / max(tested, 1)))


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
