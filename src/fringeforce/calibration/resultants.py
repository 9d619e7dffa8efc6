"""Whole forces of readings and their centres beside those of contacts at any place."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import chdtrc

from fringeforce.base.arrays import Array
from fringeforce.calibration.bench_expectation import DOUBT
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.timed_loads import TimedLoads
from fringeforce.contacts.resultant import touch
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.estimation.bad_pixels import OUTLIER
from fringeforce.reading.reading import Reading

MOMENT = 3
"""Components of a moment, which stand between force and centre in a resultant's covariance."""
DELAYS = np.linspace(-2.0, 2.0, 81)
"""Delays of a log that are tried about the one that frames alone tell, in its deviations."""


class Beside(NamedTuple):
    """Readings beside known loads.

    Rows are not numbers of frames that cannot be read, and where nothing touches by both.

    Attributes
    ----------
    forces, force_std : ndarray, shape (F, components)
        Errors of the whole force [N], and their deviations, those of the load included.
    centres, centre_std : ndarray, shape (F, dimensions)
        The same of the centre of pressure [m]; frames without pressure have none.
    chances : ndarray, shape (F,)
        Chances of errors as large.
    """

    forces: Array
    force_std: Array
    centres: Array
    centre_std: Array
    chances: Array


def compared(
    sensor: Sensor | Pad, readings: Sequence[Reading], known: BenchLoads | TimedLoads
) -> Beside:
    """Whole forces of frames beside those of their contacts.

    Deviations that the loads do not state are those that a calibration starts from.  The delay of a
    log is the one at which it fits the readings best.

    Parameters
    ----------
    sensor : Sensor or Pad
        The drawing.
    readings : sequence of Reading, length F
        Of the frames.
    known : BenchLoads or TimedLoads
        What was written down.
    """
    read = [_read(sensor, reading) for reading in readings]
    if isinstance(known, BenchLoads):
        return _beside(read, known)

    def late(steps: float) -> Beside:
        return _beside(read, known.at(known.delay + steps * known.unsure))

    def misfit(steps: float) -> float:
        one = late(steps)
        # an outlier tells of a wrong load, not of the delay
        return float(np.nansum(np.minimum(np.square(one.forces / one.force_std), OUTLIER**2)))

    best = float(DELAYS[np.argmin([misfit(float(steps)) for steps in DELAYS])])
    step = float(DELAYS[1] - DELAYS[0])
    found: Any = minimize_scalar(misfit, bounds=(best - step, best + step), method="bounded")
    return late(float(found.x))


def _read(sensor: Sensor | Pad, reading: Reading) -> tuple[Array, Array]:
    """Forces and centre that a reading and its alternatives tell, shape (k, m), and covariance."""
    components = len(sensor.components)
    size = components + sensor.dimensions
    if not np.isfinite(reading.forces).all():
        return np.full((1, size), np.nan), np.full((size, size), np.nan)
    total = reading.total or touch(sensor, reading).total
    part = np.arange(size)
    part[components:] += MOMENT
    found = [np.append(total.force, total.centre)]
    for forces in reading.alternatives:
        whole = forces.sum(axis=0)
        moment = sensor.tactels.places.T @ forces[:, 0]
        found.append(np.append(whole, moment / (whole[0] if whole[0] > 0 else np.nan)))
    return np.array(found), total.covariance[np.ix_(part, part)]


def _beside(read: Sequence[tuple[Array, Array]], loads: BenchLoads) -> Beside:
    components = loads.forces.shape[2]
    errors, std = np.full((2, len(read), len(read[0][1])), np.nan)
    chances = np.ones(len(read))
    for f, (found, covariance) in enumerate(read):
        if not np.isfinite(found[0, :components]).all():
            continue
        values, unsure = _written(loads, f)
        whole = covariance + unsure
        if not (found[:, :components].any() or values[:components].any()):
            continue  # no force, and none was written down
        off = found - values
        errors[f], std[f] = off[0], np.sqrt(np.diag(whole))
        explained = []
        for one in off:
            told = np.isfinite(one) & np.isfinite(np.diag(whole))
            square = one[told] @ np.linalg.solve(whole[np.ix_(told, told)], one[told])
            explained.append(float(chdtrc(int(told.sum()), square)))
        chances[f] = max(explained)
    forces, centres = np.split(errors, [components], axis=1)
    return Beside(forces, std[:, :components], centres, std[:, components:], chances)


def _written(loads: BenchLoads, f: int) -> tuple[Array, Array]:
    """Whole force and centre of the contacts of a frame, shape (m,), and covariance (m, m)."""
    own = np.flatnonzero(loads.present[f])
    forces, components = loads.forces[f, own], loads.forces.shape[2]
    places = loads.places[f, own].reshape(len(own), components - 1)
    size = np.linalg.norm(forces, axis=1)
    doubt = np.outer(size, [DOUBT["normal"], *[DOUBT["tangential"]] * (components - 1)])
    stated, apart = loads.force_std[f, own], loads.place_std[f, own]
    unsure = np.where(np.isfinite(stated), stated, doubt)
    apart = np.where(np.isfinite(apart), apart, DOUBT["place"])
    whole = forces.sum(axis=0)
    covariance = np.diag([*np.square(unsure).sum(axis=0), *np.full(components - 1, np.nan)])
    if whole[0] <= 0:
        return np.array([*whole, *np.full(components - 1, np.nan)]), covariance
    centre = forces[:, 0] @ places / whole[0]
    lever = (places - centre) / whole[0]
    shares = forces[:, 0] / whole[0]
    normal, beside = np.square(unsure[:, 0]), np.square(shares * apart).sum()
    covariance[components:, components:] = lever.T @ (normal[:, None] * lever) + beside * np.eye(
        components - 1
    )
    covariance[0, components:] = covariance[components:, 0] = normal @ lever
    return np.array([*whole, *centre]), covariance
