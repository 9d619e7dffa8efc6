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
from fringeforce.estimation.strip_fit import Top
from fringeforce.reading.frame_problem import Doubt, Scene
from fringeforce.reading.hypothesis_selection import Interpretation, judged
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


def interpret(
    levels: Array,
    used: Mask,
    influence: Array,
    response: Response,
    strip: Strip,
    full_scale: int,
    model_error: float = 0.0,
    channels: int = 1,
    doubt: Doubt | None = None,
) -> Interpretation:
    """Explain a frame without any earlier state.

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
    model_error : float
        Relative size of the influence matrix's errors of shape, where it is known.
    channels : int
        Channels that see the same strip along the same pixels.
    doubt : callable, optional
        What grey levels are uncertain by besides noise, for given loads and pixels.
    """
    scene = Scene.of(levels, used, influence, response, strip, channels, model_error, doubt)
    lines = list(_fringes(levels, used, influence, response, channels))
    tops: list[Top] = []
    spared: tuple[Scene, list[Top]] | None = None
    for starts in explanations(lines):
        tops = sorted([*tops, *_climbed(scene, starts)], key=lambda top: top.loss)
        loads = tops[0].loads
        if scene.explained(loads, PLAIN):
            break
        sound = _sound_pixels(scene.estimate(loads).misfit.slope)
        if sound is not None and not scene.explained(loads):
            rest = scene.only(sound)
            top = rest.top(loads)
            if rest.explained(top.loads, PLAIN):
                return judged(rest, [top])
            if spared is None and rest.explained(top.loads):
                spared = rest, [top]
    fitting = [top for top in tops if scene.explained(top.loads)]
    if fitting:
        return judged(scene, fitting)
    if spared is not None:
        return judged(*spared)
    status = Status.MODEL_MISMATCH
    if np.mean(scene.frame >= full_scale) > SATURATION:
        status = Status.SATURATED
    elif max(phase_pace(line.intensity, line.variance).max() for line in lines) > DENSE:
        status = Status.FRINGES_TOO_DENSE
    best = scene.climbed(scene.pushing(tops[0].loads))
    spread = scene.covariance(best)
    return Interpretation(best.loads, spread, spread, best.misfit.slope, status, [])


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


def _climbed(scene: Scene, starts: Array) -> list[Top]:
    """Tops of the likelihood that distinct starts lead to."""
    found, known = list[Top](), scene.phases()
    for start in starts:
        if known.know(scene.phase(start), SAME_BASIN):
            continue
        top = scene.top(start)
        if not known.know(top.phase, SAME_BASIN):
            found.append(top)
            known.add(top.phase)
        if len(found) == CANDIDATES:
            break
    return found


def _sound_pixels(left: Array) -> Mask | None:
    """All pixels but a few that alone spoil a fit, if there are such."""
    sound = ~outlying(left[None])
    return sound if 0 < np.count_nonzero(~sound) <= FEW * len(sound) else None
