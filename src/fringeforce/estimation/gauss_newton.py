"""From one frame to the next: Gauss and Newton's step in tens of microseconds.

Loads that were right for the last frame are nearly right for this one, and a step or two climbs to
the top of the likelihood.  What the last frame's evaluation left behind is where the first step
starts, so that a frame costs one evaluation; and the matrix is kept until the phase has moved by
some hundredths of what would bend it, see `freshness`.  Now and then the phase is computed at every
pixel; its change since then, at the nodes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fringeforce.estimation.compiling import entry, inner, part
from fringeforce.estimation.evaluation import (
    Workspace,
    compare,
    describe,
    evaluate,
    light_levels,
    load_frame,
    shift,
    silence,
    workspace_for,
)
from fringeforce.estimation.information import factorise_information
from fringeforce.estimation.strip import Strip
from fringeforce.estimation.vector_loops import REORDERED, Single, combine, copy, invert, multiply

Array = NDArray[np.float64]

STEPS = 6
"""Largest number of steps for one frame."""
CLOSE = 0.25
"""Gain of twice the log-likelihood that the next step promises, below which it is the last."""
FAR = 0.1
"""Mean squared change of the phase beyond which it is computed at every pixel again [rad^2]."""
TURNS = 3
"""Rounds of inverse iteration from any direction to that of least information, nearly."""
RIDGE = 1e-8
"""Share of the trace that keeps the step finite where a load leaves no trace."""
_ZERO, _HALF = np.float32(0), np.float32(0.5)
_TINY = np.float32(1e-20)


class Place(NamedTuple):
    """Where the follower stands; the compiled functions write into its arrays.

    Attributes
    ----------
    loads : ndarray, shape (m,)
        Loads at which the rest was evaluated [N].
    phase, slope, level : ndarray, shape (size,)
        Phase [rad], grey level per phase in units of the noise, and expected grey level.
    base, ground : ndarray, shapes (m,) and (size,)
        Loads at which the phase was computed at every pixel [N], and that phase [rad].
    anchor, steep : ndarray, shape (places,)
        Phase and slope where the matrix was computed, in one row.
    factor : ndarray, shape (rows, rows)
        Cholesky factor of the matrix, lower triangle [1/N].
    least_informed : ndarray, shape (m + 1,)
        Direction of the loads that the frame says least of, one deviation long [N]; its bend.
    covariance : ndarray, shape (m, m)
        Inverse of the matrix [N^2].
    work : Workspace
        For the frame that is looked at.
    """

    loads: Array
    phase: Single
    slope: Single
    level: Single
    base: Array
    ground: Single
    anchor: Single
    steep: Single
    factor: Array
    least_informed: Array
    covariance: Array
    work: Workspace

    @classmethod
    def at(cls, strip: Strip, loads: Array) -> Place:
        """At given loads, shape (m,) [N]."""
        rows, base = len(strip.nodes), loads.copy()
        phase, slope, level, ground = np.zeros((4, strip.layout.size), dtype=np.float32)
        anchor, steep = np.zeros((2, strip.layout.places), dtype=np.float32)
        place = cls(
            *(loads.copy(), phase, slope, level, base, ground, anchor, steep),
            factor=np.zeros((rows, rows)),
            least_informed=np.ones(strip.loads + 1),
            covariance=np.zeros((strip.loads, strip.loads)),
            work=workspace_for(strip.arrays),
        )
        settle(strip.arrays, place)
        return place


@entry
def settle(strip, place) -> None:
    """Evaluate a place at its loads."""
    relinearise(strip, place)
    _anchor(strip, place, np.ones_like(place.phase))
    for _ in range(TURNS):
        keep(strip, place)


@part
def follow(strip, place, frame, estimate, report) -> None:
    """Move a place to the top of the likelihood of a frame.

    Parameters
    ----------
    strip, place : Pixels, Place
        Where to start; the place is moved.
    frame : ndarray, shape (P,)
        Grey levels, finite.
    estimate : ndarray, shape (m,)
        Filled with the loads [N]: those of the place, and one step more that is too small to
        evaluate again.
    report : record of REPORT
        Filled; the way is that from where the matrix was computed.
    """
    work, loads, phase, slope = place.work, place.loads, place.phase, place.slope
    level, covariance, gradient = place.level, place.covariance, place.work.gradient
    step, places = np.empty(len(loads)), len(place.anchor)
    load_frame(strip, frame, work)
    beyond, way, turn, anchor, steep = 0.0, 0.0, 0, place.anchor, place.steep
    compare(strip, slope, level, work)
    for turn in range(STEPS):
        if turn > 0:
            step_matrix(strip, slope, work.root, place.factor)
            invert(place.factor, covariance)
            anchor, steep = row_of(strip, phase, places).copy(), row_of(strip, slope, places).copy()
        multiply(covariance, gradient, step)
        loads -= step
        way = shift(strip, place.ground, loads - place.base, phase, work)
        light_levels(strip, phase, slope, level)
        beyond = compare(strip, slope, level, work)
        multiply(covariance, gradient, step)
        report.promised = abs(np.dot(step, gradient[: len(loads)]))
        if not report.promised > CLOSE:
            break
    copy(loads - step, estimate)
    describe(strip, work, report)
    if way > FAR:
        relinearise(strip, place)
    report.bent = relative_curvature(strip, place.anchor, phase, place.steep, level)
    if relative_curvature(strip, anchor, phase, steep, level) > strip.fresh:
        _anchor(strip, place, work.root)
    elif turn > 0:
        _keep_row(strip, place, anchor, steep)
    report.weak = place.least_informed[-1]
    report.gain = silence(strip, work) - report.squares - beyond


@inner
def relinearise(strip, place) -> None:
    """Compute the phase of a place at every pixel."""
    evaluate(strip, place.loads, place.phase, place.slope, place.level)
    copy(place.loads, place.base)
    copy(place.phase, place.ground)


@inner
def _anchor(strip, place, root) -> None:
    """Compute the matrix where the place is."""
    step_matrix(strip, place.slope, root, place.factor)
    invert(place.factor, place.covariance)
    keep(strip, place)


@inner
def keep(strip, place) -> None:
    """Keep that the matrix was computed where the place is."""
    places = len(place.anchor)
    _keep_row(strip, place, row_of(strip, place.phase, places), row_of(strip, place.slope, places))


@inner
def _keep_row(strip, place, anchor, steep) -> None:
    """Keep where the matrix was computed, and how bent one deviation is from there."""
    copy(anchor, place.anchor)
    copy(steep, place.steep)
    least_informed = place.least_informed
    _weaken(place.covariance, least_informed)
    least_informed[-1] = _least_informed_curvature(
        strip, least_informed[:-1], place.slope, place.level, place.work
    )


@inner
def step_matrix(strip, slope, root, factor) -> None:
    """Fill in the Cholesky factor of the information, each pixel with its weight."""
    factorise_information(strip, (slope * root) ** 2, RIDGE, factor)


@part
def row_of(strip, values, places):
    """The one row of which the pixels say how bent a way is, shape (places,)."""
    return values[strip.row : strip.row + places]


@inner
def relative_curvature(strip, anchor, phase, steep, level) -> float:
    """Second-order change of the levels on the way from an anchor, relative to the first.

    A mirror image lies where both cancel: at a bend of one.
    """
    moved = row_of(strip, phase, len(anchor)) - anchor
    first, second = _changes(strip, moved, steep, level)
    return np.sqrt(second / max(first, _TINY))


@njit(cache=True, error_model="numpy", fastmath=REORDERED)
def _changes(strip, moved, steep, level):
    """Squared changes of the levels on a way, of first and second order, over one row."""
    places, first, second = len(moved), _ZERO, _ZERO
    amplitude, offset = row_of(strip, strip.amplitude, places), row_of(strip, strip.offset, places)
    inverse, grey = row_of(strip, strip.inverse, places), row_of(strip, level, places)
    for k in range(len(moved)):
        # A/4 cos p, from the level at the end of the way
        curve = (amplitude[k] * _HALF + offset[k] - grey[k]) * inverse[k] * _HALF
        straight = steep[k] * moved[k]
        bent = curve * moved[k] * moved[k]
        first += straight * straight
        second += bent * bent
    return first, second


@inner
def _weaken(covariance: Array, direction: Array) -> None:
    """Turn a direction towards the one of least information, and make it one deviation long.

    One round of inverse iteration from the last frame's direction.
    """
    size = len(covariance)
    before = direction[:size].copy()
    multiply(covariance, before, direction[:size])
    length = np.sqrt(np.dot(before, direction[:size]))
    for j in range(size):
        direction[j] /= length


@inner
def _least_informed_curvature(strip, direction, slope, level, work) -> float:
    """Bend of a way of one deviation."""
    way = work.weight
    copy(direction, work.short)
    combine(strip.nodes, work.short, work.nothing, way)
    first, second = _changes(strip, way, row_of(strip, slope, len(way)), level)
    return np.sqrt(second / np.float32(len(strip.shares))) / max(first, _TINY)
