"""Follow loads that one frame hardly shows: a single step a frame, from a running mean.

Where the phase stays near a multiple of pi, the levels hardly change with the loads, mirror images
lie within a few deviations, and a climb to the top of one frame's likelihood ends at any of them.
The mean of the last frames lies close to the truth; one step of Gauss and Newton's method from
there is as good as the top itself (Le Cam's one-step estimate) and stays on the mean's side.  The
mean takes in as many frames as it can without lagging behind.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from fringeforce.estimation.compiling import entry, inner, part
from fringeforce.estimation.evaluation import (
    compare,
    describe,
    light_levels,
    load_frame,
    shift,
    silence,
)
from fringeforce.estimation.gauss_newton import (
    FAR,
    RIDGE,
    TURNS,
    keep,
    relative_curvature,
    relinearise,
    row_of,
)
from fringeforce.estimation.information import factorise_information
from fringeforce.estimation.residual_monitor import REMEMBERED
from fringeforce.estimation.vector_loops import (
    ROWS,
    combine,
    copy,
    invert,
    invert_factor,
    multiply,
    multiply_halves,
)

_ZERO, _ONE, _EIGHTH, _TINY = np.float32(0), np.float32(1), np.float32(1 / 8), np.float32(1e-30)
MEAN = np.dtype(
    [("steady", "?")]
    + [(name, "f8") for name in ("frames", "share", "surprise", "recalled", "spread")],
    align=True,
)
"""A mean: whether frames are followed by it; number of frames in the mean of the loads; share of a
new frame in it; running mean of what a frame surprises by, relative to noise; number of frames in
the mean of the residuals, and the variance of noise in that, relative to one frame."""
LONGEST = 64
"""Largest number of frames in the mean of the loads."""
LAGGING = 1.3
"""Surprise beyond which the mean lags behind and takes in fewer frames."""
RECENT, FASTER, SLOWER = 0.1, 1.2, 1.05
"""Least share of a frame in the mean surprise; factors by which its share in the mean of the loads
grows where that lags, and shrinks where it does not."""
ROUNDS = 12
"""Rounds at most until the variance of the phase and the information agree."""
AGREED = np.float32(0.02)
"""Relative change of the variance in one of them, below which they do."""


@entry
def update_running_mean(strip, place, variance, state) -> None:
    """Begin a mean at the loads of a place.

    Parameters
    ----------
    strip, place : Pixels, Place
        Where to begin.
    variance : ndarray, shape (places,)
        Filled with the variance of the phase at the nodes [rad^2].
    state : record of MEAN
        Filled.
    """
    state.steady, state.share, state.surprise = True, 1, 1
    state.frames, state.recalled, state.spread = 0, 0, 0
    steepness, root = strip.steepness, np.ones_like(place.phase)
    # where the levels are flat, their curvature still bounds the phase; elsewhere the last matrix
    half = np.zeros_like(place.covariance)
    invert_factor(place.factor, half)
    _spread(strip.nodes, half, variance)
    for k in range(len(variance)):
        flat = _ONE / steepness[k] if steepness[k] > 0 else _ZERO
        variance[k] = min(variance[k], flat)
    relinearise(strip, place)
    for _ in range(ROUNDS):
        if _anchor(strip, place, root, variance) < AGREED:
            break
    for _ in range(TURNS):
        keep(strip, place)


@entry
def steady_covariance(strip, slope, root, variance, result) -> None:
    """Fill in the covariance of a frame that was read from a mean, shape (m, m) [N^2].

    Parameters
    ----------
    strip : Pixels
        The pixels.
    slope, root, variance
        Of the mean: see `Place`, `Workspace` and `update_running_mean`.
    result : ndarray, shape (m, m)
        Filled.
    """
    rows = len(strip.nodes)
    factor = np.empty((rows, rows))
    _smooth_matrix(strip, slope, root, variance, factor)
    invert(factor, result)


@part
def step_steadily(strip, place, variance, state, rest, frame, estimate, report) -> None:
    """Read one frame from the mean, and take it in.

    Parameters
    ----------
    strip, place, variance, memory
        As of `update_running_mean`; the place is moved to the new mean.
    rest : ndarray, shape (size,)
        Mean of the residuals, in units of the noise.
    frame : ndarray, shape (P,)
        Grey levels, finite.
    estimate : ndarray, shape (m,)
        Filled with the loads [N].
    report : record of REPORT
        Filled; the promised gain is that of the step, and so is the way.
    """
    work, loads, phase, slope = place.work, place.loads, place.phase, place.slope
    level, places, step = place.level, len(place.anchor), np.empty(len(place.loads))
    load_frame(strip, frame, work)
    beyond = compare(strip, slope, level, work)
    if (
        state.frames > 0
        and relative_curvature(strip, place.anchor, phase, place.steep, level) > strip.fresh
    ):
        _anchor(strip, place, work.root, variance)
        keep(strip, place)
    multiply(place.covariance, work.gradient, step)
    report.promised = np.dot(step, work.gradient[: len(loads)])
    copy(loads - step, estimate)
    ahead = np.zeros_like(phase)
    shift(strip, place.ground, estimate - place.base, ahead, work)
    here, there = row_of(strip, phase, places), row_of(strip, slope, places)
    report.bent = relative_curvature(strip, here, ahead, there, level)
    for k in range(len(phase)):
        work.left[k] += slope[k] * (ahead[k] - phase[k])
    describe(strip, work, report)
    report.weak = place.least_informed[-1]
    if work.new[0]:
        _recall(work.left, rest, state)
        _take_in(state, report.promised / len(loads))
        loads -= state.share * step
    if shift(strip, place.ground, loads - place.base, phase, work) > FAR:
        relinearise(strip, place)
    light_levels(strip, phase, slope, level)
    report.gain = silence(strip, work) - report.squares - beyond


@inner
def _take_in(state, surprise) -> None:
    """Change the share of a new frame by how much the mean lags."""
    share = state.share
    # noise of the frame, and that of the mean
    expected = 2 / (2 - share)
    state.frames += 1
    state.surprise += max(share, RECENT) * (surprise / expected - state.surprise)
    if state.surprise > LAGGING:
        state.share = min(1.0, share * FASTER)
    else:
        state.share = max(share / SLOWER, 1.0 / LONGEST, 1.0 / (state.frames + 1))


@inner
def _recall(left, rest, state) -> None:
    """Take residuals into their mean."""
    state.recalled += 1
    share = max(1 / REMEMBERED, 1 / state.recalled)
    state.spread = (1 - share) ** 2 * state.spread + share**2
    part = np.float32(share)
    for k in range(len(rest)):
        rest[k] += part * (left[k] - rest[k])


@inner
def uncertainty(state) -> float:
    """Deviation of the mean, relative to that of one frame."""
    return sqrt(state.share / (2 - state.share))


@inner
def _anchor(strip, place, root, variance) -> np.float32:
    """Compute the matrix where the place is, the phase's own variance in mind.

    Returns the largest relative change of that variance, which moves half way, geometrically, to
    what the matrix allows.
    """
    _smooth_matrix(strip, place.slope, root, variance, place.factor)
    half, allowed, change = np.zeros_like(place.covariance), np.empty_like(variance), _ZERO
    invert_factor(place.factor, half)
    multiply_halves(half, place.covariance)
    _spread(strip.nodes, half, allowed)
    for k in range(len(variance)):
        after = np.sqrt(variance[k] * allowed[k])
        change = max(change, abs(after - variance[k]) / max(after, _TINY))
        variance[k] = after
    return change


@inner
def _smooth_matrix(strip, slope, root, variance, factor) -> None:
    """Fill in the Cholesky factor of the information; see `bounds.fisher_information`."""
    kept = np.exp(np.float32(-2) * variance)
    square, places = np.empty_like(slope), len(kept)
    for first in range(0, len(square), places):
        row = slice(first, first + places)
        target, here, weight = square[row], slope[row], root[row]
        most = strip.steepness[row]
        for k in range(places):
            steep, steepest = here[k] * weight[k], most[k] * weight[k]
            lost = (_ONE - kept[k]) * _EIGHTH
            target[k] = kept[k] * steep * steep + lost * steepest * steepest
    factorise_information(strip, square, RIDGE, factor)


@inner
def _spread(nodes, half, variance) -> None:
    """Fill in the variance of the phase at the nodes, given the inverse of the factor."""
    row, nothing = np.zeros(nodes.shape[0], np.float32), np.zeros_like(variance)
    turned = np.empty_like(variance)
    variance[:] = 0
    for j in range(len(half)):
        # a row of the factor's inverse ends at its diagonal
        some = (j // ROWS + 1) * ROWS
        copy(half[j], row)
        combine(nodes[:some], row, nothing, turned)
        for k in range(len(variance)):
            variance[k] += turned[k] * turned[k]
