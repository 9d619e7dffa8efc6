"""From one frame to the next: Gauss and Newton's step in tens of microseconds.

Loads that were right for the last frame are nearly right for this one, and a step or two climbs to
the top of the likelihood.  What the last frame's evaluation left behind is where the first step
starts, so that a frame costs one evaluation; and the matrix is kept until the phase has moved by
some hundredths of what would bend it.  Where the matrix was computed the phase is known from all
pixels; from there on its change is, from the nodes.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fringeforce.force.evaluation import (
    BENT,
    GAIN,
    PROMISED,
    SQUARES,
    WEAK,
    compare,
    describe,
    evaluate,
    shift,
    shine,
    silence,
    take,
)
from fringeforce.force.information import factorise_information
from fringeforce.force.strip import Strip
from fringeforce.force.vector_loops import REORDERED, Single, combine, invert, multiply, solve

Array = NDArray[np.float64]

STEPS = 6
"""Largest number of steps for one frame."""
CLOSE = 0.25
"""Gain of twice the log-likelihood that the next step promises, below which it is the last."""
FRESH = 0.015
"""Bend up to which a matrix is used again; deviations from it are then right within 5 %."""
RIDGE = 1e-7
"""Share of the trace that keeps the step finite where a load leaves no trace."""
_ZERO, _HALF = np.float32(0), np.float32(0.5)
_TINY = np.float32(1e-20)


@dataclass(frozen=True, eq=False)
class Place:
    """Where the follower stands; the compiled functions write into its arrays.

    Attributes
    ----------
    loads : ndarray, shape (m,)
        Loads at which the rest was evaluated [N].
    phase, slope, level : ndarray, shape (size,)
        Phase [rad], grey level per phase in units of the noise, and expected grey level.
    base : ndarray, shape (m,)
        Loads at which the matrix was computed [N].
    anchor, steep : ndarray, shape (size,)
        Phase and slope there.
    factor : ndarray, shape (rows, rows)
        Cholesky factor of the matrix, lower triangle [1/N].
    weakest : ndarray, shape (m + 1,)
        Direction of the loads that the frame says least of, one deviation long [N]; its bend.
    covariance : ndarray, shape (m, m)
        Inverse of the matrix [N^2].
    """

    loads: Array
    phase: Single
    slope: Single
    level: Single
    base: Array
    anchor: Single
    steep: Single
    factor: Array
    weakest: Array
    covariance: Array

    @classmethod
    def at(cls, strip: Strip, loads: Array) -> Place:
        """At given loads, shape (m,) [N]."""
        rows, base = len(strip.nodes), loads.copy()
        phase, slope, level, anchor, steep = np.zeros((5, len(strip.inverse)), dtype=np.float32)
        factor, weakest = np.zeros((rows, rows)), np.ones(strip.loads + 1)
        found = np.zeros((strip.loads, strip.loads))
        place = cls(loads.copy(), phase, slope, level, base, anchor, steep, factor, weakest, found)
        settle(strip.arrays, place.arrays)
        return place

    @property
    def arrays(self) -> tuple[Any, ...]:
        """What the compiled functions take."""
        return tuple(getattr(self, field.name) for field in fields(self))


@njit(cache=True, error_model="numpy", nogil=True)
def settle(strip, place) -> None:
    """Evaluate a place at its loads."""
    for _ in range(3):
        _anchor(strip, place, np.ones_like(place[1]))


@njit(cache=True, error_model="numpy", nogil=True)
def follow(strip, place, frame, estimate, report) -> None:
    """Move a place to the top of the likelihood of a frame.

    Parameters
    ----------
    strip, place : tuple
        `Strip.arrays` and `Place.arrays`; the place is moved.
    frame : ndarray, shape (P,)
        Grey levels, finite.
    estimate : ndarray, shape (m,)
        Filled with the loads [N]: those of the place, and one step more that is too small to
        evaluate again.
    report : ndarray, shape (REPORTED,)
        Filled with: SQUARES, of the residuals; GROUPED, of their sums over neighbours; the number
        of OUTLIERS; GAIN of twice the log-likelihood that the loads have over none at all;
        PROMISED, the gain of one more step; BENT, the bend of the way from where the matrix was
        computed (see `bend`); WEAK, that of one deviation in the direction of which the frame
        says least.
    """
    loads, phase, slope, level, base, anchor, steep, factor, weakest, covariance = place
    left, root = np.empty_like(slope), np.empty_like(slope)
    gradient, step = np.empty(len(strip[1])), np.empty(len(loads))
    grey = np.zeros_like(slope)
    hidden = take(strip, frame, grey, np.empty(len(frame), np.int64))
    beyond, renewed = 0.0, False
    compare(strip, grey, hidden, slope, level, left, root, gradient)
    for turn in range(STEPS):
        if turn > 0:
            step_matrix(strip, slope, root, factor)
            invert(factor, covariance)
            renewed = True
        multiply(covariance, gradient, step)
        loads -= step
        shift(strip, anchor, loads - base, phase)
        shine(strip, phase, slope, level)
        beyond = compare(strip, grey, hidden, slope, level, left, root, gradient)
        multiply(covariance, gradient, step)
        report[PROMISED] = abs(np.dot(step, gradient[: len(loads)]))
        if not report[PROMISED] > CLOSE:
            break
    estimate[:] = loads - step
    describe(left, strip[6], len(strip[13]), report)
    report[BENT] = bend(strip, anchor, phase, steep, level)
    if renewed or report[BENT] > FRESH:
        _anchor(strip, place, root)
    report[WEAK] = weakest[-1]
    report[GAIN] = silence(strip, grey, hidden, left, root) - report[SQUARES] - beyond


@njit(cache=True, error_model="numpy", nogil=True)
def _anchor(strip, place, root) -> None:
    """Compute the matrix where the place is."""
    loads, phase, slope, level, base, anchor, steep, factor, weakest, covariance = place
    evaluate(strip, loads, phase, slope, level)
    step_matrix(strip, slope, root, factor)
    base[:], anchor[:], steep[:] = loads, phase, slope
    weaken(factor, len(loads), weakest)
    invert(factor, covariance)
    weakest[-1] = weak_bend(strip, weakest[:-1], slope, level)


@njit(cache=True, error_model="numpy", nogil=True)
def step_matrix(strip, slope, root, factor) -> None:
    """Fill in the Cholesky factor of the information, each pixel with its weight."""
    factorise_information(strip, (slope * root) ** 2, RIDGE, factor)


@njit(cache=True, error_model="numpy", fastmath=REORDERED)
def bend(strip, before, after, steep, level) -> float:
    """Second-order change of the levels on a way, relative to the first.

    A mirror image lies where both cancel: at a bend of one.
    """
    amplitude, offset, inverse = strip[2], strip[3], strip[4]
    first, second = _ZERO, _ZERO
    for k in range(len(before)):
        moved = after[k] - before[k]
        # A/4 cos p, from the level at the end of the way
        curve = (amplitude[k] * _HALF + offset[k] - level[k]) * inverse[k] * _HALF
        straight = steep[k] * moved
        bent = curve * moved * moved
        first += straight * straight
        second += bent * bent
    return np.sqrt(second / max(first, _TINY))


@njit(cache=True, error_model="numpy")
def weaken(factor: Array, size: int, direction: Array) -> None:
    """Turn a direction towards the one of least information, and make it one deviation long.

    One round of inverse iteration from the last frame's direction.
    """
    solve(factor, size, direction, direction)
    direction = direction[:size]
    length = 0.0
    for j in range(size):
        along = 0.0
        for i in range(j, size):
            along += factor[i, j] * direction[i]
        length += along * along
    direction /= np.sqrt(length)


@njit(cache=True, error_model="numpy", fastmath=REORDERED)
def weak_bend(strip, direction, slope, level) -> float:
    """Bend of a way of one deviation, from the pixels at the nodes."""
    nodes = strip[1]
    amplitude, offset, inverse = strip[2], strip[3], strip[4]
    short, nothing = np.zeros(nodes.shape[0], np.float32), np.zeros(nodes.shape[1], np.float32)
    short[: len(direction)] = direction
    way = np.empty_like(nothing)
    combine(nodes, short, nothing, way)
    first, second = _ZERO, _ZERO
    for k in range(len(way)):
        curve = (amplitude[k] * _HALF + offset[k] - level[k]) * inverse[k] * _HALF
        straight = slope[k] * way[k]
        bent = curve * way[k] * way[k]
        first += straight * straight
        second += bent * bent
    return np.sqrt(second / np.float32(len(strip[13]))) / max(first, _TINY)
