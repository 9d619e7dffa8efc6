"""A model put to the test on frames whose loads are known and that it has not seen."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtri

from fringeforce.base.arrays import Array
from fringeforce.base.blas_threads import one_blas_thread
from fringeforce.base.errors import InputError
from fringeforce.base.measured import INTERVAL
from fringeforce.calibration.bench_expectation import DOUBT
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.checks import checked_bench, checked_measurements
from fringeforce.calibration.load_log import LoadLog
from fringeforce.calibration.resultants import compared
from fringeforce.calibration.timed_loads import TimedLoads
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.models.as_built import PLACEMENT
from fringeforce.models.pad import PadModel
from fringeforce.models.presses import Presses, are_presses
from fringeforce.models.strip import SensorModel
from fringeforce.reading.reader import Reader
from fringeforce.reading.reading import Reading, Status

CONTRADICTED = 1e-4
"""Chance of being as far off below which a reading contradicts its load, a fitted value its
drawing, or a coverage its intervals."""
BESIDE = 3.0
"""Standard deviations of its place beyond which a contact does not lie on a tactel."""


@dataclass(frozen=True, eq=False)
class Verification:
    """How readings compare with known loads.

    Attributes
    ----------
    error : float
        Root-mean-square error of the forces that were read [N].
    stated : float
        Root-mean-square of the standard deviations that were stated [N].
    coverage : float
        Share of forces within their 95 % intervals.
    statuses : Counter
        Frames by the name of their status.
    wrong : tuple of int
        Rows of frames whose reading contradicts the load far beyond its covariance.
    places : pair of float, optional
        Root-mean-square error of the centre of pressure, and of the deviations that were stated,
        those of the load's place included [m], along each axis; of loads by position.
    beside : bool
        Whether contacts lie beside the tactels of the design, whose forces do not explain them.  A
        pad is read as a skin then, which takes contacts anywhere.
    """

    error: float
    stated: float
    coverage: float
    statuses: Counter[str]
    wrong: tuple[int, ...]
    places: tuple[float, float] | None = None
    beside: bool = False

    @property
    def passed(self) -> bool:
        """Whether all frames were read and none contradicts its load."""
        return not self.wrong and set(self.statuses) <= {"OK", "NO_CONTACT"}


@one_blas_thread()
def verify(
    model: SensorModel | PadModel,
    frames: ArrayLike,
    forces: ArrayLike | BenchLoads | LoadLog | Presses,
    *,
    times: ArrayLike | None = None,
) -> Verification:
    """Read frames and compare with their loads.

    Forces of tactels are compared one by one.  Of loads by position or time, which do not tell the
    forces of tactels, the whole force of a frame and its centre are; on a pad that reads contacts
    anywhere, if they lie beside its tactels.

    Parameters
    ----------
    model : SensorModel or PadModel
        The model to check.
    frames : array_like, shape (F, n_pixels), or (F, rows, columns) of a pad
        Grey levels.
    forces : array_like, shape (F, n, components), BenchLoads, LoadLog, or sequences of Press
        Known forces of tactels [N]; or contacts at any place, for every frame; or a log of them by
        time.
    times : array_like, shape (F,), optional
        When the frames were taken [s]; with a log by time.

    Raises
    ------
    InputError
        If they do not fit the sensor or each other, or not one frame can be read.
    """
    if isinstance(forces, BenchLoads) and forces.named:
        forces = forces.on_tactels(model.sensor.tactels.total)
    if isinstance(forces, BenchLoads | LoadLog) or are_presses(forces):
        levels, known = checked_bench(model.sensor, frames, forces, times)
        return _by_position(model, levels, known)
    levels, loads = checked_measurements(model.sensor, frames, cast(ArrayLike, forces))
    readings = _readings(model, levels)
    read = np.array([np.isfinite(reading.forces).all() for reading in readings])
    if not read.any():
        raise InputError(f"Not one of {len(read)} frames can be read: {readings[0].advice}")
    off = np.array([r.forces.ravel() - load for r, load in zip(readings, loads, strict=True)])
    std = np.array([reading.std.ravel() for reading in readings])
    wrong = [not _agrees(r, error) for r, error in zip(readings, off, strict=True)]
    return Verification(
        error=float(np.sqrt(np.mean(off[read] ** 2))),
        stated=float(np.sqrt(np.mean(std[read] ** 2))),
        coverage=float(np.mean(np.abs(off[read]) < INTERVAL * std[read])),
        statuses=Counter(reading.status.name for reading in readings),
        wrong=tuple(np.flatnonzero(wrong).tolist()),
    )


def _by_position(
    model: SensorModel | PadModel, levels: Array, known: BenchLoads | TimedLoads
) -> Verification:
    """Whole forces and their centres beside those of contacts anywhere."""
    apart = _lies_beside(model.sensor, known)
    if apart and isinstance(model, PadModel) and model.sensor.transducer.strain == "linear":
        model = model.as_skin()
    readings = _readings(model, levels)
    beside = compared(model.sensor, readings, known)
    off, std = beside.forces, beside.force_std
    read = np.isfinite(off).all(axis=1)
    if not read.any():
        refused = next((one for one in readings if not one.ok), readings[0])
        raise InputError(f"Not one of {len(levels)} frames can be read: {refused.advice}")
    there = np.isfinite(beside.centres).all(axis=1)
    places = None
    if there.any():
        both = beside.centres, beside.centre_std
        error, stated = (np.sqrt(np.mean(v[there] ** 2)) for v in both)
        places = float(error), float(stated)
    return Verification(
        error=float(np.sqrt(np.mean(off[read] ** 2))),
        stated=float(np.sqrt(np.mean(std[read] ** 2))),
        coverage=float(np.mean(np.abs(off[read]) < INTERVAL * std[read])),
        statuses=Counter(reading.status.name for reading in readings),
        wrong=tuple(np.flatnonzero(read & (beside.chances < CONTRADICTED)).tolist()),
        places=places,
        beside=apart,
    )


def _lies_beside(sensor: Sensor | Pad, known: BenchLoads | TimedLoads) -> bool:
    """Whether contacts lie beside the tactels, more than their places are uncertain."""
    if sensor.skin is not None:
        return False
    loads = known if isinstance(known, BenchLoads) else known.at(known.delay)
    here, tactels = loads.present, sensor.tactels.places
    places = loads.places[here].reshape(-1, 1, sensor.dimensions)
    nearest = np.abs(places - tactels).max(axis=2).min(axis=1)
    stated = loads.place_std[here]
    unsure = np.where(np.isfinite(stated), stated, DOUBT["place"])
    drawn = sensor.tolerances.get(PLACEMENT, 0.0)
    return bool((nearest > BESIDE * np.hypot(unsure, drawn)).any())


def _readings(model: SensorModel | PadModel, levels: Array) -> list[Reading]:
    """Readings of frames, each by itself."""
    reader = Reader(model)
    return [reader.search(frame.reshape(model.frame_shape)) for frame in levels]


def _agrees(reading: Reading, off: Array) -> bool:
    """Whether an error is one that the reading's covariance, or an alternative, allows."""
    if reading.status is Status.BAD_FRAME:
        return True
    load = reading.forces.ravel() - off
    whitening = np.linalg.inv(reading.covariance)
    explanations = np.concatenate([reading.forces[None], reading.alternatives])
    apart = explanations.reshape(len(explanations), -1) - load
    return bool(
        (np.einsum("ki,ij,kj->k", apart, whitening, apart) < chdtri(len(off), CONTRADICTED)).any()
    )
