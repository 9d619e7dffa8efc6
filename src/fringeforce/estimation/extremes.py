"""Gain and visibility of the light, and blur, from the extremes of a frame.

Where the phase crosses a multiple of pi the light is as dark or as bright as it can be,
g (1 -+ V c) / 2 with c = exp(-(k s)^2 / 2) for a phase that runs by k per pixel behind a point
spread of deviation s; where it only turns there, the extreme lies inside.  Each extreme gives its
level and, by its curvature, k; which of the two it is stays open: the likelihood is a mixture.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from fringeforce.estimation.compiling import copied, entry, inner
from fringeforce.estimation.frame_climb import factorised, substituted
from fringeforce.estimation.frame_exposure import dot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SMOOTHING = 4.0
"""Pixels over which a frame is smoothed before its extremes are looked for."""
CROSSING = 0.7
"""Share of extremes that cross, before anything is known: of random loads it is 0.6 to 0.8."""
EXTREME_ERROR = 0.006
"""Error of an extreme's level by the curvature of the phase, as a share of the amplitude."""
STARTS = np.array([[a, b, c] for a in (-1.5, 0.0, 1.5) for b in (-1.0, 0.5) for c in (-0.5,)])
"""Gain, visibility and blur from which the likelihood is climbed, in their deviations."""
NEWTON_STEPS = 12
"""Newton steps; the likelihood is nearly Gaussian about its top."""


@entry
def _fitted(line, pace, places):
    """Place, sign, level, pace and squared relative deviation of extremes, shape (k, 5)."""
    found, count = np.empty((len(places), 5)), 0
    for p in places:
        sign = 1.0 if line[p] > 0.5 else -1.0
        k = min(max(pace[p], 0.015), 0.2)
        half = int(min(max(1.1 / k, 6.0), 30.0))
        if p < half or p + half >= len(line):
            continue
        top = turn = tilt = spread = 0.0
        for _ in range(2):
            s0 = s1 = s2 = y0 = y1 = y2 = q = 0.0
            for t in range(-half, half + 1):
                curve = t * t - k * k * t**4 / 12.0
                value = line[p + t]
                s0 += 1.0
                s1 += curve
                s2 += curve * curve
                y0 += value
                y1 += curve * value
                q += t * t
                y2 += t * value
            determinant = s0 * s2 - s1 * s1
            top, turn = (s2 * y0 - s1 * y1) / determinant, (s0 * y1 - s1 * y0) / determinant
            tilt, spread = y2 / q, s2 / determinant
            reach = max(abs(top - 0.5), 0.2)
            k = min(max(np.sqrt(max(2 * abs(turn), 1e-9) / reach), 0.008), 0.25)
        if turn * sign >= 0 or abs(tilt) > 1.4 * half * abs(turn):
            continue
        middle = -tilt / (2 * turn)
        level = top + tilt * middle / 2
        here = p + middle
        if count > 0 and found[count - 1, 1] == sign and here - found[count - 1, 0] < 8:
            if sign * level <= sign * found[count - 1, 2]:
                continue
            count -= 1
        found[count, 0], found[count, 1], found[count, 2] = here, sign, level
        found[count, 3], found[count, 4] = k, 1.7 * spread
        count += 1
    return found[:count]


@inner
def _predicted(sign, pace, means, stds, e):
    """Level of a crossing, and its derivatives by gain, visibility and blur in their deviations."""
    g, v = means[0] + stds[0] * e[0], means[1] + stds[1] * e[1]
    s = max(means[2] + stds[2] * e[2], 0.0)
    contrast = np.exp(-((pace * s) ** 2) / 2)
    by_gain = (1 + sign * v * contrast) / 2
    by_visibility = g * sign * contrast / 2
    by_blur = -by_visibility * v * pace * pace * s
    return g * by_gain, stds[0] * by_gain, stds[1] * by_visibility, stds[2] * by_blur


@entry
def _lit(found, means, stds):
    """Gain, visibility and blur in their deviations at the top of the likelihood of extremes."""
    best, top = np.zeros(3), -np.inf
    turning = np.log((1 - CROSSING) / 0.5)
    e, slope, step, column = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    normal, root, none = np.empty((3, 3)), np.empty((3, 3)), np.zeros((3, 3))
    for start in range(len(STARTS)):
        for i in range(3):
            e[i] = STARTS[start, i] if stds[i] > 0 else 0.0
        for turn in range(NEWTON_STEPS + 1):
            total = -dot(e, e) / 2
            for i in range(3):
                slope[i] = e[i]
                for j in range(3):
                    normal[i, j] = 1.0 if i == j else 0.0
            for k in range(len(found)):
                sign, level, deviation = found[k, 0], found[k, 1], found[k, 2]
                expected, a, b, c = _predicted(sign, found[k, 3], means, stds, e)
                miss = sign * (level - expected) / deviation
                crosses = np.log(CROSSING / np.sqrt(2 * np.pi) / deviation) - miss**2 / 2
                turns = turning - (miss**2 / 2 if miss > 0 else 0.0)
                both = max(crosses, turns) + np.log1p(np.exp(-abs(crosses - turns)))
                total += both
                weight = np.exp(crosses - both) / deviation**2
                column[0], column[1], column[2] = a, b, c
                for i in range(3):
                    slope[i] -= weight * column[i] * (level - expected)
                    for j in range(3):
                        normal[i, j] += weight * column[i] * column[j]
            if turn == NEWTON_STEPS:
                if total > top:
                    top = total
                    copied(e, best)
                break
            factorised(normal, none, 0.0, root)  # positive definite: it began as the identity
            substituted(root, slope, step)
            for i in range(3):
                e[i] += min(max(step[i], -1.0), 1.0)
    return best


def extremes(line: Array, pace: Array, variance: float, clipped: Mask) -> Array:
    """Dark and bright extremes of a line of fringes.

    Parameters
    ----------
    line : ndarray, shape (P,)
        Normalised intensity, noise included.
    pace : ndarray, shape (P,)
        Local pace of the phase [rad per pixel].
    variance : float
        Of the noise of one pixel.
    clipped : ndarray of bool, shape (P,)
        Pixels that the converter's end cut off; what turns there is no extreme.

    Returns
    -------
    ndarray, shape (k, 4)
        Sign (1 bright, -1 dark), level, its standard deviation, and pace [rad per pixel].
    """
    smooth = gaussian_filter1d(line, SMOOTHING, mode="nearest")
    steps = np.diff(smooth)
    turns = np.flatnonzero(steps[:-1] * steps[1:] <= 0) + 1
    bright = smooth[turns] > 0.5
    peaks = (steps[turns] <= 0) & (steps[turns - 1] >= 0)
    turns = turns[(bright == peaks) & ~clipped[turns]]
    found = _fitted(line, gaussian_filter1d(pace, 8.0), turns)
    deviation = np.sqrt(variance * found[:, 4] + EXTREME_ERROR**2)
    return np.column_stack([found[:, 1], found[:, 2], deviation, found[:, 3]])


def light_of_extremes(
    found: Array, gain: float, visibility: tuple[float, float], blur: tuple[float, float]
) -> tuple[float, float, float]:
    """Gain, visibility and blur that explain extremes best, and what is known of them before.

    Parameters
    ----------
    found : ndarray, shape (k, 4)
        As of `extremes`.
    gain : float
        Standard deviation of the gain about 1.
    visibility, blur : tuple of float
        Mean and standard deviation; blur in pixels.
    """
    means, stds = np.array([1.0, visibility[0], blur[0]]), np.array([gain, visibility[1], blur[1]])
    if len(found) and stds.any():
        means = means + stds * _lit(np.ascontiguousarray(found), means, stds)
    return float(means[0]), float(means[1]), max(float(means[2]), 0.0)
