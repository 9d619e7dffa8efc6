"""What residuals leave on the mean of many frames, where one frame is too noisy to tell.

Loads at a mirror image that one frame can hardly tell from the truth leave the same small waves in
every frame; so does a wrong model.  On the mean they stand out against noise that averages away.
A search tells the two apart: what it confirms is the model's, and is allowed for from then on.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from fringeforce.estimation.compiling import entry

COUNT, VARIANCE, LENIENCE, ALARMED = range(4)
"""What a trend knows besides the mean: frames in it; the variance of noise in it, relative to one
frame; factor of its limit; and whether it was exceeded."""
TRENDS = 4
LONGEST = 32
"""Number of frames that the mean forgets in."""
LIMIT = 6.0
"""Deviations of pure noise beyond which the mean is none."""
MOST = 64.0
"""Largest factor of the limit."""


def begin_trend(state, confirmed: bool) -> None:
    """Begin anew after a search; with twice the limit if it confirmed what the mean had doubted."""
    allowed = state[LENIENCE] * (2 if state[ALARMED] else 1) if confirmed else 1
    state[:] = 0, 0, min(max(allowed, 1), MOST), 0


@entry
def lingers(sums, freedom, trend, state) -> bool:
    """Take in the sums over neighbours of one frame; returns whether their mean is no noise.

    Parameters
    ----------
    sums : ndarray, shape (groups or more,)
        Of residuals, in units of their noise.
    freedom : float
        Degrees of freedom of their squares.
    trend, state : ndarray, shapes (groups,) and (TRENDS,)
        The mean, and what is known of it.
    """
    state[COUNT] += 1
    share = max(1 / LONGEST, 1 / state[COUNT])
    state[VARIANCE] = (1 - share) ** 2 * state[VARIANCE] + share**2
    squares, part = np.float32(0), np.float32(share)
    for j in range(len(trend)):
        trend[j] += part * (sums[j] - trend[j])
        squares += trend[j] * trend[j]
    allowed = freedom + state[LENIENCE] * LIMIT * sqrt(2 * freedom)
    state[ALARMED] = squares > allowed * state[VARIANCE]
    return state[ALARMED] > 0
