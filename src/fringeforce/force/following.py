"""Follow a sequence of frames for as long as there is no doubt about any of them."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fringeforce.force.evaluation import (
    BENT,
    GAIN,
    GROUPED,
    OUTLIERS,
    PROMISED,
    SQUARES,
    WEAK,
    describe,
    evaluate,
    silence,
)
from fringeforce.force.gauss_newton import CLOSE, follow, settle
from fringeforce.force.information import factorise_information
from fringeforce.force.steady import FRAMES, REMEMBERED, STEADY, steady, step_steadily, uncertainty
from fringeforce.force.strip import Strip
from fringeforce.force.vector_loops import CHUNK, invert

Array = NDArray[np.float64]

FOLLOWED, SILENT, DOUBTFUL, HELD, UNSETTLED = range(5)
"""What becomes of a frame: explained; explained by no load at all; left to a search; explained, by
what the last search settled on; and explained by one of several loads that it left open."""
OPEN, FRESHLY, AGAIN, LENGTH, LEFT, RAISED, LOOKED = range(7)
"""What is known since the last search: whether it left open which of several loads; whether
nothing has been surer since, and whether the doubt lasts; for how many frames it need not be done
again, and how many of them are left; frames in a row that were louder than silence; and frames for
which errors of the model need no new look."""
KNOWN = 7
SPELL, HUSH = 128.0, 32.0
"""Frames until a search is due again at first: about loads, and about silence."""
WORD = 32.0
"""Frames for which the word of a search, or of the last frame that was sure, holds."""
HOLDS, STAYS = 512.0, 4096.0
"""And at most, if doubt lasts and the spell doubles: where a search was sure, and where not."""
JUMP = 0.25
"""Bend of the way from one frame to the next, beyond which it may have led to a mirror image."""
MARGIN = 6.0
"""Deviations that must stay short of half the way to the nearest mirror image."""
NOISE, ORDER, QUIET = 6.0, 4.0, 2.5
"""Deviations of pure noise that are allowed: for the residuals' sum of squares; for that of sums
over neighbours, beyond which a search looks for errors of the model; and for either at silence."""
LEAP = 9.0
"""Squared deviations for each load that one frame may lie from the mean of those before."""
CALM, ROUGH = 0.15, 0.3
"""Shares of that margin below which a frame's own top is climbed, and above which a step is taken
from the mean instead."""
LOST, NEAR = 1.5, 0.5
"""Shares of it, by the mean's own deviation, beyond which the branch is no longer known, and below
which it is worth a search to know it again."""
PAUSE, FEW = 0.25, 8
"""Share of a spell without a search at least; frames after which the mean is surer than one."""
CONTACT = 6.0
"""Deviations of pure noise by which loads must beat silence."""
STEP, WHOLE, NONE = range(3)
"""Covariances that are wanted: that of the step's matrix, that of all pixels, or none."""


@dataclass(frozen=True)
class Limits:
    """Degrees of freedom, from which the limits of noise follow."""

    pixels: float
    groups: float
    loads: int

    @classmethod
    def of(cls, strip: Strip) -> Limits:
        """Of a strip."""
        return cls(
            float(max(strip.pixels - strip.loads, 1)),
            float(max(strip.groups - strip.loads, 1)),
            strip.loads,
        )

    @property
    def numbers(self) -> tuple[float, float, int]:
        """What the compiled functions take."""
        return self.pixels, self.groups, self.loads


@dataclass(frozen=True, eq=False)
class Memory:
    """What a follower knows besides its place; the compiled functions write into its arrays.

    Attributes
    ----------
    variance : ndarray, shape (fewer chunks, CHUNK)
        Of the phase at the nodes of the information [rad^2].
    mean : ndarray, shape (REMEMBERED,)
        See `steady`.
    known : ndarray, shape (KNOWN,)
        See `OPEN`.
    """

    variance: NDArray[np.float32]
    mean: Array
    known: Array

    @classmethod
    def of(cls, strip: Strip) -> Memory:
        """Of nothing yet."""
        variance = np.zeros((len(strip.nodes), CHUNK), dtype=np.float32)
        return cls(variance, np.zeros(REMEMBERED), np.zeros(KNOWN))

    def begin(self, unsettled: bool, silent: bool) -> None:
        """Begin after a search."""
        again, length = self.known[AGAIN], 2 * self.known[LENGTH]
        spell = min(length, STAYS if unsettled else HOLDS) if again else SPELL
        spell = HUSH if silent else spell
        self.mean[:] = 0
        self.known[:] = unsettled, not silent, not silent, spell, spell, 0, SPELL

    @property
    def arrays(self) -> tuple[Any, ...]:
        """What the compiled functions take."""
        return self.variance, self.mean, self.known


@njit(cache=True, error_model="numpy", nogil=True)
def follow_all(
    strip, place, memory, limits, silent, frames, wanted, loads, covariances, reports, verdicts
) -> int:
    """Follow frames until one is doubtful; returns how many were done before it.

    Parameters
    ----------
    strip, place, memory, limits : tuple
        `Strip.arrays`, `Place.arrays` and `Memory.arrays`, which are moved, and `Limits.numbers`.
    silent : bool
        Whether nothing touched the sensor in the frame before.
    frames : ndarray, shape (k, chunks, CHUNK)
        Grey levels, finite.
    wanted : int
        Which covariances: STEP, WHOLE or NONE.
    loads, covariances, reports, verdicts : ndarray, shapes (k, m), (k, m, m), (k, REPORTED), (k,)
        Filled; of the covariances only what is wanted.
    """
    mean = memory[1]
    for i in range(len(frames)):
        if silent:
            verdicts[i] = _hush(strip, memory[2], limits, frames[i], reports[i])
        else:
            verdicts[i] = _touch(strip, place, memory, limits, frames[i], loads[i], reports[i])
        if verdicts[i] == DOUBTFUL:
            return i
        if verdicts[i] == SILENT:
            silent, loads[i], mean[STEADY] = True, 0, 0
        elif (mean[STEADY] and wanted != NONE) or wanted == STEP:
            covariances[i] = place[8]
        elif wanted == WHOLE:
            covariance(strip, place[2], covariances[i])
    return len(frames)


@njit(cache=True, error_model="numpy")
def _hush(strip, known, limits, frame, report) -> int:
    """Whether a frame is silent, as the one before was."""
    pixels, groups, size = limits
    left, root = np.empty(frame.shape, np.float32), np.empty(frame.shape, np.float32)
    silence(strip, frame, left, root)
    describe(left, strip[6], report)
    known[LEFT] -= 1
    if _noise(report, pixels + size, groups + size, QUIET, QUIET):
        known[RAISED] = 0
        return SILENT
    known[RAISED] += 1
    loud = not _noise(report, pixels + size, groups + size, NOISE, ORDER)
    return DOUBTFUL if loud or (known[RAISED] > 1 and known[LEFT] < 0) else SILENT


@njit(cache=True, error_model="numpy")
def _touch(strip, place, memory, limits, frame, loads, report) -> int:
    """Follow one frame: to the top of its likelihood, or a step from the mean."""
    variance, mean, known = memory
    known[LOOKED] -= 1
    order = NOISE if known[LOOKED] > 0 else ORDER
    if not mean[STEADY]:
        before = place[0].copy()
        follow(strip, place, frame, loads, report)
        found = verdict(report, limits, order)
        if found != DOUBTFUL:
            _trust(known)
            return found
        place[0][:] = before
        steady(strip, place, variance, mean)
    step_steadily(strip, place, variance, mean, frame, loads, report)
    found = steady_verdict(report, limits, mean, known, order)
    if found == FOLLOWED and 2 * MARGIN * report[WEAK] < CALM:
        mean[STEADY], place[0][:] = 0, loads
        settle(strip, place)
    return found


@njit(cache=True, error_model="numpy")
def verdict(report, limits, order) -> int:
    """What becomes of a frame, from what `follow` reported."""
    pixels, groups, size = limits
    if not report[PROMISED] <= CLOSE or not _noise(report, pixels, groups, NOISE, order):
        return DOUBTFUL
    if report[GAIN] <= size + CONTACT * sqrt(2 * size):
        return SILENT
    if not report[BENT] <= JUMP or not 2 * MARGIN * report[WEAK] <= ROUGH:
        return DOUBTFUL
    return FOLLOWED


@njit(cache=True, error_model="numpy")
def steady_verdict(report, limits, mean, known, order) -> int:
    """What becomes of a frame, from what `step_steadily` reported."""
    pixels, groups, size = limits
    if not _noise(report, pixels, groups, NOISE, order):
        return DOUBTFUL
    # a step that is long, or so bent that it does not end at the top
    if not report[PROMISED] <= LEAP * size or not report[BENT] ** 2 * report[PROMISED] <= size:
        return DOUBTFUL
    if report[GAIN] <= size + CONTACT * sqrt(2 * size):
        return SILENT
    near = 2 * MARGIN * report[WEAK] * uncertainty(mean)
    if not known[OPEN] and known[LEFT] == known[LENGTH] and near <= LOST:
        if known[FRESHLY] and mean[FRAMES] < FEW:
            return HELD
        _trust(known)
        return FOLLOWED
    known[LEFT] -= 1
    # back from where the way may have led to a mirror image, or too long there
    if known[LEFT] < 0 or (near <= NEAR and known[LEFT] < (1 - PAUSE) * known[LENGTH]):
        return DOUBTFUL
    # its word holds for a while, and then nothing does until the next
    return UNSETTLED if known[OPEN] or known[LENGTH] - known[LEFT] > WORD else HELD


@njit(cache=True, error_model="numpy")
def _trust(known) -> None:
    """Take a frame as surer than the last search."""
    known[FRESHLY], known[AGAIN], known[LENGTH], known[LEFT] = 0, 0, SPELL, SPELL


@njit(cache=True, error_model="numpy")
def _noise(report, pixels, groups, wide, narrow) -> bool:
    """Whether residuals are as small and as unordered as noise; see `goodness.is_noise`."""
    return (
        report[SQUARES] < pixels + wide * sqrt(2 * pixels)
        and report[GROUPED] < groups + narrow * sqrt(2 * groups)
        and report[OUTLIERS] == 0
    )


@njit(cache=True, error_model="numpy", nogil=True)
def covariance(strip, slope, result) -> None:
    """Fill in the covariance of the loads from the slopes of all pixels, shape (m, m) [N^2].

    The inverse of Fisher's information; a place that passed `verdict` lies far enough from where
    the curvature counts.
    """
    rows = strip[1].shape[1]
    factor = np.empty((rows, rows))
    factorise_information(strip, slope * slope, 1e-12, factor)
    invert(factor, result)


def covariance_at(strip: Strip, loads: Array) -> Array:
    """Covariance of loads from the slopes of all pixels, shape (m, m) [N^2]."""
    phase, slope, level = np.empty((3, len(strip.matrix), CHUNK), dtype=np.float32)
    evaluate(strip.arrays, loads, phase, slope, level)
    result = np.empty((strip.loads, strip.loads))
    covariance(strip.arrays, slope, result)
    return result
