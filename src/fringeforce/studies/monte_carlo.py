"""How large loads may grow before a way of reading fails, by trying."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.estimation.phase.noise_free import recover_phase
from fringeforce.models.strip import SensorModel
from fringeforce.reading.reader import Reader
from fringeforce.reading.reading import Status
from fringeforce.studies.limits import NYQUIST, densest_fringes, largest_phase

Load = Callable[[np.random.Generator, int, float], Array]
Judge = Callable[[np.random.Generator, float], bool]

DEVIATIONS = 6.0
"""Standard deviations within which every force of a reading must lie to be right."""
PHASE_TOLERANCE = 0.01
"""Error of a recovered noise-free phase that still counts as right [rad]."""
WANTED = 0.99
"""Share of readings that must be right."""
STEP, FINEST = 2.0, 1.1
"""Factor from load to load on the way up, and between the brackets at the end."""


def reader_judge(model: SensorModel, load: Load) -> Judge:
    """Whether our reader reads one random noisy frame right, with the verdict OK."""
    reader, n = Reader(model), model.sensor.tactels.count

    def right(rng: np.random.Generator, largest: float) -> bool:
        forces = load(rng, n, largest)
        reading = reader.search(model.expose(forces, rng=rng))
        off = np.abs(reading.forces - forces)
        return reading.status is Status.OK and bool((off < DEVIATIONS * reading.std).all())

    return right


def paper_judge(model: SensorModel, load: Load, sign_by_contact: bool = True) -> Judge:
    """Whether equation (12) with m = n = 0 recovers one random noise-free phase.

    Where the phase starts above zero it finds -p throughout; with `sign_by_contact` that counts as
    right, because the sum of the pushes then tells the sign.
    """
    n = model.sensor.tactels.count

    def right(rng: np.random.Generator, largest: float) -> bool:
        forces = load(rng, n, largest)
        phase = model.phase(forces)
        found = recover_phase(model.intensity(forces))
        errors = [np.abs(found - phase).max()]
        if sign_by_contact:
            errors.append(np.abs(found + phase).max())
        return bool(min(errors) < PHASE_TOLERANCE)

    return right


def share_right(judge: Judge, largest: float, count: int, seed: int = 0) -> float:
    """Share of random loads that are judged right; the same draws at every size of load."""
    return float(np.mean([judge(rng, largest) for rng in _generators(seed, count)]))


def shares_right(judge: Judge, loads: ArrayLike, count: int, seed: int = 0) -> Array:
    """`share_right` at several largest loads, shape (k,)."""
    return np.array([share_right(judge, load, count, seed) for load in np.atleast_1d(loads)])


def reading_limit(
    judge: Judge,
    start: float,
    stop: float,
    count: int,
    seed: int = 0,
) -> float:
    """Largest load at which at least 99 % of random loads are judged right.

    Loads double from the start until a level fails, then the bracket is halved geometrically to
    10 %; every level below that was tried has passed.

    Parameters
    ----------
    judge : callable
        Judges one random load of a given size.
    start, stop : float
        Smallest and largest load that are tried [N].
    count : int
        Random loads at every level.
    seed : int
        Seed of loads and noise.

    Returns
    -------
    float
        Load [N]; zero if the start fails, `stop` if nothing up to it does.
    """
    good, bad = 0.0, start
    while _passes(judge, bad, count, seed):
        good, bad = bad, min(bad * STEP, stop)
        if good >= stop:
            return stop
    if good == 0:
        return 0.0
    while bad / good > FINEST:
        middle = float(np.sqrt(good * bad))
        good, bad = (middle, bad) if _passes(judge, middle, count, seed) else (good, middle)
    return good


def bracket(model: SensorModel) -> tuple[float, float]:
    """Loads between which a reading limit is sought [N].

    From where the phase can span half a fringe, so that it has a sign and a start, to where the
    worst load has twice as many fringes as the camera resolves.
    """
    peak = largest_phase(model.pixel_influence).max()
    return float(np.pi / peak), float(2 * NYQUIST / densest_fringes(model))


def _passes(judge: Judge, largest: float, count: int, seed: int) -> bool:
    """Whether enough loads are right, without trying more once too many are wrong."""
    allowed = (1 - WANTED) * count + 1e-9
    wrong = 0
    for rng in _generators(seed, count):
        wrong += not judge(rng, largest)
        if wrong > allowed:
            return False
    return True


def _generators(seed: int, count: int) -> list[np.random.Generator]:
    return [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(count)]
