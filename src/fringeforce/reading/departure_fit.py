"""One departure and one frame: by how much a sensor departs, and how well that explains the frame.

Loads and size start from a phase, so that orders are right.  A departure of one number is followed
by Newton steps of its profile posterior, with the loads at their best; one of many numbers adds its
unknowns to the others.  Either ends with Laplace's approximation of the posterior mass.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.frame_climb import CONVERGED, climb
from fringeforce.estimation.frame_exposure import (
    expose,
    node_columns,
    node_phase,
)
from fringeforce.estimation.frame_model import (
    FrameModel,
)
from fringeforce.estimation.linearised_frame import Linearised, linearise
from fringeforce.estimation.posterior import Posterior, Top
from fringeforce.models.departures import Departure, plain_moments

Array = NDArray[np.float64]

STD_STEP = 0.02
"""Step of numerical derivatives, in standard deviations of a departure."""
PHASE_ERROR = 0.05
"""Standard deviation of the phase from which loads are found [rad]."""
PHASE_SAMPLES = 512
"""Pixels at which phases are compared."""
PHASE_STEPS, SIZE_STEPS = 6, 10
"""Steps of loads and size from a phase, and of the size in the frame; it takes four."""
FARTHEST_STEP = 2.0
"""Longest step of a size, in its standard deviations; in a frame a size may also double."""
LEAST_INFORMATION = 1e-2
"""Information about a size that a step from a phase has at least."""
HEAT = 30.0
"""Factor on the noise at which the climb from a phase begins."""
INFORMATION_REACH, FARTHEST_INFORMATION = 2.0, 0.3
"""Standard deviations about a size in which its information is measured: of it, and before a
frame."""
SIZE_ERROR = 0.1
"""Share of its standard deviation to which a size is found."""
WORTH = 1e-3
"""Fall of the loss that is worth a step."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A departure as a frame shows it.

    Attributes
    ----------
    departure : Departure
        What departs.
    size, std : float
        By how much, root mean square if it is many numbers, and its standard deviation.
    significance : float
        Standard deviations between this and the design.
    evidence : float
        Logarithm of the posterior mass, less a constant of the frame.
    posterior : Posterior
        With the departure.
    top : Top
        Where it is largest.
    """

    departure: Departure
    size: float
    std: float
    significance: float
    evidence: float
    posterior: Posterior
    top: Top

    def near(self, chi2: float) -> bool:
        """Whether the reduced chi-square is smaller than so much."""
        return self.top.square < chi2 * self.top.count

    def explains(self, chance: float) -> bool:
        """Whether noise leaves as much as this does, with some chance."""
        if self.top.chance < chance:
            return False
        return self.posterior.waves_chance(self.top) > chance


class DepartureFit(Protocol):
    """A departure that is being fitted: roughly first, then to its best."""

    top: Top

    def finish(self) -> Fit:
        """Climb to the top."""
        ...


def begin(posterior: Posterior, departure: Departure, phase: Array) -> DepartureFit:
    """Start to fit a departure.

    Parameters
    ----------
    posterior : Posterior
        Of the frame, with what the design states.
    departure : Departure
        What may depart.
    phase : ndarray, shape (m,)
        Phase lead at the nodes that explains the frame, at least nearly [rad].
    """
    if departure.one is None:
        return _Many(posterior, departure, phase)
    starts = [_One(posterior, departure, phase, first) for first in departure.begins]
    return min(starts, key=lambda fit: fit.loss)


class _Step(NamedTuple):
    """Newton step of a size: its length, how loads follow, and its information."""

    length: float
    follow: Array
    information: float


class _One:
    """A departure of one number, in units of its standard deviation."""

    def __init__(
        self, posterior: Posterior, departure: Departure, phase: Array, first: float
    ) -> None:
        self.posterior, self.departure = posterior, departure
        low, high = departure.limits
        self.limits = low / departure.deviation, high / departure.deviation
        begin = first / departure.deviation
        unknowns, self.size = self._from_phase(phase, begin)
        if self.size == begin:
            self.size = self._clipped(begin + self._from_light(unknowns))
        self.model = self._model(self.size)
        prior, frame = posterior.prior, posterior.frame
        unknowns = climb(self.model, prior, frame, unknowns, HEAT, 4, 0.5)[0]
        self.top = Top(*climb(self.model, prior, frame, unknowns, 1.0, 8, CONVERGED))
        self._improve(1)

    @property
    def loss(self) -> float:
        """Loss of the frame and the size."""
        return self.top.loss + self.size**2

    def finish(self) -> Fit:
        """Climb to the top."""
        self._improve(SIZE_STEPS)
        own, information = self.departure.deviation, self._information()
        posterior = Posterior(self.model, self.posterior.prior, self.posterior.frame)
        mass = posterior.evidence(self.top, posterior.linearised(self.top))
        std = 1 / np.sqrt(information)
        return Fit(
            self.departure,
            self.size * own,
            std * own,
            abs(self.size) / std,
            mass - self.size**2 / 2 + float(np.log(std)),
            posterior,
            self.top,
        )

    def _model(self, size: float) -> FrameModel:
        assert self.departure.one is not None
        changed = self.departure.one(self.posterior.model, size * self.departure.deviation)
        return plain_moments(changed)

    def _clipped(self, size: float) -> float:
        return float(np.clip(size, *self.limits))

    def _around(self, size: float) -> tuple[FrameModel, FrameModel, float]:
        """Models a little below and above, and how far apart they are."""
        low, high = self._clipped(size - STD_STEP), self._clipped(size + STD_STEP)
        return self._model(low), self._model(high), high - low

    def _from_phase(self, phase: Array, size: float) -> tuple[Array, float]:
        """Loads and size that explain a phase."""
        base, prior = self.posterior.model, self.posterior.prior
        samples = _samples(base)
        wanted, unknowns = _seen(base, phase, samples), np.zeros(base.at.size)
        # a phase says nothing about the light: the size of that stays where it begins
        known = np.append(prior.precision, LEAST_INFORMATION)
        for round_ in range(PHASE_STEPS):
            model, (low, high, step) = self._model(size), self._around(size)
            ends = [_seen(end, node_phase(end, unknowns), samples) for end in (low, high)]
            loads = _columns(model, unknowns, samples)
            rows = np.vstack([loads, (ends[1] - ends[0]) / step])
            left = wanted - _seen(model, node_phase(model, unknowns), samples)
            off = np.append(unknowns - prior.mean, 0.0)
            change = _step_to(rows, left, known, off, model.at.loads)
            unknowns = unknowns + change[:-1]
            before, size = size, self._clipped(size + float(change[-1]))
            if round_ and abs(size - before) < WORTH:
                break
        return unknowns, size

    def _from_light(self, unknowns: Array) -> float:
        """Step of a size that moves no phase, with the loads held: loads would imitate it."""
        frame, (low, high, apart) = self.posterior.frame, self._around(self.size)
        dark, bright = (expose(end, unknowns)[0] for end in (low, high))
        change, left = (bright - dark) / apart, frame - (bright + dark) / 2
        weights = np.isfinite(frame) / self.posterior.model.variance
        told = (weights * change * np.nan_to_num(left)).sum()
        return float(told / ((weights * change**2).sum() + 1.0))

    def _improve(self, rounds: int) -> None:
        """Newton steps of the size, each shortened until the loss falls."""
        prior, frame = self.posterior.prior, self.posterior.frame
        for _ in range(rounds):
            step = self._step()
            # far from any top the loss is not quadratic, and tells of a blur of metres
            farthest = max(FARTHEST_STEP, abs(self.size))
            length = float(np.clip(step.length, -farthest, farthest))
            if abs(length) < SIZE_ERROR / np.sqrt(step.information):
                return
            for _ in range(5):
                size = self._clipped(self.size + length)
                model = self._model(size)
                start = self.top.unknowns - step.follow * (size - self.size)
                top = Top(*climb(model, prior, frame, start, 1.0, 6, CONVERGED))
                if top.loss + size**2 < self.loss - WORTH:
                    break
                length /= 3
            else:
                return
            self.size, self.model, self.top = size, model, top

    def _information(self) -> float:
        """About the size, with the loads following, from the loss on both sides of it."""
        reach = min(INFORMATION_REACH / np.sqrt(self._step().information), FARTHEST_INFORMATION)
        sides = np.array([self._clipped(self.size + side * reach) for side in (-1, 1)]) - self.size
        prior, frame = self.posterior.prior, self.posterior.frame
        rise = 0.0
        for side in sides:
            model = self._model(self.size + side)
            rise += climb(model, prior, frame, self.top.unknowns, 1.0, 10, 0.01)[1] - self.top.loss
        return max(rise / max(float(sides @ sides), 1e-12), 0.0) + 1.0

    def _step(self) -> _Step:
        prior, frame, unknowns = self.posterior.prior, self.posterior.frame, self.top.unknowns
        low, high, apart = self._around(self.size)
        seen = np.isfinite(frame)
        below, above = (climb(end, prior, frame, unknowns, 1.0, 0, 0.0)[1] for end in (low, high))
        gradient = (above - below) / (2 * apart) + self.size
        dark, bright = (expose(end, unknowns)[0] for end in (low, high))
        change = (bright - dark) / apart
        about = Linearised(*linearise(self.model, prior, frame, unknowns))
        first, last = (
            Linearised(*linearise(end, prior, frame, unknowns)).gradient for end in (low, high)
        )
        cross = (last - first) / apart
        follow = np.asarray(np.linalg.solve(about.hessian + about.cone, cross), dtype=float)
        told = (np.square(change) / self.model.variance)[seen].sum()
        information = told + 1.0 - cross @ follow
        information = max(float(information), 1.0)
        return _Step(-float(gradient - follow @ about.gradient) / information, follow, information)


class _Many:
    """A departure of many numbers, each of which is an unknown."""

    def __init__(self, posterior: Posterior, departure: Departure, phase: Array) -> None:
        assert departure.own is not None
        self.departure = departure
        model, self.where, self.profiles = departure.own(posterior.model)
        model = plain_moments(model)
        stated = np.ones(model.at.size, dtype=bool)
        if model.at.size > posterior.model.at.size:  # otherwise its tolerances are widened
            stated[self.where] = False
        precision, mean = np.ones(model.at.size), np.zeros(model.at.size)
        precision[stated], mean[stated] = posterior.prior.precision, posterior.prior.mean
        prior = posterior.prior._replace(mean=mean, precision=precision)
        self.posterior = Posterior(model, prior, posterior.frame)
        self.top = self.posterior.climbed(
            self._from_phase(phase), heats=(HEAT, HEAT / 6), steps=(6, 4)
        )

    @property
    def loss(self) -> float:
        """Loss of the frame and all unknowns."""
        return self.top.loss

    def finish(self) -> Fit:
        """Climb to the top."""
        posterior, where = self.posterior, self.where
        self.top = top = posterior.climbed(self.top.unknowns, heats=(), steps=(0, 20))
        about, own = posterior.linearised(top), top.unknowns[where]
        covariance = np.linalg.inv(about.hessian)[np.ix_(where, where)]
        square = float(own @ np.linalg.solve(covariance, own))
        # the normal deviate of a chi-square number (Fisher)
        significance = np.sqrt(2 * square) - np.sqrt(2 * len(own) - 1)
        spread = np.einsum("kq,kl,lq->q", self.profiles, covariance, self.profiles)
        return Fit(
            self.departure,
            float(np.sqrt(np.mean(np.square(own @ self.profiles)))),
            float(np.sqrt(spread.mean())),
            max(float(significance), 0.0),
            posterior.evidence(top, about),
            posterior,
            top,
        )

    def _from_phase(self, phase: Array) -> Array:
        posterior = self.posterior
        model, prior = posterior.model, posterior.prior
        samples, unknowns = _samples(model), np.zeros(model.at.size)
        wanted = _seen(model, phase, samples)
        for _ in range(PHASE_STEPS):
            rows = _columns(model, unknowns, samples)
            left = wanted - _seen(model, node_phase(model, unknowns), samples)
            off = unknowns - prior.mean
            unknowns = unknowns + _step_to(rows, left, prior.precision, off, model.at.loads)
        return unknowns


def _samples(model: FrameModel) -> NDArray[np.intp]:
    """Pixels of one channel, evenly spaced."""
    count = len(model.amplitude) // len(model.bias)
    return np.unique(np.linspace(0, count - 1, min(count, PHASE_SAMPLES)).astype(np.intp))


def _seen(model: FrameModel, nodes: Array, pixels: NDArray[np.intp]) -> Array:
    """What pixels see of lines at the nodes, shape (..., m)."""
    first, weights = model.first[pixels], model.weights[pixels]
    return np.asarray(sum(nodes[..., first + t] * weights[:, t] for t in range(4)))


def _columns(model: FrameModel, unknowns: Array, pixels: NDArray[np.intp]) -> Array:
    """Change of the phase at pixels with every unknown."""
    return _seen(model, node_columns(model, unknowns), pixels)


def _step_to(rows: Array, left: Array, precision: Array, off: Array, loads: int) -> Array:
    """Least squares of a phase with a prior; what follows the loads moves a few deviations."""
    normal = rows @ rows.T / PHASE_ERROR**2 + np.diag(precision)
    wanted = rows @ left / PHASE_ERROR**2 - precision * off
    change = np.asarray(np.linalg.solve(normal, wanted), dtype=np.float64)
    change[loads:] = np.clip(change[loads:], -FARTHEST_STEP, FARTHEST_STEP)
    return change


def distinct(phases: Iterator[Array], near: float) -> Iterator[Array]:
    """Phases that are somewhere farther apart than so much [rad]."""
    known = list[Array]()
    for phase in phases:
        if all(np.abs(phase - other).max() > near for other in known):
            known.append(phase)
            yield phase
