"""From grey levels to the loads that explain them: search, climb, look around, judge.

Arrays only: a frame, an influence matrix and the camera's response.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.force.estimate import Estimate
from fringeforce.force.goodness import is_noise
from fringeforce.force.likelihood import Response, misfit
from fringeforce.phase.folding import phase_pace
from fringeforce.phase.tracking import explanations
from fringeforce.reading import Status
from fringeforce.scene import Doubt, Scene

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CANDIDATES = 6
"""Distinct interpretations of one search that are climbed to the top."""
SAME_BASIN, SAME_START, SAME_TOP = 0.5, 0.1, 0.05
"""Phases nowhere farther apart are one: of the search, of mirror images, of climbs [rad]."""
TRIED = 40
"""Mirror images that are tried in all."""
SATISFIED = 2.5
"""Standard deviations of pure noise within which an explanation ends the search."""
RIVAL = 16.0
"""Twice the log-likelihood by which an explanation must beat another to rule it out."""
SPREAD = 3.0
"""Rivals that widen no deviation by more than this are one explanation, less sure."""
ANCHOR = 1.5
"""Phase that a frame must reach for its signs to hang together where not all was tried [rad]."""
PUSH = 5.0
"""Standard deviations that the sum of the pushes must have to tell a load from its negative."""
CONTACT = 6.0
"""Standard deviations of pure noise by which an explanation must beat silence."""
DOUBTFUL, IMPOSSIBLE = 0.05, 1e-5
"""Chances of a misfit below which it widens the deviations, and below which the model is wrong."""
OUTLIER, OUTLIERS = 5.0, 0.03
"""Residual that makes a pixel suspect, and the share of pixels that may be."""
SATURATION = 0.1
"""Share of pixels at full scale that tells of saturation."""
DENSE = 1.3
"""Pace of the phase beyond which pixels no longer follow [rad per pixel]."""


@dataclass(frozen=True, eq=False)
class Interpretation:
    """Loads that explain a frame, and the verdict.

    Attributes
    ----------
    loads : ndarray, shape (2n,)
        The likeliest loads, normal ones first [N].
    covariance : ndarray, shape (2n, 2n)
        Of the loads [N^2].
    residuals : ndarray, shape (p,)
        What is left of the used pixels, in units of the noise.
    status : Status
        The verdict.
    rivals : list of ndarray, shape (2n,)
        Other loads that explain the frame as well.
    """

    loads: Array
    covariance: Array
    residuals: Array
    status: Status
    rivals: list[Array]


def interpret(
    levels: Array,
    used: Mask,
    influence: Array,
    response: Response,
    full_scale: int,
    model_error: float,
    doubt: Doubt,
) -> Interpretation:
    """Explain a frame without any earlier state.

    Parameters
    ----------
    levels : ndarray, shape (P,)
        Grey levels.
    used : ndarray of bool, shape (P,)
        Pixels to use.
    influence : ndarray, shape (P, 2n)
        Influence matrix, normal forces first [rad/N].
    response : Response
        Of the camera.
    full_scale : int
        Largest grey level of the converter.
    model_error : float
        Relative size of the influence matrix's errors of shape, where it is known.
    doubt : callable
        What the levels are uncertain by besides noise, for given loads.
    """
    ends = np.flatnonzero(used)[[0, -1]]
    span = slice(ends[0], ends[1] + 1)
    scene = Scene(levels, influence, response, model_error, doubt).at(used)
    levels, used, influence = levels[span], used[span], influence[span]
    response = response.at(span)
    pixels = np.arange(len(levels))
    filled = levels if used.all() else np.interp(pixels, pixels[used], levels[used])
    intensity = (filled - response.offset) / response.amplitude
    variance = float(np.median(response.variance / response.amplitude**2))
    tops: list[Estimate] = []
    for starts in explanations(intensity, variance, influence):
        tops = sorted([*tops, *_climbed(scene, starts)], key=lambda e: e.misfit.loss)
        if is_noise(tops[0].misfit.slope, len(tops[0].loads), SATISFIED):
            break
        sound = _sound_pixels(tops[0], len(levels))
        if sound is not None and not is_noise(tops[0].misfit.slope, len(tops[0].loads)):
            rest = scene.at(sound)
            top = rest.climbed(tops[0].loads)
            if is_noise(top.misfit.slope, len(top.loads)):
                return _judged(rest, [top])
    fitting = [e for e in tops if is_noise(e.misfit.slope, len(e.loads))]
    if fitting:
        return _judged(scene, fitting)
    status = Status.MODEL_MISMATCH
    if np.mean(levels >= full_scale) > SATURATION:
        status = Status.SATURATED
    elif phase_pace(intensity, variance).max() > DENSE:
        status = Status.FRINGES_TOO_DENSE
    best = _pushing(tops[0])
    spread = scene.covariance(best)
    whole = spread + scene.systematic(best, spread, scene.doubt(best.loads))
    return Interpretation(best.loads, whole, best.misfit.slope, status, [])


def _climbed(scene: Scene, starts: Array) -> list[Estimate]:
    """Tops of the likelihood that distinct starts lead to."""
    found: list[Estimate] = []
    for start in starts:
        phase = scene.influence @ start
        if any(_gap(phase, e.phase) < SAME_BASIN for e in found):
            continue
        top = scene.climbed(start)
        if not any(_gap(top.phase, e.phase) < SAME_BASIN for e in found):
            found.append(top)
        if len(found) == CANDIDATES:
            break
    return found


def _sound_pixels(best: Estimate, pixels: int) -> Mask | None:
    """All pixels but a few that alone spoil a fit, if there are such."""
    sound = np.abs(best.misfit.slope) < OUTLIER
    return sound if 0 < np.count_nonzero(~sound) <= OUTLIERS * pixels else None


def _judged(scene: Scene, fitting: list[Estimate]) -> Interpretation:
    """Weigh an explanation that fits against silence, its rivals and errors of the model."""
    if (silence := _silence(scene, fitting[0])) is not None:
        return silence
    tops, complete = _with_neighbours(scene, fitting)
    spread = scene.covariance(tops[0])
    best, loads, chance = _rivals(tops, spread)
    mean, whole = _mixture(loads, chance, spread)
    anchored = complete or np.abs(best.phase).max() > ANCHOR
    status, rivals = Status.OK, []
    if not anchored or (np.diag(whole) > SPREAD**2 * np.diag(spread)).any():
        mean, whole, status, rivals = best.loads, spread, Status.AMBIGUOUS, list(loads[1:])
    doubt = scene.doubt(best.loads)
    wrong = scene.shape_error(best, spread, doubt)
    if wrong.chance < IMPOSSIBLE and not scene.model_error:
        status = Status.MODEL_MISMATCH
    size = max(wrong.size if wrong.chance < DOUBTFUL else 0.0, scene.model_error)
    whole = whole + size**2 * wrong.bias + scene.systematic(best, spread, doubt)
    return Interpretation(mean, whole, best.misfit.slope, status, rivals)


def _silence(scene: Scene, best: Estimate) -> Interpretation | None:
    """No contact, if the best explanation beats it by no more than noise would."""
    unknowns, dark = len(best.loads), np.zeros(len(scene.frame))
    silent = misfit(scene.frame, scene.response.level(dark), scene.response)
    if silent.loss - best.misfit.loss > unknowns + CONTACT * np.sqrt(2 * unknowns):
        return None
    # a load and its negative are equally likely, and neither shows: their mean is none
    nothing = Estimate(np.zeros(unknowns), dark, silent)
    spread = scene.covariance(nothing)
    spread = spread + scene.systematic(nothing, spread, scene.doubt(nothing.loads))
    return Interpretation(nothing.loads, spread, silent.slope, Status.NO_CONTACT, [])


def _rivals(tops: list[Estimate], spread: Array) -> tuple[Estimate, Array, Array]:
    """The best explanation, the loads of all that rival it, best first, and their chances."""
    deviations = np.sqrt(np.diag(spread))
    losses = np.array([e.misfit.loss + _pull(e.loads, deviations) for e in tops])
    order = [i for i in np.argsort(losses) if losses[i] < losses.min() + RIVAL]
    best, loads = tops[order[0]], np.array([tops[i].loads for i in order])
    chance = np.exp((losses.min() - losses[order]) / 2)
    pushes = np.repeat([1.0, 0.0], len(deviations) // 2)
    if best.loads @ pushes < PUSH * np.sqrt(pushes @ spread @ pushes):
        # the pushes are too weak to tell a load from its negative
        loads, chance = np.concatenate([loads, -loads]), np.concatenate([chance, chance])
    return best, loads, chance / chance.sum()


def _with_neighbours(scene: Scene, found: list[Estimate]) -> tuple[list[Estimate], bool]:
    """Explanations around those found, the best first, each pushing, and whether that is all.

    From every explanation within reach of the best one, its mirror images are tried in turn.
    """
    tops = list(found)
    tried = [e.phase for e in tops]
    explored: list[Estimate] = []
    while fresh := [
        e for e in tops if e.misfit.loss < tops[0].misfit.loss + RIVAL and e not in explored
    ]:
        if len(tried) >= TRIED:
            break
        # the one least like those that were explored shows most that is new
        chosen = max(
            fresh, key=lambda e: min((_gap(e.phase, o.phase) for o in explored), default=0)
        )
        explored.append(chosen)
        for start in scene.images(chosen):
            phase = scene.influence @ start
            if any(_gap(phase, other) < SAME_START for other in tried):
                continue
            tried.append(phase)
            top = scene.half_climbed(start)
            if all(_gap(top.phase, e.phase) > SAME_TOP for e in tops):
                tops.append(top)
        tops.sort(key=lambda e: e.misfit.loss)
    tops[0] = scene.climbed(tops[0].loads)
    return [_pushing(e) for e in tops], not fresh


def _mixture(loads: Array, chance: Array, spread: Array) -> tuple[Array, Array]:
    """Mean and covariance of several explanations, each with the same covariance of its own."""
    mean = chance @ loads
    apart = loads - mean
    return mean, spread + (apart * chance[:, None]).T @ apart


def _gap(first: Array, second: Array) -> float:
    """Largest distance of two phases, of which each is known up to its sign [rad]."""
    return float(min(np.abs(first - second).max(), np.abs(first + second).max()))


def _pushing(estimate: Estimate) -> Estimate:
    """The one of a load and its negative that pushes: both give the same frame."""
    if estimate.loads[: len(estimate.loads) // 2].sum() >= 0:
        return estimate
    return Estimate(-estimate.loads, -estimate.phase, estimate.misfit)


def _pull(loads: Array, deviations: Array) -> float:
    """Loss of an explanation for normal forces that pull, which no contact does."""
    n = len(loads) // 2
    return float((np.minimum(loads[:n] / deviations[:n], 0) ** 2).sum())
