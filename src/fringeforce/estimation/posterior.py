"""The posterior of one frame: its tops, whether they explain it, their covariances and weights.

A top is a maximum a posteriori estimate of the loads and everything else that is uncertain
(`frame_model`).  Its weight is Laplace's approximation of the posterior mass around it, and the
covariance of the loads is a block of the inverse Hessian, so that everything else is integrated out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, eigh
from scipy.special import chdtrc

from fringeforce.estimation.frame_model import (
    FrameModel,
    Linearised,
    Prior,
    climb,
    contact_columns,
    linearise,
    node_columns,
    node_phase,
)
from fringeforce.estimation.phase.reflections import mirror_images

Array = NDArray[np.float64]

HEATS = (100.0, 10.0)
"""Factors on the variance of the noise from which a climb starts: valleys of place and width that
trap it at 1 are no valleys there.  Without them one climb in four ends in one."""
CAREFUL = (300.0, 100.0, 30.0, 10.0)
"""The same for mirror images, whose starts are farther off."""
WAVES = 60
"""Smooth waves of phase along the frame that are looked for in what is left: shorter than the
clear layer is thick they pass as noise, and no load makes them."""
RANK = 1e-5
"""Share of the largest information below which a wave is absorbed by the unknowns."""
TOUCH = 1.0
"""How near a multiple of pi the phase must come for a stretch to be mirrored there [rad]: more than
for a known model, for place and width bend it by that much."""
SECOND_ORDER = 3
"""Rounds in which the variances of forces, places and widths settle."""


@dataclass(frozen=True, eq=False)
class Top:
    """A maximum of the posterior.

    Attributes
    ----------
    unknowns : ndarray, shape (size,)
        Loads [N] and standardised unknowns.
    loss : float
        Twice the negative logarithm of the posterior, less a constant.
    square, count : float
        Weighted sum of squared residuals in units of the noise, and how many pixels count.
    """

    unknowns: Array
    loss: float
    square: float
    count: float

    @property
    def chance(self) -> float:
        """Chance that noise leaves residuals as large as these."""
        return float(chdtrc(max(self.count, 1.0), self.square))


@dataclass(frozen=True, eq=False)
class Posterior:
    """What one frame and the prior say together.

    Attributes
    ----------
    model : FrameModel
        What makes frames.
    prior : Prior
        What is known before.
    frame : ndarray, shape (P,)
        Grey levels; not finite where a pixel is not used.
    """

    model: FrameModel
    prior: Prior
    frame: Array

    def climbed(
        self,
        start: Array,
        heats: tuple[float, ...] = HEATS,
        steps: tuple[int, int] = (6, 10),
        tolerance: float = 0.1,
        bound: float = np.inf,
    ) -> Top:
        """The top that a start leads to, annealed, with loads that push rather than pull.

        A climb that plainly ends above a bound of the loss may end anywhere above it.
        """
        unknowns, loads = start, self.model.at.loads
        for heat in heats:
            unknowns = climb(
                self.model, self.prior, self.frame, unknowns, heat, steps[0], 0.5, np.inf
            )[0]
        if heats and self.even and unknowns[:loads:2].sum() < 0:
            unknowns = self.mirrored(unknowns)
        return Top(
            *climb(self.model, self.prior, self.frame, unknowns, 1.0, steps[1], tolerance, bound)
        )

    @cached_property
    def even(self) -> bool:
        """Whether loads and residual with the other sign give the same frame."""
        model = self.model
        return bool(np.all(np.abs(np.sin(model.bias)) < 1e-3) and not model.fixed.any())

    def mirrored(self, unknowns: Array) -> Array:
        """The same with the other sign of loads and fields of phase."""
        at, turned = self.model.at, unknowns.copy()
        turned[: at.loads] *= -1
        turned[at.fields : at.modes] *= -1
        return turned

    def linearised(self, top: Top) -> Linearised:
        """The loss about a top."""
        return Linearised(*linearise(self.model, self.prior, self.frame, top.unknowns))

    def waves_chance(self, about: Linearised) -> float:
        """Chance that noise leaves as large waves of phase as there are: a score test.

        The waves are those of the discrete cosine transform; what the unknowns can absorb is taken
        out (Rao, Math. Proc. Camb. Phil. Soc. 44, 50, 1948).
        """
        nodes = len(self.model.fixed)
        along = np.pi * (np.arange(nodes) + 0.5) / nodes
        waves = np.cos(np.outer(np.arange(min(WAVES, nodes)), along))
        cross = shared_information(self.model, about, waves)
        factor = cho_factor(about.hessian + about.cone, check_finite=False)
        solved = cho_solve(factor, cross, check_finite=False)
        score = -waves @ about.pulls[0] + solved.T @ about.gradient
        information = waves @ banded(about, waves).T - cross.T @ solved
        values, vectors = eigh(information, check_finite=False)
        kept = values > RANK * values[-1]
        if not kept.any():
            return 1.0
        normal = (vectors.T @ score)[kept] / np.sqrt(values[kept])
        return float(chdtrc(np.count_nonzero(kept), normal @ normal))

    def covariance(self, top: Top, about: Linearised) -> Array:
        """Covariance of the loads with everything else integrated out, shape (2n, 2n) [N^2]."""
        loads = self.model.at.loads
        return self.spread(top, about)[:loads, :loads]

    def spread(self, top: Top, about: Linearised) -> Array:
        """Covariance of all unknowns, shape (size, size).

        The cone is left out: a force at its border is as uncertain as the frame leaves it.  Beyond
        first order, errors of a force and of its contact's place or width move the phase by their
        product, whose variance is the product of theirs; it is integrated out as well.
        """
        at = self.model.at
        covariance = np.linalg.inv(about.hessian)
        if at.fields == at.place:
            return covariance
        waves, force, partner = products(self.model, top.unknowns)
        cross = shared_information(self.model, about, waves)
        information = waves @ banded(about, waves).T
        for _ in range(SECOND_ORDER):
            variance = np.diag(covariance)
            known = 1 / np.maximum(variance[force] * variance[partner], 1e-30)
            reduced = np.linalg.solve(information + np.diag(known), cross.T)
            covariance = np.linalg.inv(about.hessian - cross @ reduced)
        return covariance

    def evidence(self, top: Top, about: Linearised) -> float:
        """Logarithm of the posterior mass around a top, less a constant (Laplace)."""
        return float(-top.loss / 2 - np.linalg.slogdet(about.hessian)[1] / 2)

    def images(self, top: Top, growth: float) -> list[Array]:
        """Starts from which stretches of the phase are mirrored, the likeliest first."""
        at, model = self.model.at, self.model
        phase = self.phase(top)
        rows = np.arange(at.visibility)
        strength = model.amplitude.mean() * model.visibility / 2
        spacing = len(model.amplitude) / len(phase)
        information = (strength * np.sin(phase)) ** 2 + strength * np.sqrt(model.variance) / 16
        changes, _ = mirror_images(
            phase,
            np.ascontiguousarray(node_columns(model, top.unknowns)[rows].T),
            information / model.variance * spacing,
            self.prior.precision[rows],
            TOUCH,
            growth,
        )
        found = []
        for change in changes:
            start = top.unknowns.copy()
            start[rows] += change
            found.append(self.drawn_in(start))
        return found

    def drawn_in(self, unknowns: Array) -> Array:
        """A start with places and widths nearer to their means, which a climb leaves more easily."""
        at, start = self.model.at, unknowns.copy()
        start[at.place : at.fields] *= 0.3
        return start

    def phase(self, top: Top) -> Array:
        """Phase at the nodes, shape (m,) [rad]."""
        return node_phase(self.model, top.unknowns)


def products(
    model: FrameModel, unknowns: Array
) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
    """Phase at the nodes by products of the errors of a force and of its contact's place or width.

    Returns
    -------
    waves : ndarray, shape (k, m)
        Phase per unit of the product.
    force, partner : ndarray of int, shape (k,)
        Which unknowns these are.
    """
    at = model.at
    found = contact_columns(model, unknowns)
    own, shared = [], []
    for kind, begin, end in ((0, at.place, at.width), (1, at.width, at.fields)):
        if end > begin:
            own.append(found[kind].reshape(-1, len(model.fixed)))
            shared.append(np.repeat(np.arange(begin, end), 2))
    return np.concatenate(own), np.tile(np.arange(at.loads), len(own)), np.concatenate(shared)


def banded(about: Linearised, waves: Array) -> Array:
    """Information at the nodes times changes of phase there, shape (k, m)."""
    found = about.band[0] * waves
    for step in range(1, len(about.band)):
        line = about.band[step, :-step]
        found[:, :-step] += line * waves[:, step:]
        found[:, step:] += line * waves[:, :-step]
    return found


def shared_information(model: FrameModel, about: Linearised, waves: Array) -> Array:
    """Information that unknowns share with changes of phase at the nodes, shape (size, k)."""
    at, weights = model.at, about.weights
    found = about.columns @ banded(about, waves).T
    found[at.modes : at.visibility] += model.brightness @ (weights[0, 1] * waves).T
    found[at.modes : at.visibility] += model.darkness @ (weights[0, 2] * waves).T
    if at.blur > at.visibility:
        found[at.visibility] = waves @ weights[0, 3]
    if at.size > at.blur:
        found[at.blur] = waves @ weights[0, 4]
    return found
