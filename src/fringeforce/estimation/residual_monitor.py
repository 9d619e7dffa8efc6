"""What residuals leave on the mean of many frames, where one frame is too noisy to tell.

Loads at a mirror image that one frame can hardly tell from the truth leave the same small waves in
every frame; so does a wrong model.  On the mean they stand out against noise that averages away.
A search tells the two apart: what it confirms is the model's, and is allowed for from then on.
"""

from __future__ import annotations

import numpy as np

from fringeforce.estimation.compiling import entry

TREND = np.dtype(
    [("count", "f8"), ("variance", "f8"), ("lenience", "f8"), ("alarmed", "?")], align=True
)
"""What is known of a trend besides the mean: frames in it; the variance of noise in it, relative to
one frame; factor of what its limit leaves above the mean of noise; whether it was exceeded."""
REMEMBERED = 32
"""Number of frames in which a mean of residuals forgets."""
MOST = 64.0
"""Largest factor of the limit."""


def begin_trend(state, confirmed: bool) -> None:
    """Begin anew after a search; with twice the limit if it confirmed what the mean had doubted."""
    allowed = state["lenience"] * (2 if state["alarmed"] else 1) if confirmed else 1
    state["count"], state["variance"], state["alarmed"] = 0, 0, False
    state["lenience"] = min(max(allowed, 1), MOST)


@entry
def persists(sums, freedom, limit, trend, state) -> bool:
    """Take in the sums over neighbours of one frame; returns whether their mean is no noise.

    Parameters
    ----------
    sums : ndarray, shape (groups or more,)
        Of residuals, in units of their noise.
    freedom : float
        Degrees of freedom of their squares.
    limit : float
        Of their squares, for noise; see `residual_test.square_limit`.
    trend : ndarray, shape (groups,)
        The mean.
    state : record of TREND
        What is known of it.
    """
    state.count += 1
    share = max(1 / REMEMBERED, 1 / state.count)
    state.variance = (1 - share) ** 2 * state.variance + share**2
    squares, part = np.float32(0), np.float32(share)
    for j in range(len(trend)):
        trend[j] += part * (sums[j] - trend[j])
        squares += trend[j] * trend[j]
    allowed = freedom + state.lenience * (limit - freedom)
    state.alarmed = squares > allowed * state.variance
    return state.alarmed
