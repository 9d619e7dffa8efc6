"""One frame against expected levels: residuals, gradient, and what the residuals look like."""

from __future__ import annotations

from math import erfc, exp, log, pi, sqrt

import numpy as np
from numba import njit

from fringeforce.force.strip import GROUP
from fringeforce.force.vector_loops import (
    CHUNK,
    REORDERED,
    add_products,
    combine,
    count_beyond,
    expose,
    square_sum,
)

SQUARES, GROUPED, OUTLIERS, GAIN, PROMISED, BENT, WEAK = range(7)
"""What `gauss_newton.follow` reports, in this order; see there."""
REPORTED = 7
OUTLIER = 5.0
"""Residual beyond which a pixel is suspect."""
_ZERO, _ONE = np.float32(0), np.float32(1)


@njit(cache=True, error_model="numpy", nogil=True)
def evaluate(strip, loads, phase, slope, level) -> None:
    """Fill in phase, bias included, slope and level of all pixels at given loads."""
    matrix, amplitude, offset, steepness = strip[0], strip[2], strip[3], strip[5]
    size, bias = strip[9], strip[11]
    short = np.zeros(matrix.shape[1], dtype=np.float32)
    short[:size] = loads
    for i in range(len(matrix)):
        combine(matrix[i], short, bias[i], phase[i])
    expose(*_flat(phase, amplitude), *_flat(offset, steepness), *_flat(level, slope))


@njit(cache=True, error_model="numpy", nogil=True)
def compare(strip, frame, slope, level, left, root, gradient) -> float:
    """Fill in residuals, roots of the pixels' weights and the gradient of half the loss.

    Residuals are in units of the noise.  Returns what clipped pixels add to their sum of squares
    to make it the loss.
    """
    matrix = strip[0]
    beyond = _residuals(strip, level, frame, left, root)
    pull = np.empty_like(left)
    _multiply(left.reshape(-1), slope.reshape(-1), pull.reshape(-1))
    gradient[:] = 0
    for i in range(len(matrix)):
        add_products(matrix[i], pull[i], gradient)
    return beyond


@njit(cache=True, error_model="numpy")
def _flat(first, second):
    return first.reshape(-1), second.reshape(-1)


@njit(cache=True, error_model="numpy")
def _multiply(first, second, product) -> None:
    for k in range(len(product)):
        product[k] = first[k] * second[k]


@njit(cache=True, error_model="numpy")
def _residuals(strip, level, frame, left, root) -> float:
    """Fill in residuals and roots of weights; returns what clipped pixels add to the loss."""
    _subtract(*_flat(level, frame), *_flat(strip[4], left))
    root[:] = _ONE
    beyond = 0.0
    if strip[7] > -np.inf or strip[8] < np.inf:
        for i in range(len(left)):
            beyond += _hide(strip, i, frame[i], level[i], left[i], root[i])
    return beyond


@njit(cache=True, error_model="numpy")
def _subtract(level, frame, inverse, left) -> None:
    for k in range(len(left)):
        left[k] = (level[k] - np.float32(frame[k])) * inverse[k]


@njit(cache=True, error_model="numpy")
def _hide(strip, i, frame, level, left, root) -> float:
    """Correct one chunk for pixels at the converter's limits; see `likelihood.misfit`."""
    inverse, floor, ceiling, added = strip[4][i], strip[7], strip[8], 0.0
    for k in range(CHUNK):
        if inverse[k] > 0 and (frame[k] <= floor or frame[k] >= ceiling):
            sign, limit = (1.0, ceiling - 0.5) if frame[k] >= ceiling else (-1.0, floor + 0.5)
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
def describe(left, share, report) -> None:
    """Fill in what residuals look like."""
    values, shares = left.reshape(-1), share.reshape(-1)
    grouped = 0.0
    for j in range(len(shares)):
        together = _ZERO
        for k in range(GROUP):
            together += values[j * GROUP + k]
        grouped += together * together * shares[j]
    report[SQUARES], report[GROUPED] = square_sum(values), grouped
    report[OUTLIERS] = count_beyond(values, np.float32(OUTLIER**2))


@njit(cache=True, error_model="numpy", nogil=True)
def silence(strip, frame, left, root) -> float:
    """Loss of no load at all; fills in its residuals."""
    beyond = _residuals(strip, strip[12], frame, left, root)
    return beyond + float(square_sum(left.reshape(-1)))
