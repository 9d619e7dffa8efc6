"""From grey levels to the loads that explain them: search, climb, look around, judge.

Arrays only: a frame, an influence matrix and the camera's response.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.bad_pixels import FEW, outlying
from fringeforce.estimation.likelihood import Response
from fringeforce.estimation.phase.folding import Fringes, phase_pace
from fringeforce.estimation.phase.tracking import explanations
from fringeforce.estimation.residual_test import PLAIN
from fringeforce.estimation.strip import Strip
from fringeforce.estimation.strip_fit import Optimum
from fringeforce.reading.frame_problem import Doubt, FrameProblem
from fringeforce.reading.hypothesis_selection import Hypothesis, selected
from fringeforce.reading.reading import Status

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CANDIDATES = 6
"""Distinct interpretations of one search that are climbed to the top."""
SAME_BASIN = 0.5
"""Phases nowhere farther apart are one interpretation of the search [rad]."""
SATURATION = 0.1
"""Share of pixels at full scale that tells of saturation."""
DENSE = 1.3
"""Pace of the phase beyond which pixels no longer follow [rad per pixel]."""


def cold_start(
    levels: Array,
    used: Mask,
    influence: Array,
    response: Response,
    strip: Strip,
    full_scale: int,
    channels: int = 1,
    calibration_uncertainty: Doubt | None = None,
    start: Array | None = None,
) -> Hypothesis:
    """Explain a frame without any earlier state but one more place to start from.

    Parameters
    ----------
    levels : ndarray, shape (P,)
        Grey levels, channel after channel.
    used : ndarray of bool, shape (P,)
        Pixels to use.
    influence : ndarray, shape (P, 2n)
        Influence matrix, ordered like `forces.ravel()` [rad/N].
    response : Response
        Of the camera.
    strip : Strip
        Of the influence matrix, in any light.
    full_scale : int
        Largest grey level of the converter.
    channels : int
        Channels that see the same strip along the same pixels.
    calibration_uncertainty : callable, optional
        What grey levels are uncertain by besides noise, for given loads and pixels.
    start : ndarray, shape (2n,), optional
        Loads that may be nearly right [N].
    """
    problem = FrameProblem.of(
        levels, used, influence, response, strip, channels, calibration_uncertainty
    )
    lines = list(_fringes(levels, used, influence, response, channels))
    optima = [] if start is None else [problem.optimum(start)]
    spared: tuple[FrameProblem, list[Optimum]] | None = None
    for starts in explanations(lines):
        optima = sorted([*optima, *_climbed(problem, starts)], key=lambda optimum: optimum.loss)
        loads = optima[0].loads
        if problem.explained(loads, PLAIN):
            break
        sound = _sound_pixels(problem.estimate(loads).misfit.slope)
        if sound is not None and not problem.explained(loads):
            rest = problem.only(sound)
            optimum = rest.optimum(loads)
            if rest.explained(optimum.loads, PLAIN):
                return selected(rest, [optimum])
            if spared is None and rest.explained(optimum.loads):
                spared = rest, [optimum]
    fitting = [optimum for optimum in optima if problem.explained(optimum.loads)]
    if fitting:
        return selected(problem, fitting)
    if spared is not None:
        return selected(*spared)
    status = Status.MODEL_MISMATCH
    if np.mean(problem.frame >= full_scale) > SATURATION:
        status = Status.SATURATED
    elif max(phase_pace(line.intensity, line.variance).max() for line in lines) > DENSE:
        status = Status.FRINGES_TOO_DENSE
    best = problem.climbed(problem.pushing(optima[0].loads))
    spread = problem.covariance(best)
    return Hypothesis(best.loads, spread, spread, best.misfit.slope, status, [])


def _fringes(
    levels: Array, used: Mask, influence: Array, response: Response, channels: int
) -> Iterator[Fringes]:
    """Normalised fringes of every channel between its outermost used pixels, gaps bridged."""
    pixels = np.arange(len(levels) // channels)
    seen = used.reshape(channels, -1)
    first, last = np.flatnonzero(seen.any(axis=0))[[0, -1]]
    for channel, start in enumerate(range(0, len(levels), len(pixels))):
        span = slice(start + first, start + last + 1)
        own = seen[channel, first : last + 1]
        line, lit = levels[span], response.at(span)
        if not own.all():
            here = pixels[: len(line)]
            line = np.interp(here, here[own], line[own])
        yield Fringes(
            intensity=(line - lit.offset) / lit.amplitude,
            variance=float(np.median(response.variance / lit.amplitude**2)),
            influence=influence[span],
            bias=float(np.mean(lit.bias)),
            seen=own,
        )


def _climbed(problem: FrameProblem, starts: Array) -> list[Optimum]:
    """Tops of the likelihood that distinct starts lead to."""
    found, known = list[Optimum](), problem.phases()
    for start in starts:
        if known.know(problem.phase(start), SAME_BASIN):
            continue
        optimum = problem.optimum(start)
        if not known.know(optimum.phase, SAME_BASIN):
            found.append(optimum)
            known.add(optimum.phase)
        if len(found) == CANDIDATES:
            break
    return found


def _sound_pixels(left: Array) -> Mask | None:
    """All pixels but a few that alone spoil a fit, if there are such."""
    sound = ~outlying(left[None])
    return sound if 0 < np.count_nonzero(~sound) <= FEW * len(sound) else None
