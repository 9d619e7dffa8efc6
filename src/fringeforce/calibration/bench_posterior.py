"""One posterior of a bench: the sensor that all frames share, and the contacts of every frame.

Shared are values of the design, the camera's shift and scale, the residual and the light of each
channel as smooth fields, blur, gamma and cross-talk.  Every frame has forces, places and widths of
contacts about those that are written down, and a lamp of its own, which all channels share.  All
are unknowns of a `FrameModel`, as in readings; what a design value or the camera's place changes is
added to it.

How far contacts, forces and lamp scatter, and how large the fields are, is taken from the frames
where nobody states it: the sizes under which they are most probable (MacKay, Neural Computation 4,
415-447, 1992).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cholesky

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.calibration.bench import LAMP, Bench
from fringeforce.calibration.frame_models import FrameModels
from fringeforce.calibration.shared_unknowns import Expected, State
from fringeforce.estimation.frame_climb import climb
from fringeforce.estimation.frame_information import information as pixel_information
from fringeforce.estimation.frame_loss import Prior, loss_at
from fringeforce.estimation.linearised_frame import (
    banded,
    linearise,
    pulled_phase,
    shared_information,
    spread_profiles,
)
from fringeforce.estimation.shared_fit import Eliminated, FrameTerms

PINNED = 1e12
"""Precision of unknowns that must not move."""
GROUPS = "normal", "tangential", "place", "width", "gain", "offset"
"""What scatters from frame to frame."""
FULL_SCALE = 0.05
"""Share of the largest force whose error every force has: load cells err by a full scale too."""
EXACT = 1e-6
"""Standard deviation of what is stated as exact, in its unit."""
LEAST = 0.5
"""Share of what is expected of shared unknowns that must be left with the frames, which cannot tell
less than nothing: where sums at the nodes take more of it away, they are not near enough."""


class SecondOrder(NamedTuple):
    """The posterior of a bench to second order about some values of all unknowns.

    Attributes
    ----------
    terms : list of FrameTerms, length F
        Of the frames.
    told : list of Eliminated, length F
        The same with the own unknowns of each eliminated.
    gradient, information : ndarray, shapes (S,) and (S, S)
        Of the shared unknowns, the prior included; the information is positive.
    exact : bool
        As of `BenchPosterior`.
    """

    terms: list[FrameTerms]
    told: list[Eliminated]
    gradient: Array
    information: Array
    exact: bool


@dataclass(frozen=True, eq=False)
class BenchPosterior:
    """The posterior of a bench.

    Attributes
    ----------
    bench : Bench
        The frames.
    expected : Expected
        Before them.
    shares : ndarray, shape (F,)
        What every frame counts.
    heat : float
        Factor on the variance of the noise.
    exact : bool
        Whether what a frame of a strip tells is summed over its pixels, and not at the nodes.
    """

    bench: Bench
    expected: Expected
    shares: Array
    heat: float = 1.0
    exact: bool = False

    def start(self, shared: Array) -> State:
        """Contacts as written down."""
        return State(shared, [self.mean(f, shared) for f in range(len(self.bench.frames))])

    def _contacts(self, f: int) -> Index:
        return self.bench.contacts_of[f]

    def mean(self, f: int, shared: Array) -> Array:
        """What is expected of the own unknowns of a frame."""
        return self._written[f] + self.bench.moves[f] @ shared[self.bench.at.own("written")]

    @cached_property
    def _written(self) -> list[Array]:
        """Own unknowns of all frames as written down."""
        loads, size, found = self.bench.loads, self.bench.contacts.size, []
        for f, beside in enumerate(self.bench.beside):
            own = self._contacts(f)
            stated = loads.widths[f, own]
            widths = np.where(np.isfinite(stated), (stated - size.width) / size.width_std, 0.0)
            forces, places = loads.forces[f, own].ravel(), beside[own] / size.place
            found.append(np.concatenate([forces, places, widths, np.zeros(LAMP)]))
        return found

    def precision(self, f: int) -> Array:
        """Inverse variances of the own unknowns of a frame before it is seen."""
        return self._precisions[f]

    @cached_property
    def _precisions(self) -> list[Array]:
        sizes, loads, size = self.expected.sizes, self.bench.loads, self.bench.contacts.size
        found = []
        for f in range(len(self.bench.frames)):
            own, unit = self._contacts(f), self.unit("normal", f)
            forces = np.stack([sizes["normal"] * unit, sizes["tangential"] * unit], axis=1)
            places, widths = loads.place_std[f, own], loads.width_std[f, own]
            deviations = [
                stated_or(loads.force_std[f, own], forces).ravel(),
                stated_or(places / size.place, sizes["place"]),
                stated_or(widths / size.width_std, sizes["width"]),
                [sizes["gain"], sizes["offset"]],
            ]
            found.append(1 / np.square(np.concatenate(deviations)))
        return found

    def free(self, name: str, f: int) -> Mask:
        """Which of one of GROUPS of a frame have no standard deviation that somebody states."""
        own, loads = self._contacts(f), self.bench.loads
        stated = {
            "normal": loads.force_std[f, own, 0],
            "tangential": loads.force_std[f, own, 1],
            "place": loads.place_std[f, own],
            "width": loads.width_std[f, own],
        }
        return ~np.isfinite(stated[name]) if name in stated else np.ones(1, dtype=bool)

    def group(self, name: str, f: int) -> Index:
        """Which own unknowns of a frame belong to one of GROUPS."""
        k, number = len(self._contacts(f)), GROUPS.index(name)
        if number < 2:
            return np.arange(number, 2 * k, 2)
        if number < 4:
            return np.arange(number * k, (number + 1) * k)
        return np.array([4 * k + number - 4])

    def unit(self, name: str, f: int) -> Array:
        """What one of GROUPS is measured in, for each of its unknowns of a frame."""
        own = self._contacts(f)
        if name in ("normal", "tangential"):
            whole = np.linalg.norm(self.bench.loads.forces[f, own], axis=1)
            return np.hypot(whole, FULL_SCALE * self.bench.largest)
        return np.ones(len(self.group(name, f)))

    def expanded(self, f: int) -> tuple[Array, float, Array, float]:
        """Where contacts of a frame are expanded, shape (k,) or (k, 2), their widths, and units."""
        bench, own, size = self.bench, self._contacts(f), self.bench.contacts.size
        places = bench.loads.places[f, own] - bench.beside[f, own]
        return places, size.place, np.full(len(own), size.width), size.width_std

    def table(self, f: int, own: Array, deviations: bool = False) -> Array:
        """Places, forces and widths of the contacts of a frame, shape (k, m), as in `BenchRecord`.

        Parameters
        ----------
        f : int
            Number of the frame.
        own : ndarray, shape (l,)
            Its own unknowns, or standard deviations of these.
        deviations : bool
            Which of the two.
        """
        places, unit, widths, wide = self.expanded(f)
        k, whole = len(widths), 0.0 if deviations else 1.0
        moved = own[self.group("place", f)].reshape(-1, k).T
        forces = own[: k * self.bench.loads.forces.shape[2]].reshape(k, -1)
        width = whole * widths + wide * own[self.group("width", f)]
        return np.column_stack([whole * places.reshape(k, -1) + unit * moved, forces, width])

    def models(self, shared: Array) -> FrameModels:
        """Models of all frames for values of the shared unknowns."""
        return FrameModels.of(self.bench, shared, self.heat)

    def loss(self, state: State, models: FrameModels) -> tuple[float, Array, Array]:
        """Twice the negative logarithm of the posterior, and what each frame and its pixels add.

        Returns
        -------
        loss : float
            Of the posterior.
        squares : ndarray, shape (F,)
            Weighted squared residuals in units of the noise, and how far the contacts and the lamp
            lie from what is expected of them.
        counts : ndarray, shape (F,)
            Pixels that count.
        """
        total = self.expected.loss(state.shared)
        told = []
        for f, own in enumerate(state.own):
            found, square, count = loss_at(
                models.of_frame(f),
                self._prior(f, state.shared),
                self.bench.frames[f],
                models.unknowns(f, own, state.shared),
            )
            total += self.shares[f] * found
            off = own - self.mean(f, state.shared)
            told.append((square * self.heat + self.precision(f) @ np.square(off), count))
        squares, counts = np.array(told).T
        return total, squares, counts

    def _prior(self, f: int, shared: Array) -> Prior:
        """Of the unknowns of a frame's model; the shared ones are free."""
        at, (mine, others) = self.bench.at, self.bench.splits[len(self._contacts(f))]
        mean = np.empty(len(mine) + len(others))
        mean[mine], mean[others] = self.mean(f, shared), shared[at.residual : at.written]
        if f not in self._prior_precisions:
            precision = np.zeros(len(mean))
            precision[mine] = self.precision(f)
            self._prior_precisions[f] = precision
        return Prior(mean, self._prior_precisions[f], -1.0, 1e6)

    @cached_property
    def _prior_precisions(self) -> dict[int, Array]:
        """Precisions of the priors of frames so far."""
        return {}

    def settled(
        self,
        state: State,
        models: FrameModels,
        steps: int,
        rows: Sequence[int] | None = None,
    ) -> State:
        """The own unknowns of all frames, or some, at their best."""
        found, held = list(state.own), models.held()
        for f in range(len(found)) if rows is None else rows:
            mean, precision = self.mean(f, state.shared), self.precision(f)
            best = climb(
                models.alone(f, held),
                Prior(np.append(mean, 1.0), np.append(precision, PINNED), -1.0, 1e6),
                self.bench.frames[f],
                np.append(self._within(f, found[f], state.shared), 1.0),
                1.0,
                steps,
                0.1,
            )[0]
            found[f] = self._within(f, best[:-1], state.shared)
        return replace(state, own=found)

    def within(self, state: State) -> State:
        """A state whose contacts are where their phase is known."""
        own = [self._within(f, own, state.shared) for f, own in enumerate(state.own)]
        return replace(state, own=own)

    def _within(self, f: int, own: Array, shared: Array) -> Array:
        """The own unknowns of a frame, with contacts no farther than their phase is known."""
        k, size = len(self._contacts(f)), self.bench.contacts.size
        if not np.isfinite(own).all():
            return self.mean(f, shared)
        kept = own.copy()
        widths = np.minimum(size.width + size.width_std * own[3 * k : 4 * k], size.widest)
        farthest = (size.reach - np.maximum(widths, 0.0) / 2) / size.place
        kept[2 * k : 3 * k] = np.minimum(np.maximum(own[2 * k : 3 * k], -farthest), farthest)
        kept[3 * k : 4 * k] = (widths - size.width) / size.width_std
        return kept

    def terms(
        self, state: State, models: FrameModels, which: Sequence[int] | None = None
    ) -> Iterator[FrameTerms]:
        """Half the loss of every frame, or of some, to second order."""
        slopes, rows, bent = models.slopes(), models.column_rows(), models.strain_slopes()
        for f in range(len(state.own)) if which is None else which:
            own = state.own[f]
            unknowns = models.unknowns(f, own, state.shared)
            waves = models.waves(f, unknowns, slopes) + bent[f]
            columns = models.columns(f)
            turned = rows[:, columns] * own[: len(columns), None, None]
            waves = np.concatenate([waves, turned.reshape(-1, waves.shape[1])])
            yield self._terms(f, own, state.shared, models, waves)

    def _terms(
        self, f: int, own: Array, shared: Array, models: FrameModels, waves: Array
    ) -> FrameTerms:
        model, unknowns = models.of_frame(f), models.unknowns(f, own, shared)
        prior = self._prior(f, shared)
        about = linearise(model, prior, self.bench.frames[f], unknowns)
        mine, others = models.split(f)
        which = models.involved(f)
        size, first = len(which), len(waves)
        last = first + len(others)
        moves, precision = self.bench.moves[f], self.precision(f)
        pulled = -moves.T @ (precision * (own - self.mean(f, shared)))
        gradient = np.concatenate([waves @ pulled_phase(about), about.gradient[others], pulled])
        whole, mixed = np.zeros((size, size)), np.empty((len(own), size))
        whole[last:, last:] = moves.T @ (precision[:, None] * moves)
        mixed[:, last:] = -precision[:, None] * moves
        if self.exact:
            told = pixel_information(model, self.bench.frames[f], unknowns, waves)
            there = np.append(np.arange(model.at.size, len(told)), others)
            whole[:last, :last] = told[np.ix_(there, there)]
            mixed[:, :last] = told[np.ix_(mine, there)]
            hessian = told[np.ix_(mine, mine)] + np.diag(precision)
        else:
            spread = spread_profiles(model, unknowns, waves)
            weighed = banded(about, spread)
            cross = shared_information(model, about, spread, weighed)
            whole[:first, :first] = spread @ weighed.T
            whole[:first, first:last] = cross[others].T
            whole[first:last, :first] = cross[others]
            whole[first:last, first:last] = about.hessian[np.ix_(others, others)]
            mixed[:, :first] = cross[mine]
            mixed[:, first:last] = about.hessian[np.ix_(mine, others)]
            hessian = about.hessian[np.ix_(mine, mine)]
        return FrameTerms(hessian, mixed, whole, about.gradient[mine], gradient, which)

    def eliminated(self, state: State, models: FrameModels) -> list[Eliminated]:
        """All frames with their own unknowns eliminated."""
        return [Eliminated.of(terms) for terms in self.terms(state, models)]

    def second_order(self, state: State, models: FrameModels) -> SecondOrder:
        """The posterior to second order, with an information that is positive.

        Sums at the nodes are near those over all pixels, but what is left of them for unknowns that
        frames hardly tell from their own can be less than nothing.  Pixels are then summed one by
        one: these are squares, so that frames add to what is expected before them.
        """
        try:
            return self._second_order(state, models)
        except LinAlgError:
            return replace(self, exact=True)._second_order(state, models)

    def _second_order(self, state: State, models: FrameModels) -> SecondOrder:
        terms = list(self.terms(state, models))
        told = [Eliminated.of(one) for one in terms]
        gradient, information = self.normal(state, told)
        # fails unless this is positive
        cholesky(information - LEAST * self.expected.information, check_finite=False)
        return SecondOrder(terms, told, gradient, information, self.exact)

    def normal(self, state: State, told: list[Eliminated]) -> tuple[Array, Array]:
        """Gradient and information of the shared unknowns, the prior included."""
        expected = self.expected
        gradient, information = expected.slope(state.shared), expected.information
        for share, one in zip(self.shares, told, strict=True):
            gradient[one.which] += share * one.gradient
            if len(one.which) == len(gradient):  # all act on the frame
                information += share * one.information
            else:
                information[np.ix_(one.which, one.which)] += share * one.information
        return gradient, information


def stated_or(std: Array, else_: Array | float) -> Array:
    """What is stated, and something else where nothing is."""
    return np.where(np.isfinite(std), np.maximum(std, EXACT), else_)
