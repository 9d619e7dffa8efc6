"""From a bench to its most probable sensor: in stages, with what scatters found on the way."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.progress import Progress
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.bench_posterior import GROUPS, BenchPosterior
from fringeforce.calibration.bench_search import (
    HEATS,
    LARGEST,
    REFITS,
    ROUNDS,
    STAGES,
    BenchSearch,
    Check,
    inverse,
)
from fringeforce.calibration.frame_models import FrameModels
from fringeforce.calibration.light.pattern import Pattern
from fringeforce.calibration.shared_unknowns import State
from fringeforce.estimation.residual_test import square_limit
from fringeforce.estimation.shared_fit import excess_scatter

FREED = 2
"""Rounds of the last stage before errors of columns enter: design and camera come first."""
DETECTED = 4.0
"""Standard deviations of chance that a scatter must exceed noise by to be called one: the variance
of n values is sure to sqrt(2 / n), and the share s / (1 - s) of it is not noise."""
ROUGH_STEPS = 6
"""Most steps of a descent where nothing is explained yet, as in rough fits, whose frames are
weighed once for each heat: right loads lead down in three or four, and others wander for long and
explain no more.  What explains its frames does so from the first heat on."""
HOPELESS = 1.5
"""Median misfit of frames beyond which more rounds do not make a bench explained."""


@dataclass(frozen=True, eq=False)
class BenchFit:
    """The most probable sensor of a bench.

    Attributes
    ----------
    sensor : Sensor or Pad
        The drawing.
    paths : tuple of str
        Values of the design that were unknown.
    posterior : BenchPosterior
        With what scatters, and the frames' weights.
    state : State
        Where it is largest.
    information : ndarray, shape (S, S)
        Of the shared unknowns, the prior included.
    sound : ndarray of bool, shape (P,)
        Pixels that follow the light.
    kept : ndarray of bool, shape (F,)
        Frames that do not contradict the others.
    chi2 : float
        Reduced chi-square of these.
    explained : ndarray of bool, shape (F,)
        Frames of these whose residuals are those of noise, by `square_limit`.
    excess : ndarray, shape (S,)
        Variance of what frames tell of each shared unknown, over that of their noise.
    delay : float
        By which the log of the loads is behind the frames, if there is one [s].
    checked : Check
        How frames that were put aside compare with their loads.
    told : mapping
        Share of what scatters, by GROUPS, or varies, by SMOOTH, that frames tell rather than what
        is expected of it, and how many tell.
    moved : ndarray, shape (S, S)
        What the shared unknowns move in readings of these frames: the sum of squared motions of
        forces that nobody states, in their deviations.
    pattern : Pattern, optional
        What single pixels add to the smooth light.
    aside : tuple
        Forces of frames put aside: frame, component, error and its deviation, as in `BenchRecord`.
    beyond : tuple of str
        Of GROUPS, what scatters more than any bench that can be explained.
    rough : callable
        Usual misfit of some frames with other loads, after the first stages of a new search, which
        ends early if that of the calm ones is beyond a limit.
    """

    sensor: Any
    paths: tuple[str, ...]
    posterior: BenchPosterior
    state: State
    information: Array
    sound: Mask
    kept: Mask
    chi2: float
    explained: Mask
    excess: Array
    delay: float
    checked: Check
    told: Mapping[str, tuple[float, float]]
    moved: Array
    pattern: Pattern | None = None
    aside: tuple[tuple[float, ...], ...] = ()
    beyond: tuple[str, ...] = ()
    rough: Callable[[Array, BenchLoads, float], float] = field(
        default=lambda levels, loads, limit: np.nan
    )

    def shown(self, name: str) -> bool:
        """Whether frames show that something scatters or varies, or it is lost in their noise."""
        share, count = self.told[name]
        return share > DETECTED / (DETECTED + np.sqrt(count / 2))

    @property
    def covariance(self) -> Array:
        """Of the shared unknowns, shape (S, S)."""
        return inverse(self.information)

    @property
    def models(self) -> FrameModels:
        """Models of the frames at the solution."""
        return self.posterior.models(self.state.shared)


def fitted(
    search: BenchSearch, report: Progress, aside: int = 0, columns: bool = False
) -> BenchFit:
    """Fit all that is unknown of a bench.

    Parameters
    ----------
    search : BenchSearch
        Before its first step.
    report : callable
        Told what is done.
    aside : int
        Every so many frames one is put aside at first and checked; none if zero.
    columns : bool
        Whether columns of tactels may differ from those of any design.
    """
    search.put_aside(aside)
    total = len(STAGES) + ROUNDS + 2
    report("Finding the sensor", 0, total)
    search.begin()

    def hopeless(few: Mask | None = None) -> bool:
        plain = not columns and search.pattern is None
        return plain and search.misfit(few) > HOPELESS

    before, lost = np.zeros(len(search.kept), dtype=bool), False
    usual = search.steps, search.weighings
    rough = min(ROUGH_STEPS, search.steps), 1
    for number, limit in enumerate(STAGES):
        few = search.calm(limit)
        if np.array_equal(few, before):
            continue
        before = few
        report(f"Fitting {few.sum()} frames", 1 + number, total)
        for heat in HEATS if number == 0 else HEATS[-1:]:
            search.descend(few, heat)
            lost = hopeless(few)
            search.steps, search.weighings = rough if lost else usual
        if lost:  # more frames explain no more
            break
    for number in range(ROUNDS):
        report(f"Fitting {search.kept.sum()} frames", 1 + len(STAGES) + number, total)
        if columns and number == FREED:
            search.free_columns()
        lost = hopeless()
        search.steps, search.weighings = rough if lost else usual
        if (search.improve() and (number > FREED or not columns)) or (number and lost):
            break
    if not search.wanted.all():
        report("Checking frames that were put aside", total - 1, total)
        search.check()
        for _ in range(REFITS if search.misfit() < HOPELESS else 0):
            if search.improve():
                break
    report("Done", total, total)
    return _result(search)


def roughly_fitted(search: BenchSearch, limit: float = np.inf) -> float:
    """Usual misfit per pixel of a few frames after the first stages of a new search.

    Parameters
    ----------
    search : BenchSearch
        Before its first step.
    limit : float
        Misfit of the calm frames beyond which the others need not be looked at.
    """
    search.steps, search.weighings = min(ROUGH_STEPS, search.steps), 1
    search.begin()
    for heat in HEATS[:-1]:
        calm = search.calm(STAGES[0])
        search.descend(calm, heat)
    if (misfit := search.misfit(calm)) > limit:
        return misfit
    for heat in HEATS[-2:]:
        search.descend(search.kept, heat)
    return search.misfit()


def _result(search: BenchSearch) -> BenchFit:
    """The fit that a search has come to."""
    posterior = search.posterior(search.kept.astype(float), 1.0)
    models = posterior.models(search.state.shared)
    about = posterior.second_order(search.state, models)
    posterior = replace(posterior, exact=about.exact)
    told, information = about.told, about.information
    _, squares, counts = posterior.loss(search.state, models)
    covariance = inverse(information)
    scatter = search.scatter(told, covariance) | search.smooth(covariance)
    free = posterior.expected.freedom(covariance)
    if search.pattern is not None:
        free += search.pattern.freedom(search.sound & search.seen)
    chi2 = float(squares[search.kept].sum() / (counts[search.kept].sum() - free))
    limits = np.array([square_limit(count) for count in counts])
    return BenchFit(
        search.sensor,
        search.paths,
        posterior,
        search.state,
        information,
        search.sound,
        search.kept,
        chi2,
        search.kept & (squares <= limits),
        excess_scatter(told, posterior.shares, covariance),
        search.delay,
        search.checked,
        {name: (told / max(n, 1.0), n) for name, (_, told, n) in scatter.items()},
        search.moved(models),
        search.pattern,
        tuple(search.aside),
        tuple(name for name in GROUPS if search.sizes[name] >= LARGEST and not search.lost[name]),
        lambda levels, loads, limit: roughly_fitted(search.again(levels, loads), limit),
    )
