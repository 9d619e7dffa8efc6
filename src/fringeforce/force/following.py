"""Follow a sequence of frames for as long as there is no doubt about any of them."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

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
from fringeforce.force.gauss_newton import CLOSE, follow
from fringeforce.force.strip import Strip
from fringeforce.force.vector_loops import CHUNK, add_gram, factorise, invert

Array = NDArray[np.float64]

FOLLOWED, SILENT, DOUBTFUL = range(3)
"""What becomes of a frame: explained, explained by no load at all, or left to a search."""
JUMP = 0.25
"""Bend of the way from one frame to the next, beyond which it may have led to a mirror image."""
MARGIN = 6.0
"""Deviations that must stay short of half the way to the nearest mirror image."""
NOISE, ORDER, QUIET = 6.0, 4.0, 2.5
"""Deviations of pure noise that are allowed: for the residuals' sum of squares; for that of sums
over neighbours, beyond which a search looks for errors of the model; and for either at silence."""
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


@njit(cache=True, error_model="numpy", nogil=True)
def follow_all(
    strip, place, limits, silent, frames, wanted, loads, covariances, reports, verdicts
) -> int:
    """Follow frames until one is doubtful; returns how many were done before it.

    Parameters
    ----------
    strip, place, limits : tuple
        `Strip.arrays`, `Place.arrays`, which is moved, and `Limits.numbers`.
    silent : bool
        Whether nothing touched the sensor in the frame before.
    frames : ndarray, shape (k, chunks, CHUNK)
        Grey levels, finite.
    wanted : int
        Which covariances: STEP, WHOLE or NONE.
    loads, covariances, reports, verdicts : ndarray, shapes (k, m), (k, m, m), (k, REPORTED), (k,)
        Filled; of the covariances only what is wanted.
    """
    size = len(place[0])
    left, root = np.empty_like(place[1]), np.empty_like(place[1])
    for i in range(len(frames)):
        if silent:
            silence(strip, frames[i], left, root)
            describe(left, strip[6], reports[i])
            if not _noise(reports[i], limits[0] + size, limits[1] + size, QUIET, QUIET):
                verdicts[i] = DOUBTFUL
                return i
            loads[i], verdicts[i] = 0, SILENT
            continue
        follow(strip, place, frames[i], loads[i], reports[i])
        verdicts[i] = verdict(reports[i], limits)
        if verdicts[i] == DOUBTFUL:
            return i
        if verdicts[i] == SILENT:
            silent = True
            loads[i] = 0
        elif wanted == STEP:
            covariances[i] = place[8]
        elif wanted == WHOLE:
            covariance(strip, place[2], covariances[i])
    return len(frames)


@njit(cache=True, error_model="numpy")
def verdict(report, limits) -> int:
    """What becomes of a frame, from what `follow` reported."""
    pixels, groups, size = limits
    if not report[PROMISED] <= CLOSE or not _noise(report, pixels, groups, NOISE, ORDER):
        return DOUBTFUL
    if report[GAIN] <= size + CONTACT * sqrt(2 * size):
        return SILENT
    if not report[BENT] <= JUMP or not 2 * MARGIN * report[WEAK] <= 1:
        return DOUBTFUL
    return FOLLOWED


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
    matrix, size = strip[0], len(result)
    rows = matrix.shape[1]
    scaled, total = np.empty((rows, CHUNK), dtype=np.float32), np.zeros((rows, rows))
    for i in range(len(matrix)):
        add_gram(matrix[i], slope[i], scaled, total)
    trace = 0.0
    for j in range(size):
        trace += total[j, j]
    factorise(total, size, 1e-12 * trace)
    invert(total, result)


def covariance_at(strip: Strip, loads: Array) -> Array:
    """Covariance of loads from the slopes of all pixels, shape (m, m) [N^2]."""
    phase, slope, level = np.empty((3, len(strip.matrix), CHUNK), dtype=np.float32)
    evaluate(strip.arrays, loads, phase, slope, level)
    result = np.empty((strip.loads, strip.loads))
    covariance(strip.arrays, slope, result)
    return result
