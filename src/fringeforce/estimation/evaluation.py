"""One frame against expected levels: residuals, gradient, and what the residuals look like."""

from __future__ import annotations

from math import erfc, exp, log, pi, sqrt
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fringeforce.estimation.bad_pixels import OUTLIER
from fringeforce.estimation.compiling import entry, inner
from fringeforce.estimation.vector_loops import (
    REORDERED,
    Single,
    add_products,
    combine,
    copy,
    expose,
    gather,
    interpolate,
    square_sum,
    subtract_levels,
)

REPORT = np.dtype(
    [(name, "f8") for name in ("squares", "sums", "outliers", "gain", "promised", "bent", "weak")]
)
"""What is reported of a frame: the sum of its squared residuals, and of their squared sums over
neighbours; the number of outliers; the gain of twice the log-likelihood that the loads have over
none at all, and that one more step promises; the bend of the way to the frame (see
`gauss_newton.bend`), and that of one deviation in the direction of which the frame says least."""
_ZERO, _SUSPECT = np.float32(0), np.float32(OUTLIER**2)


class Workspace(NamedTuple):
    """Workspace for one frame, which the functions below would lose time to find for themselves.

    Attributes
    ----------
    grey, left : ndarray, shape (size,)
        Grey levels, and residuals in units of the noise.
    root : ndarray, shape (size,)
        Roots of the pixels' weights, one but for clipped pixels.
    hidden : ndarray, shape (1 + size,)
        Number of clipped pixels, and their places.
    new : ndarray, shape (1,)
        Whether the frame is not the one before again.
    gradient : ndarray, shape (rows,)
        Of half the loss [1/N].
    sums : ndarray, shape (places,)
        Of residuals over groups, in units of their noise; as many as there are groups.
    pull, weight, short, nothing : ndarray
        Intermediate results, and zeros.
    """

    grey: Single
    left: Single
    root: Single
    hidden: NDArray[np.int64]
    new: NDArray[np.bool_]
    gradient: NDArray[np.float64]
    sums: Single
    pull: Single
    weight: Single
    short: Single
    nothing: Single


@entry
def workspace_for(strip):
    """Find room for the frames of a strip."""
    size, (rows, places) = len(strip.inverse), strip.nodes.shape
    grey, left, pull = (
        np.zeros(size, np.float32),
        np.zeros(size, np.float32),
        np.zeros(size, np.float32),
    )
    root, hidden = np.ones(size, np.float32), np.zeros(1 + size, np.int64)
    gradient, short = np.zeros(rows), np.zeros(rows, np.float32)
    sums, weight = np.zeros(places, np.float32), np.zeros(places, np.float32)
    nothing, new = np.zeros(places, np.float32), np.ones(1, np.bool_)
    return Workspace(grey, left, root, hidden, new, gradient, sums, pull, weight, short, nothing)


@entry
def load_frame(strip, frame, work) -> None:
    """Lay a frame out, shape (P,), and find its clipped pixels."""
    order, grey, floor, ceiling = strip.order, work.grey, strip.floor, strip.ceiling
    same = 0
    while same < len(order) and grey[order[same]] == frame[same]:
        same += 1
    work.new[0] = same < len(order)
    for i in range(len(order)):
        grey[order[i]] = frame[i]
    if work.hidden[0] > 0:
        work.hidden[0], work.root[:] = 0, 1
    clipped = 0
    for i in range(len(order)):
        clipped += (frame[i] <= floor) | (frame[i] >= ceiling)
    if clipped:
        _find_clipped(strip, frame, work.hidden)


@inner
def _find_clipped(strip, frame, hidden) -> None:
    for i in range(len(frame)):
        clipped = frame[i] <= strip.floor or frame[i] >= strip.ceiling
        if clipped and strip.inverse[strip.order[i]] > 0:
            hidden[0] += 1
            hidden[hidden[0]] = strip.order[i]


@entry
def evaluate(strip, loads, phase, slope, level) -> None:
    """Fill in phase, bias included, slope and level of all pixels at given loads."""
    matrix, bias = strip.matrix, strip.bias
    short = np.zeros(matrix.shape[1], dtype=np.float32)
    copy(loads, short)
    for i in range(len(matrix)):
        row = slice(i * matrix.shape[2], (i + 1) * matrix.shape[2])
        combine(matrix[i], short, bias[row], phase[row])
    light_levels(strip, phase, slope, level)


@entry
def shift(strip, base, change, phase, work) -> float:
    """Fill in the phase of all pixels after a change of the loads from where it was `base`.

    Four times as fast as `evaluate`, and exact to some ten thousandths of the phase's change, of
    which the mean square is returned [rad^2].
    """
    copy(change, work.short)
    combine(strip.nodes, work.short, work.nothing, work.weight)
    interpolate(work.weight, strip.shares, base, phase)
    return float(square_sum(work.weight)) / len(work.weight)


@inner
def light_levels(strip, phase, slope, level) -> None:
    """Fill in slope and level of all pixels from their phase."""
    expose(phase, strip.amplitude, strip.offset, strip.steepness, level, slope)


@entry
def compare(strip, slope, level, work) -> float:
    """Fill in residuals, roots of the pixels' weights and the gradient of half the loss.

    Returns what clipped pixels add to the sum of squared residuals to make it the loss.
    """
    subtract_levels(level, work.grey, strip.inverse, slope, work.left, work.pull)
    beyond = _hide(strip, level, work) if work.hidden[0] > 0 else 0.0
    for k in work.hidden[1 : 1 + work.hidden[0]]:
        work.pull[k] = work.left[k] * slope[k]
    gather(work.pull, strip.shares, work.weight)
    work.gradient[:] = 0
    add_products(strip.nodes, work.weight, work.gradient)
    return beyond


@entry
def silence(strip, work) -> float:
    """Loss of no load at all; fills in its residuals."""
    _subtract(strip.dark, work.grey, strip.inverse, work.left)
    beyond = _hide(strip, strip.dark, work) if work.hidden[0] > 0 else 0.0
    return beyond + float(square_sum(work.left))


@inner
def _subtract(level, grey, inverse, left) -> None:
    for k in range(len(left)):
        left[k] = (level[k] - grey[k]) * inverse[k]


@inner
def _hide(strip, level, work) -> float:
    """Correct pixels at the converter's limits; see `likelihood.misfit`."""
    inverse, floor, ceiling, added = strip.inverse, strip.floor, strip.ceiling, 0.0
    grey, left, root, hidden = work.grey, work.left, work.root, work.hidden
    for i in range(1, 1 + hidden[0]):
        k = hidden[i]
        sign, limit = (1.0, ceiling - 0.5) if grey[k] >= ceiling else (-1.0, floor + 0.5)
        beyond = sign * (level[k] - limit) * inverse[k]
        chance = _log_normal_tail(beyond)
        hazard = exp(-0.5 * beyond**2 - chance) / sqrt(2 * pi)
        added += -2 * chance - hazard**2
        left[k] = -sign * hazard
        root[k] = sqrt(max(hazard * (hazard + beyond), 0.0))
    return added


@entry
def _log_normal_tail(x: float) -> float:
    """Logarithm of the chance that a standard normal number stays below x."""
    if x > -30:
        return log(0.5 * erfc(-x / sqrt(2)))
    return -0.5 * x**2 - log(-x * sqrt(2 * pi)) - 1 / x**2  # where the chance underflows


@njit(cache=True, error_model="numpy", fastmath=REORDERED, nogil=True)
def describe(strip, work, report) -> None:
    """Fill in what residuals look like."""
    left, share, every, sums = work.left, strip.share, len(strip.shares), work.sums
    places, squares, outliers = len(sums), _ZERO, np.int32(0)
    sums[:] = 0
    for row in range(every):
        line = left[row * places : (row + 1) * places]
        for k in range(places):
            square = line[k] * line[k]
            sums[k] += line[k]
            squares += square
            outliers += np.int32(square > _SUSPECT)
    # neighbours pair by pair until groups are left, whose size is a power of two
    while places > len(share):
        places //= 2
        for j in range(places):
            sums[j] = sums[2 * j] + sums[2 * j + 1]
    grouped = _ZERO
    for j in range(len(share)):
        sums[j] *= share[j]
        grouped += sums[j] * sums[j]
    report.squares, report.sums, report.outliers = squares, grouped, outliers
