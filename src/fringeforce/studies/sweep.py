"""Sweeps: what many designs do, on one machine or many, and what that says."""

from __future__ import annotations

import os
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.base.progress import Progress
from fringeforce.design.strip import Sensor
from fringeforce.studies.evaluation import Setting, evaluate_missing
from fringeforce.studies.result_store import DONE, FAILED, open_store, read_results
from fringeforce.studies.sampling import Axis, axis, designs, value_at
from fringeforce.studies.study_file import LARGER_IS_BETTER, StudyFile

Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True, eq=False)
class Sweep:
    """Results of a sweep.

    Attributes
    ----------
    axes : list of Axis
        Varied values.
    columns : dict of ndarray, shape (designs + 1,)
        Values and performances; the first design is the one that the study starts from.
    feasible : ndarray of bool, shape (designs + 1,)
        Designs that could be computed and meet the constraints.
    """

    axes: list[Axis]
    columns: Columns
    feasible: Mask

    @property
    def failed(self) -> int:
        """Designs that could not be computed."""
        return int((self.columns["state"] == FAILED).sum())

    def pareto(self, first: str, second: str) -> Index:
        """Feasible designs that no other beats in both of two quantities, in order of the first."""
        candidates = np.flatnonzero(self.feasible)
        one, two = (self._cost(name)[candidates] for name in (first, second))
        order = np.lexsort((two, one))
        best = np.minimum.accumulate(np.concatenate(([np.inf], two[order][:-1])))
        return candidates[order[two[order] < best]]

    def _cost(self, name: str) -> Array:
        return -self.columns[name] if name in LARGER_IS_BETTER else self.columns[name]


def run_sweep(
    study: StudyFile,
    sensor: Sensor,
    path: str | os.PathLike[str],
    pool: Executor,
    progress: Progress | None = None,
) -> Sweep:
    """Evaluate all designs of a study; those that a file holds already are kept.

    Parameters
    ----------
    study : StudyFile
        What to vary.
    sensor : Sensor
        The design that it starts from.
    path : path
        HDF5 file of results; made, or resumed if it exists.
    pool : Executor
        Where designs are evaluated.
    progress : callable, optional
        Called with words, designs known and their count.
    """
    axes, setting, sampling_seed = prepared(study, sensor)
    candidates = [start(axes, sensor), *designs(study.sampling, axes, sampling_seed)]
    with open_store(path, study.canonical(sensor), axes, len(candidates)) as store:
        evaluate_missing(pool, store, setting, candidates, progress=progress)
    columns = read_results(path)
    return Sweep(axes, columns, meets(columns, study.constraints.limits()))


def prepared(
    study: StudyFile, sensor: Sensor
) -> tuple[list[Axis], Setting, np.random.SeedSequence]:
    """Axes of a study, what its designs share, and the seed by which they are chosen."""
    axes = [axis(parameter, sensor) for parameter in study.parameters]
    choosing, loads = np.random.SeedSequence(study.seed).spawn(2)
    return axes, Setting(sensor, study.working_load, study.mesh_order, loads), choosing


def start(axes: list[Axis], sensor: Sensor) -> dict[str, Any]:
    """The values of the design that a study starts from."""
    return {one.path: value_at(sensor, one.path) for one in axes}


def meets(columns: Columns, limits: dict[str, float]) -> Mask:
    """Designs that could be computed and exceed no limit by more than rounding, shape (k,)."""
    fine = columns["state"] == DONE
    for name, limit in limits.items():
        fine &= np.nan_to_num(columns[name], nan=np.inf) <= limit * (1 + 1e-9)
    return fine
