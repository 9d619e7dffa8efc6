"""The verdict on an explanation: weighed against silence, its rivals and errors of the model."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.estimate import Estimate
from fringeforce.estimation.likelihood import misfit
from fringeforce.estimation.residual_test import FALSE_CONTACT, square_limit
from fringeforce.estimation.strip_fit import Optimum
from fringeforce.reading.frame_problem import FrameProblem
from fringeforce.reading.reading import Status

Array = NDArray[np.float64]

SAME_START, SAME_TOP = 0.1, 0.05
"""Phases nowhere farther apart are one: of mirror images, of climbs [rad]."""
TRIED = 40
"""Mirror images of all explanations together that are tried."""
RIVAL = 16.0
"""Twice the log-likelihood by which an explanation must beat another to rule it out: the other is
then exp(-8) = 0.0003 times as likely."""
SPREAD = 3.0
"""Factor in a deviation up to which rivals that widen it are one explanation, less sure."""
SETTLED = 1.4
"""Factor up to which frames are followed as if one explanation was found."""
MOST_PULL = RIVAL
"""Largest loss for forces that pull."""
PUSH = 5.0
"""Standard deviations that the sum of the pushes must have to tell a load from its negative."""
DOUBTFUL, IMPOSSIBLE = 0.05, 1e-5
"""Chances of a misfit below which it widens the deviations, and below which the model is wrong."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """Loads that explain a frame, and the verdict.

    Attributes
    ----------
    loads : ndarray, shape (2n,)
        The likeliest loads, ordered like `forces.ravel()` [N].
    covariance : ndarray, shape (2n, 2n)
        Of the loads [N^2].
    noise : ndarray, shape (2n, 2n)
        The part of it that noise alone causes [N^2].
    residuals : ndarray, shape (p,)
        What is left of the used pixels, in units of the noise.
    status : Status
        The verdict.
    rivals : list of ndarray, shape (2n,)
        Other loads that explain the frame as well.
    settled : bool
        Whether one explanation is enough to follow frames from; an OK reading may be the mean of
        several that lie close together.
    """

    loads: Array
    covariance: Array
    noise: Array
    residuals: Array
    status: Status
    rivals: list[Array]
    settled: bool = True


def selected(problem: FrameProblem, fitting: list[Optimum]) -> Hypothesis:
    """Weigh an explanation that fits against silence, its rivals and errors of the model.

    Parameters
    ----------
    problem : FrameProblem
        The frame.
    fitting : list of Optimum
        Explanations that leave nothing but noise, the likeliest first.
    """
    if (silence := _silence(problem, fitting[0])) is not None:
        return silence
    optima, complete = _with_neighbours(problem, fitting)
    spread = problem.covariance(problem.climbed(optima[0].loads))
    loads, chance = _rivals(problem, optima, spread)
    best = problem.climbed(loads[0])
    loads[0] = best.loads
    mean, whole = _mixture(loads, chance, spread)
    status, rivals = Status.OK, []
    settled = not (np.diag(whole) > SETTLED**2 * np.diag(spread)).any()
    if not complete or (np.diag(whole) > SPREAD**2 * np.diag(spread)).any():
        mean, whole, status, rivals = best.loads, spread, Status.AMBIGUOUS, list(loads[1:])
    wrong = problem.model_discrepancy(best, spread)
    if wrong.chance < IMPOSSIBLE:
        status = Status.MODEL_MISMATCH
    if wrong.chance < DOUBTFUL:
        whole = whole + wrong.size**2 * wrong.bias
    return Hypothesis(mean, whole, spread, best.misfit.slope, status, rivals, settled)


def _silence(problem: FrameProblem, best: Optimum) -> Hypothesis | None:
    """No contact, if the best explanation beats it by no more than noise would."""
    unknowns, dark = len(best.loads), np.zeros(len(problem.frame))
    silent = misfit(problem.frame, problem.response.level(dark), problem.response)
    if silent.loss - best.loss > square_limit(unknowns, FALSE_CONTACT):
        return None
    # a load and its negative are equally likely, and neither shows: their mean is none
    nothing = Estimate(np.zeros(unknowns), dark, silent)
    spread = problem.covariance(nothing)
    return Hypothesis(nothing.loads, spread, spread, silent.slope, Status.NO_CONTACT, [])


def _rivals(problem: FrameProblem, optima: list[Optimum], spread: Array) -> tuple[Array, Array]:
    """The loads of the best explanation and of all that rival it, best first; their chances."""
    deviations = np.sqrt(np.diag(spread))
    losses = np.array([optimum.loss + _pull(optimum.loads, deviations) for optimum in optima])
    order = [i for i in np.argsort(losses, kind="stable") if losses[i] < losses.min() + RIVAL]
    loads = np.array([optima[i].loads for i in order])
    chance = np.exp((losses.min() - losses[order]) / 2)
    pushes = np.tile([1.0, 0.0], len(deviations) // 2)
    weak = loads[0] @ pushes < PUSH * np.sqrt(pushes @ spread @ pushes)
    if weak and problem.response.even:
        # the pushes are too weak to tell a load from its negative
        loads, chance = np.concatenate([loads, -loads]), np.concatenate([chance, chance])
    return loads, chance / chance.sum()


def _with_neighbours(problem: FrameProblem, found: list[Optimum]) -> tuple[list[Optimum], bool]:
    """Explanations around those found, the best first, each pushing, and whether that is all.

    From every explanation within reach of the best one, its mirror images are tried in turn.
    """
    optima = list(found)
    tried, kept, explored = problem.phases(optima), problem.phases(optima), problem.phases()
    done: list[Optimum] = []
    while fresh := [
        optimum
        for optimum in optima
        if optimum.loss < optima[0].loss + RIVAL and optimum not in done
    ]:
        if len(tried) >= TRIED:
            break
        # the one least like those that were explored shows most that is new
        chosen = max(fresh, key=lambda optimum: explored.distance(optimum.phase))
        explored.add(chosen.phase)
        done.append(chosen)
        images = problem.images(chosen.loads)
        for start in images[tried.admit(problem.strip, images, SAME_START)]:
            optimum = problem.near_optimum(start)
            if not kept.know(optimum.phase, SAME_TOP):
                kept.add(optimum.phase)
                optima.append(optimum)
        optima.sort(key=lambda optimum: optimum.loss)
    optima[0] = problem.optimum(optima[0].loads)
    return [replace(optimum, loads=problem.pushing(optimum.loads)) for optimum in optima], not fresh


def _mixture(loads: Array, chance: Array, spread: Array) -> tuple[Array, Array]:
    """Mean and covariance of several explanations, each with the same covariance of its own."""
    mean = chance @ loads
    apart = loads - mean
    return mean, spread + (apart * chance[:, None]).T @ apart


def _pull(loads: Array, deviations: Array) -> float:
    """Loss of an explanation for normal forces that pull, which no contact does.

    At most what rules out an explanation: a slow mean of moving forces may seem to pull a little.
    """
    return min(float((np.minimum(loads[::2] / deviations[::2], 0) ** 2).sum()), MOST_PULL)
