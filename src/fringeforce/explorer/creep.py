"""A strip that creeps is pressed, held and released: its light, and what readings make of it."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.design.strip import Transducer
from fringeforce.explorer.protocol import CreepRequest
from fringeforce.explorer.tasks import Answer, model_of

if TYPE_CHECKING:
    from fringeforce.models.strip import SensorModel
    from fringeforce.reading.batch import Batch
    from fringeforce.reading.reader import Reader

STEPS = 40
"""Moments of the hold, and of the rest behind it."""
SOONEST = 0.1
"""First of them, over the shortest time of the terms; the load rises and falls for as long."""
LASTS = 4.0
"""Hold, over the longest time of the terms, where it is not asked for: 2 % is still to come."""


def over_time(path: str, wish: CreepRequest) -> Answer:
    """Phases, and forces read with and without what the design says of creep, of a held load.

    Raises
    ------
    InputError
        If the strip does not creep, or the hold is shorter than the first moment behind it.
    """
    return _read(path, np.asarray(wish.forces, dtype=float).tobytes(), wish.held, wish.seed)


@lru_cache(maxsize=8)  # a page that is loaded again, or steps back, asks for the same
def _read(path: str, loads: bytes, held: float, seed: int) -> Answer:
    """`over_time`, of a load by its bytes, which are hashable."""
    model: SensorModel = model_of(path)
    first, held = _limits(model.sensor.transducer, held)
    times, acts = moments(first, held)
    forces = acts[:, None, None] * np.frombuffer(loads).reshape(-1, 2)
    plain, knowing = _readers(path)
    phase = model.loaded_phase(forces, times=times)
    frames = model.expose(forces, rng=seed, times=times)
    plain.reset()
    knowing.reset()
    found = {
        "without": plain.read_on(frames, covariance=True),
        "with": knowing.read_on(
            frames, covariance=True, times=times if knowing.needs_times else None
        ),
    }
    blocks = {"times": times, "acts": acts, "phase": phase, "true": forces.sum(axis=1)}
    for way, batch in found.items():
        sums, deviations = _together(batch)
        blocks |= {f"{way}_read": sums, f"{way}_std": deviations}
    told = {way: [status.name for status in batch.status] for way, batch in found.items()}
    return {"first": first, "held": held, "steps": STEPS, "status": told}, blocks


def moments(first: float, held: float) -> tuple[Array, Array]:
    """Times of a press, a hold and a rest as long, and the share of the load that acts.

    Time runs evenly on its logarithm, from the end of the press and from that of the release.

    Parameters
    ----------
    first, held : float
        First moment behind either, and last one [s].

    Returns
    -------
    times, acts : ndarray, shape (2 STEPS + 3,)
        [s] from the last moment before the press; 0 there, then 1, then 0 from the release on.
    """
    since = np.concatenate([[0.0], np.geomspace(first, held, STEPS)])
    pressed, released = first + since, 2 * first + held + since
    acts = np.repeat([0.0, 1.0, 0.0], [1, len(since), len(since)])
    return np.concatenate([[0.0], pressed, released]), acts


def _limits(transducer: Transducer, held: float) -> tuple[float, float]:
    """First moment and length of the hold [s]."""
    terms = (*sum(transducer.relaxations, ()), *transducer.photoelastic.optical_creep)
    if not terms:
        raise InputError("This strip does not creep; give it a relaxation.")
    times = [term.time for term in terms]
    first = SOONEST * min(times)
    held = held or LASTS * max(times)
    if held <= 2 * first:
        raise InputError(f"Hold for more than {2 * first:g} s, the time of press and release.")
    return first, held


def _together(batch: Batch) -> tuple[Array, Array]:
    """Forces of all tactels together and their deviations, shape (F, 2) [N]; NaN where refused."""
    usable = np.array([status.usable for status in batch.status])
    sums = np.where(usable[:, None], batch.forces.sum(axis=1), np.nan)
    assert batch.covariance is not None
    count = batch.forces.shape[1]
    whole = batch.covariance.reshape(-1, count, 2, count, 2)
    return sums, np.sqrt(np.einsum("figjg->fg", whole))


@lru_cache(maxsize=2)
def _readers(path: str) -> tuple[Reader, Reader]:
    """Readers that know nothing of creep, and all that the design says."""
    from fringeforce.models.creep import without_creep
    from fringeforce.reading.reader import Reader

    model = model_of(path)
    return Reader(replace(model, sensor=without_creep(model.sensor))), Reader(model)
