"""Optimisation: the design that does one thing best within limits, sought with a budget."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from scipy.optimize import differential_evolution

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.design.strip import Sensor
from fringeforce.studies.evaluation import Setting, evaluate_missing
from fringeforce.studies.performance import NAMES, Performance
from fringeforce.studies.result_store import Outcome, ResultStore, open_store, read_results
from fringeforce.studies.sampling import Axis, changes
from fringeforce.studies.study_file import LARGER_IS_BETTER, DesignSearch, StudyFile
from fringeforce.studies.sweep import Columns, Sweep, meets, prepared, start

CROWD = 8
"""Designs in a generation for each varied value."""
INFEASIBLE, FAILED = 1e6, 1e12
"""Cost of designs that exceed a limit, before by how much, and of those that cannot be computed."""


@dataclass(frozen=True, eq=False)
class BestDesign:
    """The best design that was found.

    Attributes
    ----------
    sensor : Sensor
        The design.
    performance, before : Performance
        What it does, and what the design that the study starts from does.
    sweep : Sweep
        All designs that were tried on the way, feasible or not.
    best : int
        Place of the design in the sweep.
    """

    sensor: Sensor
    performance: Performance
    before: Performance
    sweep: Sweep
    best: int


def optimise(
    study: StudyFile,
    sensor: Sensor,
    path: str | os.PathLike[str],
    pool: Executor,
    progress: Progress | None = None,
) -> BestDesign:
    """Find the best design by differential evolution (Storn and Price, J. Glob. Optim. 11, 1997).

    Every generation is evaluated at once on the executor.  A design that exceeds limits loses to
    any that does not and to any that exceeds them by less (Deb, Comput. Methods Appl. Mech. Eng.
    186, 2000).  The search is a function of its seed, so one that was stopped goes through what its
    file holds already without computing it again.

    Parameters
    ----------
    study : StudyFile
        With a search.
    sensor : Sensor
        The design that it starts from, and the one that it is compared with.
    path : path
        HDF5 file of all designs that were tried.
    pool : Executor
        Where designs are evaluated.
    progress : callable, optional
        Called with words, designs known and their count.

    Raises
    ------
    InputError
        If the study has no search, its budget is too small, or no design within the limits was
        found.
    """
    if study.search is None:
        raise InputError('The study has no [search]; add one with objective = "worst_uncertainty".')
    axes, setting, seed = prepared(study, sensor)
    crowd, generations = _shape(study.search, len(axes))
    places = 1 + crowd * generations
    limits = study.constraints.limits()
    with open_store(path, study.canonical(sensor), axes, places) as store:
        first = evaluate_missing(pool, store, setting, [start(axes, sensor)], progress=progress)
        evaluate = _generation(pool, store, axes, setting, limits, study.search, progress)
        # SciPy's own types forget the array and the map that its documentation allows
        options: dict[str, Any] = {
            "init": _first_generation(len(axes), crowd, np.random.default_rng(seed)),
            "workers": evaluate,
        }
        differential_evolution(
            lambda shares: 0.0,  # the map below evaluates whole generations itself
            [(0.0, 1.0)] * len(axes),
            maxiter=generations - 1,
            tol=0,
            atol=0,
            polish=False,
            updating="deferred",
            rng=np.random.default_rng(seed.spawn(1)[0]),
            **options,
        )
    return _best(study, sensor, read_results(path), axes, first[0])


def cost(outcome: Outcome, objective: str, limits: dict[str, float]) -> float:
    """What the search makes as small as possible."""
    if isinstance(outcome, str):
        return FAILED
    excess = sum(max(getattr(outcome, name) / limit - 1, 0.0) for name, limit in limits.items())
    if excess > 1e-9:
        return INFEASIBLE * (1 + excess)
    value = getattr(outcome, objective)
    return -value if objective in LARGER_IS_BETTER else value


def _first_generation(dimensions: int, crowd: int, rng: np.random.Generator) -> Array:
    """Shares of the first designs, shape (crowd, d): a Latin hypercube, and corners of the ranges.

    What is best often lies at the end of every range, where no inner design comes near it within a
    small budget.  Corners are left out where they would take more than half of the generation.
    """
    corners = np.array(list(product((0.0, 1.0), repeat=dimensions)))
    if len(corners) > crowd / 2:
        corners = corners[:0]
    from scipy.stats import qmc  # as in `sampling`

    inner = qmc.LatinHypercube(dimensions, rng=rng).random(crowd - len(corners))
    return np.concatenate([corners, inner])


def _shape(search: DesignSearch, dimensions: int) -> tuple[int, int]:
    """Designs in a generation, and generations."""
    crowd = max(CROWD * dimensions, 8)
    generations = search.budget // crowd
    if generations < 2:
        raise InputError(
            f"search.budget = {search.budget} is too small for two generations of {crowd} designs; "
            f"give {2 * crowd} or more."
        )
    return crowd, generations


def _generation(
    pool: Executor,
    store: ResultStore,
    axes: list[Axis],
    setting: Setting,
    limits: dict[str, float],
    search: DesignSearch,
    progress: Progress | None,
) -> Callable[[Any, Iterable[Array]], list[float]]:
    """A map, as SciPy wants one, that evaluates a generation and counts the places it takes."""
    place = 1

    def evaluate(_: Any, generation: Iterable[Array]) -> list[float]:
        nonlocal place
        candidates = [changes(axes, shares) for shares in generation]
        outcomes = evaluate_missing(pool, store, setting, candidates, place, progress)
        place += len(candidates)
        return [cost(outcome, search.objective, limits) for outcome in outcomes]

    return evaluate


def _best(
    study: StudyFile, sensor: Sensor, columns: Columns, axes: list[Axis], before: Outcome
) -> BestDesign:
    assert study.search is not None
    sweep = Sweep(axes, columns, meets(columns, study.constraints.limits()))
    tried = np.flatnonzero(sweep.feasible)
    if isinstance(before, str):
        raise InputError(f"The design that the study starts from cannot be computed: {before}")
    if not len(tried):
        raise InputError(
            "No design within the constraints was found; widen them, the ranges or search.budget."
        )
    values = columns[study.search.objective][tried]
    larger = study.search.objective in LARGER_IS_BETTER
    best = int(tried[np.argmax(values) if larger else np.argmin(values)])
    found: dict[str, Any] = {}
    for one in axes:
        value = columns[one.path][best]
        found[one.path] = str(value) if one.text else int(value) if one.whole else float(value)
    reached = Performance(**{name: float(columns[name][best]) for name in NAMES})
    return BestDesign(sensor.replace(**found), reached, before, sweep, best)
