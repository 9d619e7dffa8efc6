"""What one design does, or why it cannot be known: the call that travels to the workers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from fringeforce.base.progress import Progress, counted
from fringeforce.design.strip import Sensor
from fringeforce.studies.execution import completed
from fringeforce.studies.performance import coarse_model, performance
from fringeforce.studies.result_store import OPEN, Outcome, ResultStore
from fringeforce.studies.sampling import Value


@dataclass(frozen=True)
class Setting:
    """What all designs of a study share.

    Attributes
    ----------
    sensor : Sensor
        The design that they vary.
    working_load : float
        Largest normal force on a tactel [N].
    mesh_order : int
        Order of the elements.
    seed : SeedSequence
        Seed of the loads that designs are judged by.
    """

    sensor: Sensor
    working_load: float
    mesh_order: int
    seed: np.random.SeedSequence


def evaluate(setting: Setting, changes: Mapping[str, Value]) -> Outcome:
    """Performance of a design with some values changed, or the text of whatever error it raised."""
    try:
        model = coarse_model(setting.sensor.replace(**changes), setting.mesh_order)
        return performance(model, setting.working_load, setting.seed)
    except Exception as error:  # a design that fails must not end the study of the others
        return f"{type(error).__name__}: {error}"


def evaluate_missing(
    pool: Executor,
    store: ResultStore,
    setting: Setting,
    candidates: Sequence[Mapping[str, Value]],
    first: int = 0,
    progress: Progress | None = None,
) -> list[Outcome]:
    """Evaluate designs that the store does not know yet, and write each down as it comes.

    Parameters
    ----------
    pool : Executor
        Where they are evaluated.
    store : ResultStore
        Keeps the results.
    setting : Setting
        What they share.
    candidates : sequence of mapping
        Values of the designs by path; they have the places `first`, `first + 1`, ...
    first : int
        Place of the first.
    progress : callable, optional
        Called with words, the number of designs known and their count.

    Returns
    -------
    list
        Outcomes in the order of the candidates.
    """
    states = store.states
    places = range(first, first + len(candidates))

    tasks = (
        (place, (setting, changes))
        for place, changes in zip(places, candidates, strict=True)
        if states[place] == OPEN
    )
    outcomes, known = completed(pool, evaluate, tasks), int((states != OPEN).sum())
    for place, outcome in counted(outcomes, progress, "designs", len(states), known):
        store.record(place, candidates[place - first], outcome)
    found = [store.outcome(place) for place in places]
    return [outcome for outcome in found if outcome is not None]
