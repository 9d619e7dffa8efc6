"""Terms of a sensor's relaxation from a recording under known loads: pressed, held, released.

Each frame is read as if it were alone.  The whole normal force that it shows is u + sum_k c_k z_k
of the known one u, with the lags z_k of `models.creep`, times a gain that is nearly one, and with
lags at the first frame that nobody knows, and, of a log by time, its delay.  As many terms are
taken as the evidence supports.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import OptimizeResult, least_squares

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import InputError
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.delay import coarse_delay
from fringeforce.calibration.load_log import LoadLog
from fringeforce.contacts.loads import checked_loads
from fringeforce.contacts.resultant import touch
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import Tolerances
from fringeforce.models.creep import Creep, checked_times
from fringeforce.models.design_modes import RELAXATION
from fringeforce.models.pad import PadModel
from fringeforce.models.presses import Presses, are_presses
from fringeforce.models.strip import SensorModel
from fringeforce.reading.reader import Reader

AnyModel = TypeVar("AnyModel", SensorModel, PadModel)

GAIN = 0.05
"""Standard deviation of the gain between loads as read and as known: what a calibration leaves."""
HISTORY = 0.1
"""Standard deviation of loads that acted for long before, over the largest load of the recording,
which begins with a strip at rest."""
WIDEST = 3.0
"""Standard deviations that a term has to be away from none, as designs demand of tolerances."""
TERMS = 3
"""Most terms that are tried."""
FEW = 20
"""Readings below which no term can be told."""
MOST = 100
"""Steps of a fit; those that take more run along a term that is not there."""
SHIFTS = (0.0, -0.2, 0.2)
"""Shifts of times that are evenly spread over the logarithm of all lengths, over its range."""
WEAK = 0.1
"""Share of the largest load below which a frame is left out."""
SPARE = 0.9
"""Largest sum of shares."""


def find_relaxation(
    model: AnyModel,
    frames: ArrayLike,
    loads: ArrayLike | Presses | BenchLoads | LoadLog,
    times: ArrayLike,
) -> AnyModel:
    """Find the Prony terms of a sensor's relaxation from frames under known loads.

    Parameters
    ----------
    model : SensorModel or PadModel
        As drawn or calibrated, of a strip or pad with tactels or a skin; what its design says of
        relaxation is left aside.
    frames : array_like, shape (F, ...) as frames
        Grey levels of a recording that begins with a sensor at rest, and in which loads are
        pressed, held for as long as creep matters, and released.
    loads : array_like, shape (F, n, components), presses of each frame, BenchLoads or LoadLog
        Forces that acted, linear from one frame to the next [N]; of tactels, by place, or a log by
        time, whose constant delay is found.
    times : array_like, shape (F,)
        When the frames were exposed [s].

    Returns
    -------
    SensorModel or PadModel
        Whose design states the terms, each with its standard deviation; none if the recording does
        not support any.

    Raises
    ------
    InputError
        If frames, loads and times do not fit each other, too few frames can be read, or the phase
        does not creep by the stress-optic law.

    Examples
    --------
    >>> soft = ff.load_sensor("saad").replace(**{"transducer.relaxation": [["8 %", "3 s"]]})
    >>> times, loads = np.arange(0, 30, 0.5), np.zeros((60, 11, 2))
    >>> loads[4:40, 5, 0] = 2.0
    >>> frames = ff.characterize(soft).expose(loads, rng=0, times=times)
    >>> drawn = ff.characterize(ff.load_sensor("saad"))
    >>> found = ff.find_relaxation(drawn, frames, loads, times)
    >>> [round(term.share, 2) for term in found.sensor.transducer.relaxation]
    [0.08]
    """
    if model.sensor.transducer.photoelastic.effect == "stress_optic_coefficient":
        raise InputError(
            "By the stress-optic law the phase of layers that relax alike does not creep; state a "
            "strain_optic_coefficient."
        )
    one, other = model.sensor.transducer.relaxations
    if one != other or model.sensor.transducer.photoelastic.optical_creep:
        raise InputError(
            "Recordings tell terms of both layers together; leave relaxation and optical_creep out "
            "of the tables of the layers."
        )
    elastic = _with_terms(model, np.empty((0, 2)), np.empty((0, 2)))
    levels = np.asarray(frames)
    when = checked_times(times, len(levels))
    totals, delayed = _totals(loads, model.sensor, levels, when)
    applied = totals(0.0)
    if len(levels) != len(applied):
        raise InputError(f"{len(levels)} frames do not fit loads of {len(applied)}.")
    shown, deviation, usable = _read(elastic, levels)
    # where hardly a fringe shows, readings in a row share their errors
    usable &= np.abs(applied) > WEAK * np.abs(applied).max()
    if usable.sum() < FEW:
        raise InputError(
            f"{usable.sum()} of {len(usable)} frames can be read, and terms take {FEW}; check the "
            "recording with fringeforce read."
        )
    best, size, count = np.inf, int(usable.sum()), 0
    terms = np.empty((0, 2)), np.empty((0, 2))
    while count <= TERMS:
        fit = _Fit(when, totals, delayed, shown, deviation, usable, count).best()
        values, stds = _terms(fit, count, size)
        if _criterion(fit, size) > best or (values < WIDEST * stds).any():
            break
        best, terms, count = _criterion(fit, size), (values, stds), count + 1
    return _with_terms(model, *terms)


def _read(model: SensorModel | PadModel, levels: Array) -> tuple[Array, Array, Mask]:
    """Whole normal forces that frames show, their deviations [N], and whether they are OK."""
    shown, variance = np.zeros(len(levels)), np.ones(len(levels))
    usable = np.zeros(len(levels), dtype=bool)
    for row, reading in enumerate(Reader(model).stream(levels)):
        if not reading.ok:
            continue
        usable[row] = True
        if model.sensor.dimensions == 1 and model.sensor.skin is None:
            shown[row], variance[row] = (
                reading.forces[:, 0].sum(),
                reading.covariance[::2, ::2].sum(),
            )
        else:  # the sum over a pad is far less certain than what presses on it
            total = touch(model.sensor, reading).total
            shown[row], variance[row] = total.force[0], total.force_covariance[0, 0]
    return shown, np.sqrt(np.maximum(variance, 1e-12)), usable


def _totals(
    loads: ArrayLike | Presses | BenchLoads | LoadLog,
    sensor: Sensor | Pad,
    levels: Array,
    times: Array,
) -> tuple[Callable[[float], Array], float]:
    """Whole normal forces of frames by what is left of a delay, and its deviation [s]."""
    if isinstance(loads, LoadLog):
        log, coarse = loads, coarse_delay(loads, times, levels)
        normal = np.nansum(log.forces[..., 0], axis=1)
        log.at(times, coarse)  # refuses frames beyond it
        step = float(np.median(np.diff(times)))
        return lambda delay: np.interp(times + coarse + delay, log.times, normal), step
    if isinstance(loads, BenchLoads):
        normal = np.nansum(loads.forces[..., 0], axis=1)
    elif are_presses(loads):
        if not all(isinstance(frame, list | tuple) for frame in loads):
            raise InputError("Presses of one frame do not fit; give a list of presses for each.")
        normal = np.array([sum(one.normal for one in frame) for frame in loads])
    else:
        shape = sensor.tactels.total, len(sensor.components)
        forces = checked_loads(cast(ArrayLike, loads), *shape)
        normal = forces[..., 0].sum(axis=1)
    return lambda _: normal, 0.0


class _Fit:
    """Least squares of so many terms.

    Unknown are the logarithms of shares and times, the deviation of the gain from one over its
    standard deviation, each lag at the first frame over its own, and what
    is left of the delay of a log over the time between frames.
    """

    def __init__(
        self,
        times: Array,
        totals: Callable[[float], Array],
        delayed: float,
        shown: Array,
        deviation: Array,
        usable: Array,
        count: int,
    ) -> None:
        self.times, self.totals, self.delayed, self.count = times, totals, delayed, count
        self.shown, self.deviation, self.usable = shown, deviation, usable
        self.largest = float(np.abs(totals(0.0)).max())
        steps = np.diff(times)
        # what is slower than the recording is long is a part of the gain
        self.range = float(steps[steps > 0].min()), float(times[-1] - times[0])

    def __call__(self, unknowns: Array) -> Array:
        count = self.count
        shares, lasting = np.exp(unknowns[: 2 * count].reshape(2, count))
        shares = shares * min(1.0, SPARE / max(shares.sum(), 1e-12))
        creep, gain = Creep.retarding(shares, lasting), unknowns[2 * count]
        lags = HISTORY * self.largest * unknowns[2 * count + 1 : 3 * count + 1]
        applied = self.totals(self.delayed * unknowns[-1] if self.delayed else 0.0)
        faded = np.exp(-np.outer(self.times - self.times[0], creep.rates)) * lags
        model = applied + creep.added(self.times, applied) + faded @ creep.amounts
        left = ((1 + GAIN * gain) * model - self.shown) / self.deviation
        return np.concatenate([left[self.usable], unknowns[2 * count :]])

    def best(self) -> OptimizeResult:
        """The best fit from times of all lengths."""
        low, high = np.log(self.range)
        within = (np.arange(self.count) + 0.5) / max(self.count, 1)
        starts = [low + (high - low) * np.clip(within + by, 0.02, 0.98) for by in SHIFTS]
        size = 3 * self.count + 1 + bool(self.delayed)
        bounds = np.full((2, size), [[-np.inf], [np.inf]])
        bounds[0, : self.count], bounds[1, : self.count] = np.log(1e-5), np.log(SPARE)
        bounds[0, self.count : 2 * self.count] = low
        bounds[1, self.count : 2 * self.count] = high
        found = []
        for start in starts:
            unknowns = np.zeros(size)
            unknowns[: self.count], unknowns[self.count : 2 * self.count] = np.log(0.03), start
            found.append(least_squares(self, unknowns, bounds=bounds, x_scale="jac", max_nfev=MOST))
        return min(found, key=lambda one: one.cost)


def _criterion(fit: OptimizeResult, frames: int) -> float:
    """Bayesian information criterion (Schwarz, Ann. Statist. 6, 461, 1978)."""
    return 2 * fit.cost + len(fit.x) * np.log(frames)


def _terms(fit: OptimizeResult, count: int, frames: int) -> tuple[Array, Array]:
    """Shares and times, shape (count, 2), and their standard deviations."""
    excess = max(2 * fit.cost / max(frames - len(fit.x), 1), 1.0)
    covariance = excess * np.linalg.pinv(fit.jac.T @ fit.jac, hermitian=True)
    values = np.exp(fit.x[: 2 * count])
    stds = values * np.sqrt(np.diag(covariance)[: 2 * count])
    order = np.argsort(values[count:])
    return values.reshape(2, count).T[order], stds.reshape(2, count).T[order]


def _with_terms(model: AnyModel, terms: Array, stds: Array) -> AnyModel:
    """The model with these terms in the place of its own."""
    sensor = model.sensor.replace(
        **{"transducer.compliant.relaxation": (), "transducer.photoelastic.relaxation": ()},
        **{"transducer.relaxation": [list(map(float, t)) for t in terms]},
    )
    stated = {
        f"{RELAXATION}{number}.{name}": float(std)
        for number, row in enumerate(stds)
        for name, std in zip(("share", "time"), row, strict=True)
    }
    kept = {p: std for p, std in sensor.tolerances.items() if not p.startswith(RELAXATION)}
    tolerances = Tolerances({**kept, **stated})
    return replace(model, sensor=sensor.model_copy(update={"tolerances": tolerances}))
