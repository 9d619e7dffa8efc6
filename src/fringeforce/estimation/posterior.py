"""The posterior of one frame: its tops, whether they explain it, their covariances and weights.

A top is a maximum a posteriori estimate of the loads and everything else that is uncertain
(`frame_model`).  Its weight is Laplace's approximation of the posterior mass around it, and the
covariance of the loads is a block of the inverse Hessian: everything else is integrated out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from fringeforce.estimation.binning import binned, coarsest, seen_means, slow_size
from fringeforce.estimation.contact_propagation import propagated_loads
from fringeforce.estimation.frame_climb import CONVERGED, climb
from fringeforce.estimation.frame_exposure import (
    contact_columns,
    node_columns,
    node_phase,
)
from fringeforce.estimation.frame_information import information
from fringeforce.estimation.frame_loss import Prior, prior_loss
from fringeforce.estimation.frame_model import (
    FrameModel,
    as_seen,
)
from fringeforce.estimation.likelihood import NO_BIAS
from fringeforce.estimation.linearised_frame import (
    Linearised,
    banded,
    linearise,
    pulled_phase,
    shared_information,
    spread_profiles,
)
from fringeforce.estimation.phase_fit import (
    by_coordinates,
    changed,
    contact_coordinates,
    knowing_nothing,
    settled,
    state_of,
)
from fringeforce.estimation.score_test import Score
from fringeforce.estimation.uncertain_contacts import contacts_about
from fringeforce.estimation.uncertain_light import Relit, relit

Array = NDArray[np.float64]

HEATS = (100.0, 10.0)
"""Factors on the variance of the noise from which a climb starts: valleys of place and width that
trap it at 1 are no valleys there.  Without them one climb in four ends in one."""
WAVES = 60
"""Smooth waves of phase along the frame that are looked for in what is left: shorter than the
clear layer is thick they pass as noise, and no load makes them."""
DOUBTED = 0.05
"""Chance of waves below which it is computed from all pixels, for sums at the nodes under a blur
may mistake it: one frame in twenty, so that readings may ask for a chance of 0.02."""
LINEAR_PHASE = 1.0
"""Largest phase of a frame from which it is linear in the phase about its best one [rad]."""
HELD = 1e8
"""Factor on the precision of a force that is held at none."""
PRIOR_ROUNDS = 3
"""Rounds of expectation and maximisation in which the widths of priors settle."""
SETTLING_ROUNDS, HEATED_STEPS, SETTLING_STEPS = 6, 4, 16
"""Rounds in which a start settles, and steps of the contacts in each, heated first and not: valleys
of force, place and width are long, and a top is only one at their lowest place."""
BIN_PHASE = 0.4
"""Phase that a bin may span for as much information as its pixels [rad]."""
DIFFERENCE = 1e-3
"""Step of a place or width for second derivatives, in standard deviations."""
SECOND_ORDER = 3
"""Rounds in which the variances of forces, places, widths and a faint phase settle."""


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
    broken : float
        Expected number of pixels, of those that are not clipped, that show anything at all.
    """

    unknowns: Array
    loss: float
    square: float
    count: float
    broken: float = 0.0

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
    shared : Bins, optional
        Of the sensor, if the model differs from it in its fields and fixed phase alone.
    sound : ndarray, shape (P,), optional
        Grey levels from which bins are made, without broken pixels; `frame` if not given.
    centre : ndarray, shape (2n,), optional
        Loads under which the model's phase is exact, where it has an error of higher order [N];
        none if not given.
    """

    model: FrameModel
    prior: Prior
    frame: Array
    shared: Bins | None = None
    sound: Array | None = None
    centre: Array | None = None

    @cached_property
    def bins(self) -> Bins:
        """Models of the frame in bins."""
        return Bins(self.model) if self.shared is None else self.shared

    def settled(
        self,
        start: Array,
        size: int = 1,
        heats: tuple[float, ...] = (),
        tolerance: float = CONVERGED,
        bound: float = np.inf,
        rounds: int = SETTLING_ROUNDS,
    ) -> Top:
        """The top of a frame in bins of so many pixels that a start of nearly its phase leads to.

        Losses are those of the bins.  Nothing may be known of unknowns together.
        """
        size = min(size, coarsest(self.model))
        model, contacts = self.bins.of(size, self.model)
        plain = knowing_nothing(model)
        found = settled(
            model,
            contacts,
            plain,
            self.prior,
            self._binned(size),
            start,
            np.array(heats),
            rounds,
            HEATED_STEPS if len(heats) else SETTLING_STEPS,
            tolerance,
            bound,
        )
        unknowns, loads = found[0], self.model.at.loads
        if len(heats) and self.even and unknowns[:loads:2].sum() < 0:
            return self.settled(self.mirrored(unknowns), size, (), tolerance, bound)
        return Top(*found)

    def _binned(self, size: int) -> Array:
        if size not in self._frames:
            frame = self.frame if self.sound is None else self.sound
            self._frames[size] = seen_means(frame, size, len(self.model.bias))
        return self._frames[size]

    @cached_property
    def _frames(self) -> dict[int, Array]:
        return {1: self.frame}

    def climbed(
        self,
        start: Array,
        heats: tuple[float, ...] = HEATS,
        steps: tuple[int, int] = (6, 10),
        tolerance: float = CONVERGED,
        bound: float = np.inf,
    ) -> Top:
        """The top that a start leads to, annealed, with loads that push rather than pull.

        A climb that plainly ends above a bound of the loss may end anywhere above it.
        """
        unknowns, loads = start, self.model.at.loads
        for heat in heats:
            unknowns = climb(self.model, self.prior, self.frame, unknowns, heat, steps[0], 0.5)[0]
        if heats and self.even and unknowns[:loads:2].sum() < 0:
            unknowns = self.mirrored(unknowns)
        return Top(
            *climb(self.model, self.prior, self.frame, unknowns, 1.0, steps[1], tolerance, bound)
        )

    def changed(
        self, top: Top, changes: Array, starts: Array, size: int, steps: int
    ) -> tuple[Array, Array]:
        """Unknowns that change the phase of a top most nearly as wanted, as bins of a frame tell.

        Parameters
        ----------
        top : Top
            Where to start.
        changes : ndarray, shape (k, m)
            Of the phase at the nodes [rad].
        starts : ndarray, shape (k, size)
            Unknowns from which they are looked for.
        size : int
            Pixels of a bin.
        steps : int
            Most steps of each fit.

        Returns
        -------
        unknowns : ndarray, shape (k, size)
            The best ones.
        growth : ndarray, shape (k,)
            What the loss grows by if a frame would be as quadratic in the changed phase.
        """
        size = min(size, coarsest(self.model))
        model, contacts = self.bins.of(size, self.model)
        state = state_of(contacts, top.unknowns, model.at.size)
        plain = knowing_nothing(model)
        about = Linearised(*linearise(model, plain, self._binned(size), state))
        pulls = np.ascontiguousarray(shared_information(model, about, changes).T)
        whole = (banded(about, changes) * changes).sum(axis=1)
        found, kept = changed(
            contacts, self.prior, about, state, top.unknowns, pulls, starts, steps
        )
        return found, whole - kept

    @cached_property
    def even(self) -> bool:
        """Whether loads and residual with the other sign give the same frame."""
        model = self.model
        plain = not (model.fixed.any() or model.curvature.any())
        return bool(np.all(np.abs(np.sin(model.bias)) < NO_BIAS) and plain)

    def mirrored(self, unknowns: Array) -> Array:
        """The same with the other sign of loads and fields of phase."""
        at, turned = self.model.at, unknowns.copy()
        turned[: at.loads] *= -1
        turned[at.fields : at.modes] *= -1
        return turned

    @cached_property
    def _abouts(self) -> dict[Top, Linearised]:
        return {}

    @cached_property
    def _spreads(self) -> dict[Top, Array]:
        return {}

    @cached_property
    def _relit(self) -> dict[Top, Relit | None]:
        return {}

    def linearised(self, top: Top) -> Linearised:
        """The loss about a top."""
        if top not in self._abouts:
            about = Linearised(*linearise(self.model, self.prior, self.frame, top.unknowns))
            self._abouts[top] = about
        return self._abouts[top]

    def data_loss(self, top: Top) -> float:
        """What the frame alone adds to the loss of a top."""
        return top.loss - prior_loss(self.prior, self.model.at.loads, top.unknowns, 1.0)

    def under(self, prior: Prior) -> Posterior:
        """The posterior of the same frame under another prior."""
        other = replace(self, prior=prior)
        other._frames.update(self._frames)
        return other

    def waves_chance(self, top: Top) -> float:
        """Chance that noise leaves as large waves of phase as there are: a score test.

        The waves are those of the discrete cosine transform; what the unknowns can absorb is taken
        out (Rao, Math. Proc. Camb. Phil. Soc. 44, 50, 1948).  Sums at the nodes blur waves and
        fringes each by themselves, so that a chance which they may mistake is computed again from
        all pixels.
        """
        about = self.linearised(top)
        waves, loss = _waves(len(self.model.fixed)), about.hessian + about.cone
        pulls, fitted = waves @ pulled_phase(about), about.gradient
        seen = spread_profiles(self.model, top.unknowns, waves)
        cross, own = shared_information(self.model, about, seen), seen @ banded(about, seen).T
        chance = _chance(Score.beside((fitted, loss), cross, (pulls, own)))
        sharp = not self.model.blur and self.model.at.gamma == self.model.at.blur
        if sharp or chance >= DOUBTED:
            return chance
        known, size = information(self.model, self.frame, top.unknowns, waves), len(fitted)
        loss = known[:size, :size] + np.diag(self.prior.precision) + about.cone
        cross, own = known[:size, size:], known[size:, size:]
        return _chance(Score.beside((fitted, loss), cross, (pulls, own)))

    def covariance(self, top: Top) -> Array:
        """Covariance of the loads with everything else integrated out, shape (2n, 2n) [N^2]."""
        loads = self.model.at.loads
        return self.spread(top)[:loads, :loads]

    def spread(self, top: Top) -> Array:
        """Covariance of all unknowns, shape (size, size).

        The cone is left out: a force at its border is as uncertain as the frame leaves it.  To
        second order, errors of a contact's force, place and width move the phase by products of
        two.  These are integrated out as well, with their covariance.  Where the
        phase is faint the fringes hardly change to first order, and what bounds it is their
        curvature: the normal distribution that is nearest to the posterior (Opper and Archambeau,
        Neural Computation 21, 786, 2009) has the expected second derivative of the loss, which is
        B^2 (sin^2 p + 3/2 s^2 cos^2 p) for fringes of amplitude B and a phase of variance s^2.
        """
        if top not in self._spreads:
            self._spreads[top] = self._spread(top)
        return self._spreads[top]

    def _spread(self, top: Top) -> Array:
        at, nodes = self.model.at, len(self.model.fixed)
        waves, one, other = products(self.model, top.unknowns)
        size = sharp(self.model, self.phase(top))
        known = information(
            self.bins.pixels(size, self.model), self._binned(size), top.unknowns, waves
        )
        known[: at.size, : at.size] += np.diag(self.prior.precision)
        phase = self.phase(top)
        faint = np.abs(phase).max() < LINEAR_PHASE
        columns = np.concatenate([node_columns(self.model, top.unknowns), waves])
        curvature = self._curvature(phase) if faint else np.zeros(nodes)
        variance, seen = np.zeros(nodes), as_seen(self.model)
        covariance = np.linalg.inv(known[: at.size, : at.size])
        for _ in range(SECOND_ORDER if faint or len(waves) else 0):
            full = known
            if faint:
                own = (columns[: at.size] * (covariance @ columns[: at.size])).sum(axis=0)
                variance = np.sqrt(variance * own) if variance.any() else own
                full = known + (columns * (1.5 * curvature * variance)) @ columns.T
            before = covariance_of_products(seen @ covariance @ seen.T, one, other)
            cross = full[: at.size, at.size :]
            own = np.eye(len(before)) + before @ full[at.size :, at.size :]
            reduced = np.linalg.solve(own, before @ cross.T)
            covariance = np.linalg.inv(full[: at.size, : at.size] - cross @ reduced)
        return np.asarray(covariance, dtype=float)

    def _curvature(self, phase: Array) -> Array:
        """Squared second derivative of the grey levels around each node, over the noise."""
        model, found = self.model, np.zeros(len(phase))
        seen = np.isfinite(self.frame).reshape(len(model.bias), -1)
        first = model.first[: seen.shape[1]]
        right = model.weights[: seen.shape[1], 2:].sum(axis=1)
        amplitude = model.amplitude.reshape(seen.shape) * model.visibility / 2
        ratio = model.dispersion[:, None]
        bent = ratio**2 * np.cos(ratio * phase + model.bias[:, None])
        bent = model.crosstalk[:, :-1] @ bent if len(model.crosstalk) else bent
        told = np.square(amplitude) * seen / model.variance.reshape(seen.shape)
        for c, own in enumerate(told):
            lumped = np.bincount(first + 1, (1 - right) * own, len(phase))
            lumped += np.bincount(first + 2, right * own, len(phase))
            found += lumped * np.square(bent[c])
        return found

    def propagated(self, top: Top, basis: Array) -> tuple[Array, Array] | None:
        """Mean and covariance of the loads with bent valleys of place and width about a top.

        Parameters
        ----------
        top : Top
            The likeliest one of its phase.
        basis : ndarray, shape (m, r)
            Profiles of influence; see `uncertain_contacts.profile_basis`.

        Returns
        -------
        tuple of ndarray, or None
            If nothing is bent, or the phase so faint that the frame is not linear in it, or if
            normal distributions do not tell the contacts.
        """
        at, model = self.model.at, self.model
        if at.fields == at.place or np.abs(self.phase(top)).max() < LINEAR_PHASE:
            return None
        about, seen = self.linearised(top), as_seen(model)[at.place : at.fields]
        contacts = contacts_about(model, self.prior, top.unknowns, about, basis)
        laplace = seen @ np.linalg.inv(about.hessian) @ seen.T
        loads, z = top.unknowns[: at.loads], top.unknowns[at.place : at.fields]
        for heat in (None, 1.0):
            try:
                return propagated_loads(contacts, z, laplace, loads, heat)
            except np.linalg.LinAlgError:
                continue
        return None

    def relit(self, top: Top) -> Relit | None:
        """What uncertain light does to the loads about a top; none if they hardly go with it."""
        if top not in self._relit:
            size = sharp(self.model, self.phase(top))
            model = self.bins.pixels(size, self.model)
            self._relit[top] = relit(model, self.prior, self._binned(size), top.unknowns)
        return self._relit[top]

    def evidence(self, top: Top, about: Linearised) -> float:
        """Logarithm of the posterior mass around a top, less a constant (Laplace)."""
        return float(-top.loss / 2 - np.linalg.slogdet(about.hessian)[1] / 2)

    def mass(self, top: Top) -> float:
        """Logarithm of the mass around a top if each contact's prior is as wide as its own force.

        That is relevance determination (MacKay, ASHRAE Trans. 100, 1053, 1994; Tipping, J. Mach.
        Learn. Res. 1, 211, 2001): widths have the largest evidence, by expectation and
        maximisation, and a contact that the frame does not ask for ends with none.  A top that
        needs a single contact is so likelier than one that leaves as much of the frame with ten,
        and small forces cost less than large ones.  It is less the same constant as others.
        """
        loads, widest = self.model.at.loads, self.prior.precision
        posterior, about, own = self, self.linearised(top), widest[:0]
        for _ in range(PRIOR_ROUNDS):
            near = np.linalg.inv(about.hessian).diagonal()[:loads]
            square = (np.square(top.unknowns[:loads]) + near) * widest[:loads]
            share = np.clip(square.reshape(-1, 2).mean(axis=1), 1 / HELD, 1.0)
            own = widest[:loads] / np.repeat(share, 2)
            precision = np.concatenate([own, widest[loads:]])
            posterior = self.under(self.prior._replace(precision=precision))
            top = posterior.settled(top.unknowns)
            about = posterior.linearised(top)
        return posterior.evidence(top, about) + float(np.log(own).sum() / 2)

    def without(self) -> Posterior:
        """The posterior if no contact has a force."""
        precision = self.prior.precision.copy()
        precision[: self.model.at.loads] *= HELD
        return self.under(self.prior._replace(precision=precision))

    def drawn_in(self, unknowns: Array) -> Array:
        """A start with places and widths nearer to their means."""
        at, start = self.model.at, unknowns.copy()
        start[at.place : at.fields] *= 0.3
        return start

    def phase(self, top: Top) -> Array:
        """Phase at the nodes, shape (m,) [rad]."""
        return node_phase(self.model, top.unknowns)


def sharp(model: FrameModel, phase: Array) -> int:
    """Most pixels of a bin that tell as much as its pixels of a phase at the nodes, shape (m,)."""
    nodes_per_pixel = len(model.fixed) * len(model.bias) / len(model.amplitude)
    return slow_size(model, float(np.abs(np.diff(phase)).max()) * nodes_per_pixel, BIN_PHASE)


def _chance(score: Score) -> float:
    """Chance that noise leaves larger scores."""
    square, freedom = score.square()
    return float(chdtrc(freedom, square)) if freedom else 1.0


@lru_cache(maxsize=8)
def _waves(nodes: int) -> Array:
    """Waves of phase at the nodes, shape (k, m)."""
    along = np.pi * (np.arange(nodes) + 0.5) / nodes
    return np.asarray(np.cos(np.outer(np.arange(min(WAVES, nodes)), along)))


class Bins:
    """Models of a sensor whose frames are in bins of pixels, by their sizes.

    Parameters
    ----------
    model : FrameModel
        Of the sensor.
    """

    def __init__(self, model: FrameModel) -> None:
        self._models, self._own = {1: model}, dict[int, FrameModel]()

    @cached_property
    def _coordinates(self) -> tuple[Array, FrameModel]:
        return contact_coordinates(self._models[1])

    def of(self, size: int, model: FrameModel) -> tuple[FrameModel, FrameModel]:
        """Model of bins by coordinates, and contacts, as of `settled`.

        Fields and fixed phase are the model's.
        """
        basis, contacts = self._coordinates
        if size not in self._own:
            self._own[size] = by_coordinates(self.pixels(size, self._models[1]), basis)
        found = self._own[size]
        if model.fields is not self._models[1].fields:
            found = found._replace(fields=np.concatenate([basis, model.fields]))
        return found._replace(fixed=model.fixed), contacts

    def pixels(self, size: int, model: FrameModel) -> FrameModel:
        """Model of bins."""
        if size not in self._models:
            self._models[size] = binned(self._models[1], size)
        return self._models[size]._replace(fields=model.fields, fixed=model.fixed)


def products(
    model: FrameModel, unknowns: Array
) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
    """Phase at the nodes by products of two errors, of a contact's force, place and width.

    The place is where the camera sees the contact, as `as_seen` has it.

    Returns
    -------
    waves : ndarray, shape (k, m)
        Phase per unit of the product.
    one, other : ndarray of int, shape (k,)
        Which unknowns these are.
    """
    at, nodes = model.at, len(model.fixed)
    found, loads = contact_columns(model, unknowns), unknowns[: at.loads].reshape(-1, 2)
    waves, pairs = [np.empty((0, nodes))], [np.empty((2, 0), dtype=np.intp)]
    shapes = [np.arange(at.place, at.width), np.arange(at.width, at.fields)]
    units = model.place, 1.0
    uncertain = [kind for kind in (0, 1) if len(shapes[kind])]
    for kind in uncertain:
        waves.append(units[kind] * found[kind].reshape(-1, nodes))
        pairs.append(np.array([np.arange(at.loads), np.repeat(shapes[kind], 2)]))
        step = np.zeros(at.size)
        step[shapes[kind]] = DIFFERENCE
        slope = contact_columns(model, unknowns + step) - contact_columns(model, unknowns - step)
        for other in uncertain[: uncertain.index(kind) + 1]:
            bent = np.einsum("ncm,nc->nm", units[other] * slope[other], loads) / (2 * DIFFERENCE)
            waves.append(bent / 2 if other == kind else bent)
            pairs.append(np.array([shapes[kind], shapes[other]]))
    one, other = np.concatenate(pairs, axis=1)
    return np.concatenate(waves), one, other


def covariance_of_products(
    covariance: Array, one: NDArray[np.intp], other: NDArray[np.intp]
) -> Array:
    """Covariance of products of two errors that are normal (Isserlis, Biometrika 12, 134, 1918)."""
    crossed = covariance[np.ix_(one, other)]
    straight = covariance[np.ix_(one, one)] * covariance[np.ix_(other, other)]
    return np.asarray(straight + crossed * crossed.T)
