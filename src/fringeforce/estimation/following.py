"""Follow a sequence of frames for as long as there is no doubt about any of them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import entry, part
from fringeforce.estimation.evaluation import Workspace, describe, evaluate, load_frame, silence
from fringeforce.estimation.gauss_newton import Place, follow, settle
from fringeforce.estimation.information import factorise_information
from fringeforce.estimation.residual_monitor import TREND, persists
from fringeforce.estimation.running_mean import (
    MEAN,
    steady_covariance,
    step_steadily,
    update_running_mean,
)
from fringeforce.estimation.strip import Pixels, Strip
from fringeforce.estimation.track_status import (
    DOUBTFUL,
    FOLLOWED,
    KNOWN,
    SILENT,
    SILENT_FRAMES,
    Limits,
    looks_like_noise,
    rests,
    steady_verdict,
    trust,
    verdict,
)
from fringeforce.estimation.vector_loops import copy, invert

Array = NDArray[np.float64]

STEP, WHOLE, NONE = range(3)
"""Covariances that are wanted: that of the step's matrix, that of all pixels, or none."""


class TrackerState(NamedTuple):
    """What a follower knows besides its place; the compiled functions write into its arrays.

    Attributes
    ----------
    variance : ndarray, shape (places,)
        Of the phase at the nodes of the information [rad^2].
    mean : ndarray of MEAN, shape (1,)
        See `update_running_mean`.
    rest : ndarray, shape (size,)
        Mean of the residuals of frames that were followed steadily, in units of the noise.
    known : ndarray of KNOWN, shape (1,)
        What is known since the last search.
    trend, lasting : ndarray, shape (groups,), and ndarray of TREND, shape (1,)
        See `persists`.
    """

    variance: NDArray[np.float32]
    mean: NDArray[np.void]
    rest: NDArray[np.float32]
    known: NDArray[np.void]
    trend: NDArray[np.float32]
    lasting: NDArray[np.void]

    @classmethod
    def of(cls, strip: Strip) -> TrackerState:
        """Of nothing yet."""
        layout, groups = strip.layout, len(strip.share)
        variance, rest, trend = (
            np.zeros(size, np.float32) for size in (layout.places, layout.size, groups)
        )
        mean, known, lasting = (np.zeros(1, kind) for kind in (MEAN, KNOWN, TREND))
        return cls(variance, mean, rest, known, trend, lasting)


def state_of(strip: Strip, place: Place, state: TrackerState, limits: Limits) -> tuple[Any, ...]:
    """What `follow_all` takes: plain tuples, for names cost several microseconds at the door."""
    *standing, work = place
    return tuple(map(tuple, (strip.arrays, standing, work, state, limits)))


@entry
def follow_all(state, silent, frames, wanted, loads, covariances, reports, verdicts) -> int:
    """Follow frames until one is doubtful; returns how many were done before it.

    Parameters
    ----------
    state : tuple
        See `state_of`; the place and the memory are moved.
    silent : bool
        Whether nothing touched the sensor in the frame before.
    frames : ndarray, shape (k, P)
        Grey levels, finite.
    wanted : int
        Which covariances: STEP, WHOLE or NONE.
    loads, covariances, reports, verdicts : ndarray, shapes (k, m), (k, m, m), (k,), (k,)
        Filled, with records of REPORT; of the covariances only what is wanted.
    """
    place = Place(*state[1], Workspace(*state[2]))  # pyright: ignore[reportCallIssue]
    strip = Pixels(*state[0])
    state, limits = TrackerState(*state[3]), Limits(*state[4])
    mean, known, lasting = state.mean[0], state.known[0], state.lasting[0]
    for i in range(len(frames)):
        if silent:
            verdicts[i] = _hush(strip, place.work, known, limits, frames[i], reports[i])
        else:
            verdicts[i] = _touch(strip, place, state, limits, frames[i], loads[i], reports[i])
            work, selected = place.work, verdicts[i] != SILENT and place.work.new[0]
            if selected and persists(
                work.sums, limits.groups, limits.watched, state.trend, lasting
            ):
                verdicts[i] = DOUBTFUL
        if verdicts[i] == DOUBTFUL:
            return i
        if verdicts[i] == SILENT:
            loads[i] = 0
            known.hushed += 1
            if not silent and known.hushed >= SILENT_FRAMES:
                silent, mean.steady, place.loads[:] = True, False, 0
            continue
        known.hushed = 0
        if wanted == WHOLE and mean.steady:
            root, variance = place.work.root, state.variance
            steady_covariance(strip, place.slope, root, variance, covariances[i])
        elif wanted == STEP:
            for j in range(len(place.covariance)):
                copy(place.covariance[j], covariances[i, j])
        elif wanted == WHOLE:
            covariance(strip, place.slope, covariances[i])
    return len(frames)


@part
def _hush(strip, work, known, limits, frame, report) -> int:
    """Whether a frame is silent, as the one before was."""
    load_frame(strip, frame, work)
    silence(strip, work)
    describe(strip, work, report)
    known.left -= 1
    if looks_like_noise(report, limits.quiet, limits.quiet_sums):
        known.raised = 0
        return SILENT
    known.raised += 1
    loud = not looks_like_noise(report, limits.loud, limits.loud_sums)
    return DOUBTFUL if loud or (known.raised > 1 and known.left < 0) else SILENT


@part
def _touch(strip, place, state, limits, frame, loads, report) -> int:
    """Follow one frame: to the top of its likelihood, or a step from the mean."""
    variance, mean, known = state.variance, state.mean[0], state.known[0]
    known.looked -= 1
    allowed = limits.sums if known.looked > 0 else limits.watched
    if not mean.steady:
        before = place.loads.copy()
        follow(strip, place, frame, loads, report)
        found = verdict(report, limits, allowed)
        if found == FOLLOWED:
            trust(known)
        if found != DOUBTFUL:
            return found
        copy(before, place.loads)
        update_running_mean(strip, place, variance, mean)
    step_steadily(strip, place, variance, mean, state.rest, frame, loads, report)
    found = steady_verdict(report, limits, mean, known, allowed)
    if found == FOLLOWED and rests(report):
        mean.steady = False
        copy(loads, place.loads)
        settle(strip, place)
    return found


@entry
def covariance(strip, slope, result) -> None:
    """Fill in the covariance of the loads from the slopes of all pixels, shape (m, m) [N^2].

    The inverse of Fisher's information; a place that passed `verdict` lies far enough from where
    the curvature counts.
    """
    rows = len(strip.nodes)
    factor = np.empty((rows, rows))
    factorise_information(strip, slope * slope, 1e-12, factor)
    invert(factor, result)


def covariance_at(strip: Strip, loads: Array) -> Array:
    """Covariance of loads from the slopes of all pixels, shape (m, m) [N^2]."""
    phase, slope, level = np.empty((3, len(strip.inverse)), dtype=np.float32)
    evaluate(strip.arrays, loads, phase, slope, level)
    result = np.empty((strip.loads, strip.loads))
    covariance(strip.arrays, slope, result)
    return result
