"""How late a log of loads is against frames, without any model of the sensor.

Frames are alike when loads are.  At the right delay the distances between all pairs of frames go
with the distances between their loads: their distance correlation is largest there (G. J. Szekely,
M. L. Rizzo and N. K. Bakirov, Annals of Statistics 35, 2007, equation 2.18), whatever the sensor
makes of a load.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import InputError
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.load_log import REACH, LoadLog

APART = 0.3e-3
"""Standard deviation of the bell that stands for a contact: those further apart than a few of these
have no light in common.  Thinner than covers, for near contacts tell the time best [m]."""
FRAME_POWER, LOAD_POWER = 0.5, 0.25
"""Powers of distances, between 0 and 2 (ibid., section 3.1); small ones let near pairs count, for
frames that differ by more than a fringe all differ alike."""
COMPARED = 400
"""Frames that are compared at most: half evenly spaced, half where most changes."""
INSIDE = 0.5
"""Share of them that must lie within the log at a delay that is tried."""
STEPS = 10
"""Steps of the delay between two frames, at the end."""


def coarse_delay(
    log: LoadLog, frame_times: ArrayLike, frames: NDArray[np.number], most: float = REACH
) -> float:
    """The delay at which frames are alike where loads are.

    Parameters
    ----------
    log : LoadLog
        Loads by time.
    frame_times : array_like, shape (F,)
        When the frames were exposed [s].
    frames : ndarray, shape (F, ...)
        Grey levels.
    most : float
        Largest delay, either way [s].

    Returns
    -------
    float
        By how much the log is later than the frames [s], to about half the time between frames.

    Raises
    ------
    InputError
        If times and frames do not fit, nothing changes in frames or log, or they do not overlap.

    Examples
    --------
    >>> from fringeforce.calibration.delay import coarse_delay
    >>> from fringeforce.calibration.load_log import load_log
    >>> t = np.arange(0, 4, 0.02)
    >>> force = np.where((t > 1) & (t < 2.5), 1.0, 0.0)
    >>> log = load_log(t + 0.35, np.zeros(len(t)), np.stack([force, 0 * force], axis=1))
    >>> frames = force[:, None] * [10.0, 80.0, 30.0]
    >>> round(coarse_delay(log, t, frames), 2)
    0.35
    """
    times = np.asarray(frame_times, dtype=float)
    grey = np.asarray(frames, dtype=float).reshape(len(frames), -1)
    if times.shape != (len(grey),) or len(grey) < 4 or not (np.diff(times) > 0).all():
        raise InputError(
            f"{len(times)} times do not fit {len(grey)} frames; give an ascending one for each of "
            "four frames or more."
        )
    if np.ptp(log.magnitude) == 0 or not np.ptp(grey, axis=0).any():
        raise InputError(
            "Nothing changes in the frames or in the forces of the log, so that no delay can be "
            "found; press and release while both run."
        )
    chosen = _telling(grey)
    times, grey = times[chosen], grey[chosen]
    seen = _distances(grey @ grey.T) ** FRAME_POWER
    step = float(np.median(np.diff(np.asarray(frame_times, dtype=float))))
    tried = np.arange(-np.floor(most / step), np.floor(most / step) + 1) * step
    scores = _scores(log, times, seen, tried)
    if not np.isfinite(scores).any():
        raise InputError(
            f"At no delay up to {most:g} s does the log, from {log.times[0]:.6g} to "
            f"{log.times[-1]:.6g} s, cover the frames from {times[0]:.6g} to {times[-1]:.6g} s; "
            "give times of one clock."
        )
    # as in their test of independence: a press looks like a release where no more is seen
    best = tried[np.nanargmax(scores * [_inside(log, times + delay).mean() for delay in tried])]
    near = best + np.arange(-STEPS, STEPS + 1) * step / STEPS
    near = near[np.abs(near) <= most]
    return float(near[np.nanargmax(_scores(log, times, seen, near))])


def _telling(grey: Array) -> NDArray[np.intp]:
    """Frames to compare, ascending."""
    count = len(grey)
    if count <= COMPARED:
        return np.arange(count)
    changes = np.linalg.norm(np.diff(grey, axis=0), axis=1)
    spread = np.linspace(0, count - 1, COMPARED // 2).astype(np.intp)
    changes[spread[:-1]] = 0
    return np.union1d(spread, np.argsort(changes)[-(COMPARED - len(spread)) :])


def _scores(log: LoadLog, times: Array, seen: Array, delays: Array) -> Array:
    """Distance correlation at every delay; not a number where too little overlaps."""
    found = np.full(len(delays), np.nan)
    for k, delay in enumerate(delays):
        inside = _inside(log, times + delay)
        if inside.mean() < INSIDE:
            continue
        loads = log.at(times[inside], delay)
        a = _centred(seen[np.ix_(inside, inside)])
        b = _centred(_distances(_likeness(loads)) ** LOAD_POWER)
        size = float(np.linalg.norm(a) * np.linalg.norm(b))
        found[k] = float(np.sum(a * b)) / size if size else np.nan
    return found


def _inside(log: LoadLog, times: Array) -> Mask:
    """Which times the log covers."""
    return np.asarray((times >= log.times[0]) & (times <= log.times[-1]))


def _likeness(loads: BenchLoads) -> Array:
    """Inner products of the loads of frames, a bell for each contact, shape (F, F)."""
    count, most = loads.forces.shape[:2]
    forces = np.nan_to_num(loads.forces).reshape(count * most, -1)
    places = np.nan_to_num(loads.places).reshape(count * most, -1)
    apart = np.zeros((count * most,) * 2)
    for axis in places.T:
        apart += np.square(axis[:, None] - axis)
    products = np.exp(-apart / (4 * APART**2)) * (forces @ forces.T)
    return products.reshape(count, most, count, most).sum(axis=(1, 3))


def _distances(products: Array) -> Array:
    """Distances from inner products, less what noise alone makes of the nearest two."""
    own = np.diagonal(products)
    square = np.maximum(own[:, None] + own - 2 * products, 0.0)
    off = ~np.eye(len(square), dtype=bool)
    return np.sqrt(np.where(off, np.maximum(square - square[off].min(), 0.0), 0.0))


def _centred(distances: Array) -> Array:
    """Distances less the means of rows and columns, plus that of all."""
    mean = distances.mean(axis=0)
    return distances - mean - mean[:, None] + mean.mean()
