"""A model put to the test on frames whose loads are known and that it has not seen."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtri

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.calibration.checks import checked_measurements
from fringeforce.models.strip import SensorModel
from fringeforce.reading.reader import Reader
from fringeforce.reading.reading import Reading, Status

INTERVAL = 1.96
"""Standard deviations of a 95 % interval."""
CHANCE = 1e-4
"""Chance of errors this large below which a reading contradicts its load."""


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
    """

    error: float
    stated: float
    coverage: float
    statuses: Counter[str]
    wrong: tuple[int, ...]

    @property
    def passed(self) -> bool:
        """Whether all frames were read and none contradicts its load."""
        return not self.wrong and set(self.statuses) <= {"OK", "NO_CONTACT"}


def verify(model: SensorModel, frames: ArrayLike, forces: ArrayLike) -> Verification:
    """Read frames and compare with their loads.

    Parameters
    ----------
    model : SensorModel
        The model to check.
    frames : array_like, shape (F, n_pixels)
        Grey levels.
    forces : array_like, shape (F, n, 2)
        Known forces [N].

    Raises
    ------
    InputError
        If they do not fit the sensor or each other, or not one frame can be read.
    """
    levels, loads = checked_measurements(model.sensor, frames, forces)
    reader = Reader(model)
    readings = [reader.search(frame) for frame in levels]
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


def _agrees(reading: Reading, off: Array) -> bool:
    """Whether an error is one that the reading's covariance, or an alternative, allows."""
    if reading.status is Status.BAD_FRAME:
        return True
    load = reading.forces.ravel() - off
    whitening = np.linalg.inv(reading.covariance)
    explanations = np.concatenate([reading.forces[None], reading.alternatives])
    apart = explanations.reshape(len(explanations), -1) - load
    return bool(
        (np.einsum("ki,ij,kj->k", apart, whitening, apart) < chdtri(len(off), CHANCE)).any()
    )
