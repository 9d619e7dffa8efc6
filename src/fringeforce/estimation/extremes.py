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
OUTLYING, OUTLYING_ERROR = 0.05, 0.05
"""Share of extremes whose level is off by more than noise, where the phase bends or neighbours are
near, and the deviation of that, as a share of the amplitude."""
GAIN_STEP, LIKELY_GAIN = 0.03, 3.5
"""Gains from which the likelihood is climbed lie so far apart, less than extremes that are off
reach, up to so many standard deviations."""
BLUR_START, POWER_STARTS = -0.5, (-1.5, 0.0, 1.5)
"""Blur and power of the response from which it is climbed, in their deviations: much blur makes
crossings of all turns."""
NEWTON_STEPS = 10
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
def _predicted(found, gains, means, stds, e, column):
    """Level of a crossing; its derivatives by all unknowns into `column`.

    The camera's response takes the share x = a l + b of the full scale to x^r.
    """
    modes, sign, pace, a, b = len(gains), found[0], found[3], found[4], found[5]
    g = 1 + dot(gains, e[:modes])
    v, s = means[0] + stds[0] * e[modes], max(means[1] + stds[1] * e[modes + 1], 0.0)
    contrast = np.exp(-((pace * s) ** 2) / 2)
    for k in range(modes):
        column[k] = gains[k] * (1 + sign * v * contrast) / 2
    column[modes] = stds[0] * g * sign * contrast / 2
    column[modes + 1] = -stds[1] * g * sign * contrast / 2 * v * pace * pace * s
    column[modes + 2] = 0.0
    light = g * (1 + sign * v * contrast) / 2
    if stds[2] == 0:
        return light
    share, r = max(a * light + b, 1e-6), 1 + stds[2] * e[modes + 2]
    seen = share**r
    for k in range(modes + 2):
        column[k] *= r * seen / share
    column[modes + 2] = stds[2] * seen * np.log(share) / a
    return (seen - b) / a


@entry
def _lit(found, gains, means, stds, begins):
    """Unknowns of the light at the top of the likelihood that has the largest mass (Laplace).

    It is climbed from several begins.
    """
    size = len(begins[0])
    best, top = np.zeros(size), -np.inf
    inside, off = np.log((1 - CROSSING) / 0.5), np.log(OUTLYING / np.sqrt(2 * np.pi))
    e, slope, step, column = np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    normal, root, none = np.empty((size, size)), np.empty((size, size)), np.zeros((size, size))
    for start in range(len(begins)):
        copied(begins[start], e)
        for turn in range(NEWTON_STEPS + 1):
            total = -dot(e, e) / 2
            for i in range(size):
                slope[i] = e[i]
                for j in range(size):
                    normal[i, j] = 1.0 if i == j else 0.0
            for k in range(len(found)):
                sign, level, deviation = found[k, 0], found[k, 1], found[k, 2]
                miss = sign * (level - _predicted(found[k], gains[k], means, stds, e, column))
                wide = np.sqrt(deviation**2 + OUTLYING_ERROR**2)
                over, far = (miss / deviation) ** 2 / 2, (miss / wide) ** 2 / 2
                crosses = np.log(CROSSING / np.sqrt(2 * np.pi) / deviation) - over
                turns = inside - (over if miss > 0 else 0.0)
                outlies = off - np.log(wide) - far
                most = max(crosses, turns, outlies)
                crosses, turns = np.exp(crosses - most), np.exp(turns - most)
                outlies = np.exp(outlies - most)
                whole = crosses + turns + outlies
                total += most + np.log(whole)
                weight = (crosses / deviation**2 + outlies / wide**2) / whole
                for i in range(size):
                    slope[i] -= weight * column[i] * sign * miss
                    for j in range(size):
                        normal[i, j] += weight * column[i] * column[j]
            factorised(normal, none, 0.0, root)  # positive definite: it began as the identity
            if turn == NEWTON_STEPS:
                for i in range(size):  # the mass about a top, and not its height, is likely
                    total -= np.log(root[i, i])
                if total > top:
                    top = total
                    copied(e, best)
                break
            substituted(root, slope, step)
            for i in range(size):
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
    ndarray, shape (k, 5)
        Sign (1 bright, -1 dark), level, its standard deviation, pace [rad per pixel], and place
        [pixels].
    """
    smooth = gaussian_filter1d(line, SMOOTHING, mode="nearest")
    steps = np.diff(smooth)
    turns = np.flatnonzero(steps[:-1] * steps[1:] <= 0) + 1
    bright = smooth[turns] > 0.5
    peaks = (steps[turns] <= 0) & (steps[turns - 1] >= 0)
    turns = turns[(bright == peaks) & ~clipped[turns]]
    found = _fitted(line, gaussian_filter1d(pace, 8.0), turns)
    deviation = np.sqrt(variance * found[:, 4] + EXTREME_ERROR**2)
    return np.column_stack([found[:, 1], found[:, 2], deviation, found[:, 3], found[:, 0]])


def light_of_extremes(
    found: Array,
    gains: Array,
    visibility: tuple[float, float],
    blur: tuple[float, float],
    power: float,
    response: Array,
) -> tuple[Array, float, float, float]:
    """Light that explains extremes best, and what is known of it before.

    Parameters
    ----------
    found : ndarray, shape (k, 5)
        As of `extremes`.
    gains : ndarray, shape (k, s)
        What a standard deviation of each mode of the light changes in the gain where they are.
    visibility, blur : tuple of float
        Mean and standard deviation; blur in pixels.
    power : float
        Standard deviation of the power of the camera's response, over the power.
    response : ndarray, shape (k, 2)
        Amplitude and offset where they are, as shares of the full scale.

    Returns
    -------
    modes : ndarray, shape (s,)
        In their deviations.
    visibility, blur, power : float
        The power is over that of the drawing.
    """
    modes = gains.shape[1]
    means, stds = np.array([visibility[0], blur[0]]), np.array([visibility[1], blur[1], power])
    e = np.zeros(modes + 3)
    if len(found) and (stds.any() or gains.any()):
        common = gains.mean(axis=0)
        size = float(np.linalg.norm(common))
        steps = int(LIKELY_GAIN * size / GAIN_STEP)
        off = np.arange(-steps, steps + 1) * GAIN_STEP / size if size else np.zeros(1)
        powers = np.array(POWER_STARTS if power else (0.0,))
        begins = np.zeros((len(powers), len(off), len(e)))
        begins[..., :modes] = np.outer(off, common / max(size, np.finfo(float).tiny))
        begins[..., modes + 1] = BLUR_START if blur[1] else 0.0
        begins[..., modes + 2] = powers[:, None]
        begins = begins.reshape(-1, len(e))
        lines = np.column_stack([found[:, :4], response])
        e = _lit(lines, np.ascontiguousarray(gains), means, stds, begins)
    seen, spread = means + stds[:2] * e[modes : modes + 2]
    return e[:modes], float(seen), max(float(spread), 0.0), float(1 + power * e[modes + 2])
