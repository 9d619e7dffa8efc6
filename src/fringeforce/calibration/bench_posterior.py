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
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import accumulate
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.columns import Columns
from fringeforce.calibration.contact_phase import ContactPhases
from fringeforce.calibration.strain_phase import StrainPhases
from fringeforce.estimation.frame_climb import climb
from fringeforce.estimation.frame_exposure import NARROWEST_BLUR, node_phase, positive
from fringeforce.estimation.frame_loss import Prior, loss_at
from fringeforce.estimation.frame_model import FrameModel, Layout
from fringeforce.estimation.linearised_frame import (
    banded,
    linearise,
    pulled_phase,
    shared_information,
    spread_profiles,
)
from fringeforce.estimation.shared_fit import Eliminated, FrameTerms
from fringeforce.models.node_splines import coefficients

SHIFT, SCALE = 1e-3, 1e-2
"""Units of the camera's shift [m] and scale."""
PINNED = 1e12
"""Precision of unknowns that must not move."""
GROUPS = "normal", "tangential", "place", "width", "gain", "offset"
"""What scatters from frame to frame."""
LAMP = 2
"""Unknowns of the lamp of one frame: gain and offset."""
FULL_SCALE = 0.05
"""Share of the largest force whose error every force has: load cells err by a full scale too."""
EXACT = 1e-6
"""Standard deviation of what is stated as exact, in its unit."""


class Parts(NamedTuple):
    """Where the shared unknowns stand; `size` is their number."""

    design: int
    camera: int
    height: int
    slope: int
    residual: int
    bright: int
    dark: int
    blur: int
    gamma: int
    crosstalk: int
    written: int
    size: int

    def own(self, name: str) -> slice:
        """Unknowns of one part."""
        number = self._fields.index(name)
        return slice(self[number], self[number + 1])

    def resized(self, name: str, count: int) -> Parts:
        """The same with so many unknowns of one part."""
        number = self._fields.index(name)
        more = count - (self[number + 1] - self[number])
        return Parts(*(place + more * (k > number) for k, place in enumerate(self)))


def parts(
    design: int, columns: int, fields: int, bright: int, dark: int, crosstalk: int, written: int
) -> Parts:
    """Places of the shared unknowns, from the numbers of each; columns have two kinds of errors."""
    light = bright, dark, 1, 1, crosstalk
    return Parts(*accumulate([0, design, 2, columns, columns, fields, *light, written]))


class BenchContacts:
    """Contacts of the frames of a bench."""

    if TYPE_CHECKING:  # fields of frozen dataclasses, which a property would be a default of

        @property
        def loads(self) -> BenchLoads:
            """What was measured of the loads."""
            ...

        @property
        def which(self) -> Index:
            """Contacts of every frame."""
            ...

    @cached_property
    def largest(self) -> float:
        """Largest force of a contact [N]."""
        return float(np.nanmax(np.linalg.norm(self.loads.forces, axis=-1), initial=1e-3))

    @cached_property
    def contacts_of(self) -> list[Index]:
        """Which of the k contacts each frame has."""
        return [np.flatnonzero(row >= 0) for row in self.which]


@dataclass(frozen=True, eq=False)
class Bench(BenchContacts):
    """What was measured and how it is modelled; F frames of at most k contacts, P pixels, m nodes.

    Attributes
    ----------
    frames : ndarray, shape (F, P)
        Grey levels; not finite where a pixel is not used.
    which : ndarray of int, shape (F, k)
        Which of the places of `contacts` each contact has; -1 where there is none.
    beside : ndarray, shape (F, k)
        How far contacts are written down beside those places [m].
    loads : BenchLoads
        As written down.
    contacts : ContactPhases
        Phase of contacts at these places.
    template : FrameModel
        Of a frame: nodes, fields, light without that of single frames, lens.
    places : ndarray, shape (s,)
        Of the samples between the nodes along the frame, where a camera as drawn looks [m].
    at : Parts
        Where the shared unknowns stand.
    lamp : ndarray, shape (2, 2, C m)
        Changes of amplitude and offset with the gain and the offset of one frame.
    averaged : ndarray, shape (F,)
        How many frames each row is the mean of.
    turned : ndarray, shape (F,)
        Phase that the analyser adds [rad].
    moves : tuple of ndarray, length F, shape (l, w) each
        What unknowns of the loads' list, such as the zero of its places, change in what is expected
        of the own unknowns of a frame.
    columns : Columns, optional
        Errors that the columns of tactels may have.
    strain : StrainPhases, optional
        What large strain adds; none where strain is small.
    """

    frames: Array
    which: Index
    beside: Array
    loads: BenchLoads
    contacts: ContactPhases
    template: FrameModel
    places: Array
    at: Parts
    lamp: Array
    averaged: Array
    turned: Array
    moves: tuple[Array, ...]
    columns: Columns | None = None
    strain: StrainPhases | None = None

    @cached_property
    def layouts(self) -> list[Layout]:
        """Where the unknowns of a frame's model stand, by the number of its contacts."""
        fields, modes = len(self.template.fields), len(self.template.brightness) + LAMP
        more = np.array([fields, modes, 0, 1, 1, len(self.template.leaks)])
        return [
            Layout(2 * k, 2 * k, 3 * k, 4 * k, *(4 * k + np.cumsum(more)).tolist())
            for k in range(self.which.shape[1] + 1)
        ]

    @cached_property
    def splits(self) -> list[tuple[Index, Index]]:
        """Which of these are a frame's own, and which are shared."""
        found = []
        for at in self.layouts:
            lamp = np.arange(at.modes, at.modes + LAMP)
            mine = np.concatenate([np.arange(at.fields), lamp])
            found.append((mine, np.delete(np.arange(at.size), mine)))
        return found

    @cached_property
    def light(self) -> tuple[Array, Array]:
        """Changes of amplitude and offset with the lamp of one frame, and with what is shared."""
        bright, dark = self.lamp
        return (
            np.concatenate([bright, self.template.brightness]),
            np.concatenate([dark, self.template.darkness]),
        )

    def positions(self, shared: Array, drawn: Array) -> Array:
        """Where pixels or samples look that look at `drawn` as designed [m]."""
        shift, scale = shared[self.at.own("camera")]
        return shift * SHIFT + (1 + scale * SCALE) * drawn


@dataclass(frozen=True, eq=False)
class State:
    """Values of all unknowns: the shared ones (S,), and those of every frame."""

    shared: Array
    own: list[Array]

    def moved(self, step: Array, told: list[Eliminated]) -> State:
        """A step (S,) of the shared unknowns away, which the others follow."""
        own = [
            value + one.step + one.response @ step[one.which]
            for value, one in zip(self.own, told, strict=True)
        ]
        return State(self.shared + step, own)


@dataclass(frozen=True, eq=False)
class Expected:
    """What is expected before the frames are seen.

    Attributes
    ----------
    precision : ndarray, shape (S,)
        Of the shared unknowns, whose mean is zero.
    sizes : dict of str to float
        How much each of GROUPS scatters: forces over the whole force of the contact, places and
        widths and light in the units of the model.
    """

    precision: Array
    sizes: dict[str, float] = field(default_factory=dict)

    @property
    def information(self) -> Array:
        """What is known of the shared unknowns together, shape (S, S)."""
        return np.diag(self.precision)

    def loss(self, shared: Array) -> float:
        """Twice the negative logarithm of what is expected of the shared unknowns (S,)."""
        return float(self.precision @ np.square(shared))

    def slope(self, shared: Array) -> Array:
        """Half the derivative of that, shape (S,)."""
        return self.precision * shared

    def freedom(self, covariance: Array) -> float:
        """How many of the shared unknowns frames tell that leave them with a covariance (S, S)."""
        return float((1 - self.precision * np.diag(covariance)).sum())


@dataclass(frozen=True, eq=False)
class ExpectedTogether(Expected):
    """What is known of shared unknowns together, such as by an earlier calibration.

    Attributes
    ----------
    mean : ndarray, shape (S,)
        Of the shared unknowns.
    together : ndarray, shape (S, S)
        Inverse of their covariance.
    """

    mean: Array = field(kw_only=True)
    together: Array = field(kw_only=True)

    @property
    def information(self) -> Array:
        """What is known of the shared unknowns together, shape (S, S)."""
        return self.together.copy()

    def loss(self, shared: Array) -> float:
        """As of `Expected`."""
        return float((shared - self.mean) @ self.slope(shared))

    def slope(self, shared: Array) -> Array:
        """As of `Expected`."""
        return self.together @ (shared - self.mean)

    def freedom(self, covariance: Array) -> float:
        """As of `Expected`."""
        return float(len(covariance) - (self.together * covariance).sum())


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
    """

    bench: Bench
    expected: Expected
    shares: Array
    heat: float = 1.0

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
        spread = spread_profiles(model, unknowns, waves)
        weighed = banded(about, spread)
        cross = shared_information(model, about, spread, weighed)
        mine, others = models.split(f)
        which = models.involved(f)
        size, first = len(which), len(waves)
        last = first + len(others)
        moves, precision = self.bench.moves[f], self.precision(f)
        pulled = -moves.T @ (precision * (own - self.mean(f, shared)))
        gradient = np.concatenate([waves @ pulled_phase(about), about.gradient[others], pulled])
        whole = np.zeros((size, size))
        whole[:first, :first] = spread @ weighed.T
        whole[:first, first:last] = cross[others].T
        whole[first:last, :first] = cross[others]
        whole[first:last, first:last] = about.hessian[np.ix_(others, others)]
        whole[last:, last:] = moves.T @ (precision[:, None] * moves)
        mixed = np.empty((len(own), size))
        mixed[:, :first] = cross[mine]
        mixed[:, first:last] = about.hessian[np.ix_(mine, others)]
        mixed[:, last:] = -precision[:, None] * moves
        hessian = about.hessian[np.ix_(mine, mine)]
        return FrameTerms(hessian, mixed, whole, about.gradient[mine], gradient, which)

    def eliminated(self, state: State, models: FrameModels) -> list[Eliminated]:
        """All frames with their own unknowns eliminated."""
        return [Eliminated.of(terms) for terms in self.terms(state, models)]

    def normal(self, state: State, told: list[Eliminated]) -> tuple[Array, Array]:
        """Gradient and information of the shared unknowns, the prior included."""
        expected = self.expected
        gradient, information = expected.slope(state.shared), expected.information
        for share, one in zip(self.shares, told, strict=True):
            gradient[one.which] += share * one.gradient
            if self.bench.columns is None:  # all act on every frame
                information += share * one.information
            else:
                information[np.ix_(one.which, one.which)] += share * one.information
        return gradient, information


@dataclass(frozen=True, eq=False)
class FrameModels:
    """Models of all frames of a bench for some values of the shared unknowns."""

    bench: Bench
    shared: Array
    heat: float
    profiles: Array
    corrections: Array
    strained: Array

    @classmethod
    def of(cls, bench: Bench, shared: Array, heat: float) -> FrameModels:
        """Solve for the profiles of all contacts."""
        nodes = len(bench.template.fixed)
        design = shared[bench.at.own("design")]
        x = bench.positions(shared, bench.places)
        profiles = bench.contacts.profiles(design, x, nodes)
        corrections = np.zeros((0, 2, nodes))
        if bench.columns is not None:
            errors = shared[bench.at.height : bench.at.residual]
            columns = coefficients(bench.columns.correction(errors, x).T, nodes)
            corrections = columns.reshape(-1, 2, nodes)
        strained = np.zeros((len(bench.frames), 1))
        if bench.strain is not None:
            added = bench.strain.added_at(design)
            strained = bench.contacts.carried(added[None], x, nodes)[0]
        return cls(bench, shared, heat, np.ascontiguousarray(profiles), corrections, strained)

    def contacts(self, f: int) -> Index:
        """Places of the contacts of a frame, as numbers of those of the bench."""
        return self.bench.which[f, self.bench.contacts_of[f]]

    def of_frame(self, f: int) -> FrameModel:
        """Model of one frame, whose loss, terms and own unknowns are asked for in turn."""
        if f not in self._made:
            self._made[f] = self._with_profiles(f, self._profiles(f))
        return self._made[f]

    @cached_property
    def _made(self) -> dict[int, FrameModel]:
        """Models of frames so far."""
        return {}

    def _profiles(self, f: int) -> Array:
        """Those of the contacts of a frame, which frames with the same contacts share."""
        own, columns = self.contacts(f), self.bench.columns
        which = own.tobytes(), b"" if columns is None else self.tactels(f).tobytes()
        if which not in self._chosen:
            chosen = self.profiles[own]
            if columns is not None:
                more = self.corrections[self.tactels(f)]
                chosen = chosen + self.middling[:, None] * more[:, :, None]
            self._chosen[which] = chosen
        return self._chosen[which]

    @cached_property
    def _chosen(self) -> dict[tuple[bytes, bytes], Array]:
        """Profiles of the contacts of frames so far, by their places and tactels."""
        return {}

    def _with_profiles(self, f: int, chosen: Array) -> FrameModel:
        bench = self.bench
        template, averaged = bench.template, bench.averaged[f]
        brightness, darkness = bench.light
        return template._replace(
            fixed=template.fixed + self.strained[f],
            moments=np.zeros((len(chosen), 2, 1, 1)),
            profiles=chosen,
            brightness=brightness,
            darkness=darkness,
            influence=np.zeros((0, 1, len(chosen), 2, template.fixed.size)),
            bias=template.bias + bench.turned[f],
            variance=template.variance * self.heat / averaged,
            at=bench.layouts[len(chosen)],
        )

    def held(self) -> dict[str, Any]:
        """Parts of a frame's model in which all that is shared has its value, as one mode."""
        bench, template, at = self.bench, self.bench.template, self.bench.at
        light = self.shared[at.bright : at.blur]
        deviation = template.blur + template.blur_std * self.shared[at.blur]
        leaks = np.tensordot(self.shared[at.own("crosstalk")], template.leaks, 1)
        return {
            "fixed": template.fixed + self.shared[at.own("residual")] @ template.fields,
            "fields": template.fields[:0],
            "brightness": np.concatenate([bench.lamp[0], [light @ template.brightness]]),
            "darkness": np.concatenate([bench.lamp[1], [light @ template.darkness]]),
            "blur": float(positive(deviation, NARROWEST_BLUR)[0]),
            "blur_std": 0.0,
            "gamma": float(template.gamma + template.gamma_std * self.shared[at.gamma]),
            "gamma_std": 0.0,
            "crosstalk": template.crosstalk + leaks if len(template.leaks) else template.crosstalk,
            "leaks": template.leaks[:0],
        }

    def alone(self, f: int, held: dict[str, Any]) -> FrameModel:
        """Model of one frame whose unknowns are its own, and last that of what is shared, one."""
        model, k = self.of_frame(f), len(self.contacts(f))
        at = Layout(2 * k, 2 * k, 3 * k, 4 * k, 4 * k, *[4 * k + LAMP + 1] * 5)
        own: dict[str, Any] = {**held, "fixed": held["fixed"] + self.strained[f], "at": at}
        return model._replace(**own)

    def tactels(self, f: int) -> Index:
        """Numbers of the tactels on which the contacts of a frame are."""
        numbers = self.bench.loads.tactels
        assert numbers is not None, "columns are those of tactels"
        return numbers[f, self.bench.contacts_of[f]]

    @cached_property
    def middling(self) -> Array:
        """What the mixtures of moments are for a narrow contact at its place, shape (k,)."""
        mixing = self.bench.template.mixing
        narrow = np.eye(1, mixing.shape[1])[0]
        return np.asarray(np.linalg.lstsq(mixing.T, narrow, rcond=None)[0], dtype=float)

    def columns(self, f: int) -> Index:
        """Columns of the forces of a frame, shape (2k,); none if columns have no errors."""
        if self.bench.columns is None:
            return np.zeros(0, dtype=np.intp)
        return np.add.outer(2 * self.tactels(f), [0, 1]).ravel()

    def involved(self, f: int) -> Index:
        """Numbers of the shared unknowns that act on a frame: not errors of other columns."""
        at, columns = self.bench.at, self.bench.columns
        if columns is None:
            return np.arange(at.size)
        errors = np.arange(at.height, at.residual).reshape(2, 2 * columns.tactels, -1)
        own = errors[:, self.columns(f)].ravel()
        return np.concatenate([np.arange(at.height), own, np.arange(at.residual, at.size)])

    def column_rows(self) -> Array:
        """What the errors of columns turn per force, shape (2, 2n, r, m) [rad/N]."""
        bench, nodes = self.bench, len(self.bench.template.fixed)
        if bench.columns is None:
            return np.zeros((2, 0, 0, nodes))
        x = bench.positions(self.shared, bench.places)
        rows = coefficients(bench.columns.rows(x), nodes)
        return rows.reshape(2, 2 * bench.columns.tactels, -1, nodes)

    def split(self, f: int) -> tuple[Index, Index]:
        """Which unknowns of a frame's model are its own, and which are shared."""
        return self.bench.splits[len(self.bench.contacts_of[f])]

    def unknowns(self, f: int, own: Array, shared: Array) -> Array:
        """Unknowns of a frame's model."""
        mine, others = self.split(f)
        found = np.empty(len(mine) + len(others))
        at = self.bench.at
        found[mine], found[others] = own, shared[at.residual : at.written]
        return found

    def slopes(self) -> Array:
        """Changes of the profiles with design and camera, shape (C, 2, k, d + 2, m)."""
        bench, nodes = self.bench, len(self.bench.template.fixed)
        design = self.shared[bench.at.own("design")]
        drawn, x = bench.places, bench.positions(self.shared, bench.places)
        found = bench.contacts.slopes(design, x, drawn, nodes)
        found[-2] *= SHIFT
        found[-1] *= SCALE
        return np.ascontiguousarray(np.moveaxis(found, 0, -2))

    def strain_slopes(self) -> Array:
        """Changes of what strain adds with design and camera, shape (F, d + 2, m) or (F, 1, 1)."""
        bench, nodes = self.bench, len(self.bench.template.fixed)
        if bench.strain is None:
            return np.zeros((len(bench.frames), 1, 1))
        drawn, x = bench.places, bench.positions(self.shared, bench.places)
        here = bench.strain.added_at(self.shared[bench.at.own("design")])
        shift, scale = bench.contacts.carried_slopes(here, x, drawn, nodes)
        design = bench.contacts.carried(bench.strain.added[1:], x, nodes)
        return np.moveaxis(np.concatenate([design, [SHIFT * shift, SCALE * scale]]), 0, 1)

    def waves(self, f: int, unknowns: Array, slopes: Array) -> Array:
        """Changes of the phase at the nodes with design and camera, shape (d + 2, m)."""
        changes, nodes = slopes.shape[-2:]
        line = changes * nodes  # one after another, without the residual
        model = self._with_profiles(f, slopes.reshape(*slopes.shape[:-2], line)[self.contacts(f)])
        model = model._replace(fixed=np.zeros(line), fields=np.zeros((0, line)))
        return np.asarray(node_phase(model, unknowns)).reshape(changes, nodes)


def stated_or(std: Array, else_: Array | float) -> Array:
    """What is stated, and something else where nothing is."""
    return np.where(np.isfinite(std), np.maximum(std, EXACT), else_)
