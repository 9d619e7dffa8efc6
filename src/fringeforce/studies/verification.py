"""A predicted uncertainty put to the test: noisy frames read, errors counted."""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.design.strip import Sensor
from fringeforce.models.strip import characterize
from fringeforce.reading.reader import Reader
from fringeforce.reading.reading import Status
from fringeforce.studies.execution import gathered
from fringeforce.studies.loads import load_maps
from fringeforce.studies.monte_carlo import DEVIATIONS
from fringeforce.studies.performance import uncertainties

BATCH = 50


@dataclass(frozen=True, eq=False)
class Verified:
    """Readings of many noisy frames of one design.

    Attributes
    ----------
    frames : int
        At the design's worst load.
    predicted, found : float
        Standard deviation of the worst force as predicted, and root mean square error of the
        readings [N].
    read_right : float
        Share of those frames with the verdict OK and all forces within 6 standard deviations.
    elsewhere : float
        The same over as many frames of all loads of the study.
    """

    frames: int
    predicted: float
    found: float
    read_right: float
    elsewhere: float


def verified(
    sensor: Sensor,
    working_load: float,
    seed: np.random.SeedSequence,
    frames: int,
    pool: Executor,
) -> Verified:
    """Read noisy frames of a design, on the full mesh, at its worst load and at all loads.

    Parameters
    ----------
    sensor : Sensor
        The design.
    working_load : float
        Largest normal force on a tactel [N].
    seed : SeedSequence
        Seed of the study's loads; the noise has seeds of its own.
    frames : int
        Frames at the worst load, and again over all loads.
    pool : Executor
        Where they are read.
    """
    model = characterize(sensor)
    loads = load_maps(seed, sensor.tactels.count, working_load)
    std = uncertainties(model, loads)
    worst = np.unravel_index(int(np.argmax(std)), std.shape)
    many = np.repeat(loads[[worst[0]]], frames, axis=0)
    all_loads = loads[np.arange(frames) % len(loads)]
    noise = np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, 1)).spawn(2)
    errors, right = _read_all(pool, sensor, many, noise[0])
    _, elsewhere = _read_all(pool, sensor, all_loads, noise[1])
    squares = errors[:, worst[1], worst[2]] ** 2
    return Verified(
        frames, float(std.max()), float(np.sqrt(squares.mean())), right.mean(), elsewhere.mean()
    )


def _read_all(
    pool: Executor, sensor: Sensor, loads: Array, seed: np.random.SeedSequence
) -> tuple[Array, Mask]:
    """Errors (k, n, 2) [N] and whether each frame was read right, (k,)."""
    cuts = range(0, len(loads), BATCH)
    seeds = seed.spawn(len(cuts))
    batches = [
        (sensor, loads[cut : cut + BATCH], one) for cut, one in zip(cuts, seeds, strict=True)
    ]
    errors, right = zip(*gathered(pool, _read_batch, batches), strict=True)
    return np.concatenate(errors), np.concatenate(right)


def _read_batch(sensor: Sensor, loads: Array, seed: np.random.SeedSequence) -> tuple[Array, Mask]:
    model = characterize(sensor)
    reader, rng = Reader(model), np.random.default_rng(seed)
    readings = [reader.search(model.expose(load, rng=rng)) for load in loads]
    errors = np.array([reading.forces for reading in readings]) - loads
    std = np.array([reading.std for reading in readings])
    sound = np.array([reading.status is Status.OK for reading in readings])
    return errors, sound & (np.abs(errors) < DEVIATIONS * std).all(axis=(1, 2))
