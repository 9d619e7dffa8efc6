"""One frame against expected levels: residuals, gradient, and what the residuals look like."""

from __future__ import annotations

from math import erfc, exp, log, pi, sqrt

import numpy as np
from numba import njit

from fringeforce.force.vector_loops import (
    REORDERED,
    add_products,
    combine,
    expose,
    gather,
    interpolate,
    square_sum,
)

SQUARES, GROUPED, OUTLIERS, GAIN, PROMISED, BENT, WEAK = range(7)
"""What `gauss_newton.follow` reports, in this order; see there."""
REPORTED = 7
OUTLIER = 5.0
"""Residual beyond which a pixel is suspect."""
_ZERO, _SUSPECT = np.float32(0), np.float32(OUTLIER**2)


@njit(cache=True, error_model="numpy", nogil=True)
def room(strip):
    """Room for one frame, which the functions below would lose time to find for themselves.

    Grey levels and residuals, in units of the noise, shape (size,); roots of the pixels' weights,
    one but for clipped pixels; number of clipped pixels and their places; gradient of half the
    loss, shape (rows,); sums of residuals over groups, in units of their noise; and what lies idle
    in between.
    """
    nodes, size = strip[1], len(strip[4])
    grey, root = np.zeros(size, np.float32), np.ones(size, np.float32)
    left, pull = np.zeros(size, np.float32), np.zeros(size, np.float32)
    hidden, gradient = np.zeros(1 + size, np.int64), np.zeros(len(nodes))
    weight, short = np.zeros(nodes.shape[1], np.float32), np.zeros(len(nodes), np.float32)
    nothing, sums = np.zeros(nodes.shape[1], np.float32), np.zeros(nodes.shape[1], np.float32)
    return grey, left, root, hidden, gradient, sums, (pull, weight, short, nothing)


@njit(cache=True, error_model="numpy", nogil=True)
def take(strip, frame, room) -> None:
    """Lay a frame out, shape (P,), and find its clipped pixels."""
    floor, ceiling, order = strip[7], strip[8], strip[14]
    grey, _, root, hidden, _, _, _ = room
    for i in range(len(order)):
        grey[order[i]] = frame[i]
    if floor > -np.inf or ceiling < np.inf:
        inverse = strip[4]
        hidden[0], root[:] = 0, 1
        for i in range(len(order)):
            if inverse[order[i]] > 0 and (frame[i] <= floor or frame[i] >= ceiling):
                hidden[0] += 1
                hidden[hidden[0]] = order[i]


@njit(cache=True, error_model="numpy", nogil=True)
def evaluate(strip, loads, phase, slope, level) -> None:
    """Fill in phase, bias included, slope and level of all pixels at given loads."""
    matrix, bias = strip[0], strip[11]
    short = np.zeros(matrix.shape[1], dtype=np.float32)
    short[: len(loads)] = loads
    for i in range(len(matrix)):
        row = slice(i * matrix.shape[2], (i + 1) * matrix.shape[2])
        combine(matrix[i], short, bias[row], phase[row])
    shine(strip, phase, slope, level)


@njit(cache=True, error_model="numpy", nogil=True)
def shift(strip, base, change, phase, room) -> float:
    """Fill in the phase of all pixels after a change of the loads from where it was `base`.

    Four times as fast as `evaluate`, and exact to some ten thousandths of the phase's change, of
    which the mean square is returned [rad^2].
    """
    _, moved, short, nothing = room[6]
    short[: len(change)] = change
    combine(strip[1], short, nothing, moved)
    interpolate(moved, strip[13], base, phase)
    return float(square_sum(moved)) / len(moved)


@njit(cache=True, error_model="numpy", nogil=True)
def shine(strip, phase, slope, level) -> None:
    """Fill in slope and level of all pixels from their phase."""
    expose(phase, strip[2], strip[3], strip[5], level, slope)


@njit(cache=True, error_model="numpy", nogil=True)
def compare(strip, slope, level, room) -> float:
    """Fill in residuals, roots of the pixels' weights and the gradient of half the loss.

    Returns what clipped pixels add to the sum of squared residuals to make it the loss.
    """
    _, left, _, _, gradient, _, (pull, weight, _, _) = room
    beyond = _residuals(strip, level, room)
    _multiply(left, slope, pull)
    gather(pull, strip[13], weight)
    gradient[:] = 0
    add_products(strip[1], weight, gradient)
    return beyond


@njit(cache=True, error_model="numpy", nogil=True)
def silence(strip, room) -> float:
    """Loss of no load at all; fills in its residuals."""
    beyond = _residuals(strip, strip[12], room)
    return beyond + float(square_sum(room[1]))


@njit(cache=True, error_model="numpy")
def _multiply(first, second, product) -> None:
    for k in range(len(product)):
        product[k] = first[k] * second[k]


@njit(cache=True, error_model="numpy")
def _residuals(strip, level, room) -> float:
    """Fill in residuals and roots of weights; returns what clipped pixels add to the loss."""
    grey, left, _, hidden, _, _, _ = room
    _subtract(level, grey, strip[4], left)
    return _hide(strip, level, room) if hidden[0] > 0 else 0.0


@njit(cache=True, error_model="numpy")
def _subtract(level, grey, inverse, left) -> None:
    for k in range(len(left)):
        left[k] = (level[k] - grey[k]) * inverse[k]


@njit(cache=True, error_model="numpy")
def _hide(strip, level, room) -> float:
    """Correct pixels at the converter's limits; see `likelihood.misfit`."""
    inverse, floor, ceiling, added = strip[4], strip[7], strip[8], 0.0
    grey, left, root, hidden, _, _, _ = room
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


@njit(cache=True, error_model="numpy")
def _log_normal_tail(x: float) -> float:
    """Logarithm of the chance that a standard normal number stays below x."""
    if x > -30:
        return log(0.5 * erfc(-x / sqrt(2)))
    return -0.5 * x**2 - log(-x * sqrt(2 * pi)) - 1 / x**2  # where the chance underflows


@njit(cache=True, error_model="numpy", fastmath=REORDERED, nogil=True)
def describe(strip, room, report) -> None:
    """Fill in what residuals look like."""
    left, share, every, sums = room[1], strip[6], len(strip[13]), room[5]
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
    report[SQUARES], report[GROUPED], report[OUTLIERS] = squares, grouped, outliers
