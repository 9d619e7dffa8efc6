"""The posterior of a bench of a pad: every frame as readings of pads evaluate it, see `Fit`.

The own unknowns of a frame are the forces of its contacts, the gain of its light, and the places
along x, the places along y, the widths and the exponents of the contacts, from those about which
their influence was expanded.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, cast

import numpy as np

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.calibration.bench import BenchContacts
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.bench_posterior import BenchPosterior, stated_or
from fringeforce.calibration.pads.bench_uncertainty import SHAPES, BenchUncertainty, is_layer
from fringeforce.calibration.shared_unknowns import State
from fringeforce.estimation.levenberg_marquardt import Curvature, Expansion, Stop, minimise
from fringeforce.estimation.likelihood import Misfit, Response
from fringeforce.estimation.shared_fit import FrameTerms
from fringeforce.models.pad_contacts import NARROWEST, Contact, ContactSeries
from fringeforce.reading.pads.fit import Fit
from fringeforce.reading.pads.light import Place, Prior
from fringeforce.reading.pads.sampling import Sampling, for_steps

EXPONENT, EXPONENTS = (0.0, 0.5), (-0.8, 2.0)
"""Exponent that is expected of a contact's pressure, 1/2 under a sphere and -1/2 under a punch, and
its deviation; and the ends of what exponents can be."""
FURTHER, FURTHEST = 0.5, float(np.log(4.0))
"""Logarithm by which a layer's value may differ from that about which contacts are expanded, and
from that of the drawing: what is four times as thick is another sensor."""
MOST = 8
"""Contacts in a frame at most: of each some ten influences are held."""
REACH = 0.5
"""Thicknesses of the cover that a contact may be from where it was expanded, and how far its
exponent may be."""


class Parts(NamedTuple):
    """Where shared unknowns stand, and the number of all.

    Those of the pad come first, among them those of the residual and of how uneven the light is,
    then those of the list of loads.
    """

    residual: slice
    bright: slice
    pad: slice
    written: slice
    size: int

    def own(self, name: str) -> slice:
        """Unknowns of one part."""
        return getattr(self, name)


@dataclass(frozen=True, eq=False)
class PadBench(BenchContacts):
    """What was measured and how it is modelled; F frames of at most k contacts, P pixels.

    Attributes
    ----------
    frames : ndarray, shape (F, P)
        Grey levels.
    used : ndarray of bool, shape (P,)
        Pixels that count.
    which : ndarray of int, shape (F, k)
        Not negative where there is a contact.
    loads : BenchLoads
        As written down; widths are known or expected.
    centres, sizes, exponents : ndarray, shapes (F, k, 2), (F, k) and (F, k)
        Places and widths [m], and exponents, about which contacts are expanded.
    known : BenchUncertainty
        What is uncertain about the pad.
    response : Response
        Of its camera.
    averaged : ndarray, shape (F,)
        How many frames each row is the mean of.
    moves : tuple of ndarray, length F, shape (l, w) each
        What unknowns of the loads' list change in what is expected of the own unknowns of a frame.
    centre : ndarray, shape (S - w,)
        Unknowns of the pad about which contacts are expanded: zero but for layers.
    at : Parts
        Where the shared unknowns stand.
    samplings : tuple of Sampling, length F
        Every frame at some pixels, with its contacts expanded.
    """

    frames: Array
    used: Mask
    which: Index
    loads: BenchLoads
    centres: Array
    sizes: Array
    exponents: Array
    known: BenchUncertainty
    response: Response
    averaged: Array
    moves: tuple[Array, ...]
    centre: Array
    at: Parts
    samplings: tuple[Sampling, ...] = ()

    def expanded(self, series: ContactSeries, state: State | None) -> PadBench:
        """The same with all contacts expanded where they are in a state, or as written down."""
        square = np.zeros(self.which.shape, bool)
        if self.loads.tactels is not None:
            square = self.loads.tactels >= 0
        cover = series.pad.transducer.compliant.thickness
        centres, sizes, exponents = (
            values.copy() for values in (self.centres, self.sizes, self.exponents)
        )
        samplings = []
        for f, row in enumerate(self.which):
            own = np.flatnonzero(row >= 0)
            forces = self.loads.forces[f, own]
            k = len(own)
            if state is not None:
                forces = state.own[f][: 3 * k].reshape(k, 3)
                moved = state.own[f][3 * k + 1 :].reshape(SHAPES, k)
                centres[f, own] += self.known.units[0] * moved[:2].T
                sizes[f, own] += self.known.units[1] * moved[2]
                exponents[f, own] += moved[3]
            sizes[f, own] = np.maximum(sizes[f, own], NARROWEST * cover)
            contacts = [
                Contact(
                    centres[f, j],
                    force,
                    float(sizes[f, j]),
                    float(exponents[f, j]),
                    bool(square[f, j]),
                )
                for j, force in zip(own, forces, strict=True)
            ]
            known = self.known.of_frame(series.changes(contacts))
            samplings.append(for_steps(known.model, known))
        return replace(
            self, centres=centres, sizes=sizes, exponents=exponents, samplings=tuple(samplings)
        )


class Evaluated(NamedTuple):
    """A frame at some values of all its unknowns."""

    place: Place
    left: Misfit
    loss: float
    square: float


@dataclass(frozen=True, eq=False)
class PadPosterior(BenchPosterior):
    """The posterior of a bench of a pad."""

    bench: PadBench  # pyrefly: ignore[bad-override]

    @cached_property
    def _written(self) -> list[Array]:
        bench, found = self.bench, []
        place, width = bench.known.units
        for f in range(len(bench.frames)):
            own = self._contacts(f)
            beside = (bench.loads.places[f, own] - bench.centres[f, own]) / place
            widths = (bench.loads.widths[f, own] - bench.sizes[f, own]) / width
            forces = bench.loads.forces[f, own].ravel()
            exponents = EXPONENT[0] - bench.exponents[f, own]
            found.append(np.concatenate([forces, [0.0], beside.T.ravel(), widths, exponents]))
        return found

    @cached_property
    def _precisions(self) -> list[Array]:
        sizes, loads, (place, width) = self.expected.sizes, self.bench.loads, self.bench.known.units
        found = []
        for f in range(len(self.bench.frames)):
            own, unit = self._contacts(f), self.unit("normal", f)
            forces = unit[:, None] * [sizes["normal"], *[sizes["tangential"]] * 2]
            deviations = [
                stated_or(loads.force_std[f, own], forces).ravel(),
                [sizes["gain"]],
                np.tile(stated_or(loads.place_std[f, own] / place, sizes["place"]), 2),
                stated_or(loads.width_std[f, own] / width, sizes["width"]),
                np.full(len(own), EXPONENT[1]),
            ]
            found.append(1 / np.square(np.concatenate(deviations)))
        return found

    def group(self, name: str, f: int) -> Index:
        """Which own unknowns of a frame belong to one of GROUPS."""
        k = len(self._contacts(f))
        forces = np.arange(3 * k)
        after = 3 * k + 1
        return {
            "normal": forces[::3],
            "tangential": forces[forces % 3 > 0],
            "gain": np.array([3 * k]),
            "place": np.arange(after, after + 2 * k),
            "width": np.arange(after + 2 * k, after + 3 * k),
            "exponent": np.arange(after + 3 * k, after + 4 * k),
        }.get(name, forces[:0])

    def free(self, name: str, f: int) -> Mask:
        """Which of one of GROUPS of a frame have no standard deviation that somebody states."""
        own, loads = self._contacts(f), self.bench.loads
        stated = {
            "normal": loads.force_std[f, own, 0],
            "tangential": loads.force_std[f, own, 1:].ravel(),
            "place": np.tile(loads.place_std[f, own], 2),
            "width": loads.width_std[f, own],
        }
        if name in stated:
            return ~np.isfinite(stated[name])
        return np.ones(len(self.group(name, f)), dtype=bool)

    def unit(self, name: str, f: int) -> Array:
        """What one of GROUPS is measured in, for each of its unknowns of a frame."""
        found = super().unit(name, f)
        return np.repeat(found, 2) if name == "tangential" else found

    def expanded(self, f: int) -> tuple[Array, float, Array, float]:
        """Where contacts of a frame are expanded, shape (k, 2), their widths, and units."""
        bench, own, (place, width) = self.bench, self._contacts(f), self.bench.known.units
        return bench.centres[f, own], place, bench.sizes[f, own], width

    def models(self, shared: Array) -> None:  # pyrefly: ignore[bad-override]
        """Nothing: frames are evaluated with all their unknowns."""

    def _fit(self, f: int, shared: Array) -> Fit:
        bench, sampling = self.bench, self.bench.samplings[f]
        response = replace(bench.response, variance=self._variance(f) * self.heat)
        own = self.mean(f, shared)
        k = 3 * len(self._contacts(f))
        size = self._known(f).size
        mean, precision = np.zeros(size), np.zeros(size)
        first = size - (len(own) - k)
        mean[first:], precision[first:] = own[k:], self.precision(f)[k:]
        prior = Prior(mean, np.diag(precision))
        used = None if bench.used.all() else bench.used
        return Fit(sampling.model, response, sampling, bench.frames[f], used, prior)

    def _variance(self, f: int) -> float:
        """Variance of the noise of a row of frames."""
        return float(self.bench.response.variance / self.bench.averaged[f])

    def _known(self, f: int) -> BenchUncertainty:
        return cast(BenchUncertainty, self.bench.samplings[f].uncertain)

    @cached_property
    def _last(self) -> dict[int, tuple[Array, Array, Fit, Evaluated]]:
        """Where every frame was evaluated last: steps are taken from there."""
        return {}

    def _evaluated(self, f: int, own: Array, shared: Array) -> tuple[Fit, Evaluated]:
        last = self._last.get(f)
        if last is None or last[0] is not own or last[1] is not shared:
            last = self._last[f] = own, shared, *self._anew(f, own, shared)
        return last[2:]

    def _anew(self, f: int, own: Array, shared: Array) -> tuple[Fit, Evaluated]:
        fit, bench = self._fit(f, shared), self.bench
        k = 3 * len(self._contacts(f))
        extra = np.concatenate([shared[bench.at.pad] - bench.centre, own[k:]])
        place = fit.at(own[:k], extra)
        left = fit.misfit(place)
        off = own - self.mean(f, shared)
        loss = left.loss + float(self.precision(f)[:k] @ np.square(off[:k]))
        square = self.heat * float(left.slope @ left.slope)
        square += float(self.precision(f) @ np.square(off))
        return fit, Evaluated(place, left, loss, square)

    def loss(self, state: State, models: object) -> tuple[float, Array, Array]:
        """Twice the negative logarithm of the posterior, and what each frame and its pixels add."""
        total, squares = self.expected.loss(state.shared), np.zeros(len(state.own))
        for f, own in enumerate(state.own):
            _, found = self._evaluated(f, own, state.shared)
            total += self.shares[f] * found.loss
            squares[f] = found.square
        return total, squares, np.full(len(squares), float(self.bench.used.sum()))

    def left(self, f: int, own: Array, shared: Array) -> Array:
        """Grey levels of a frame less those expected, in units of the noise, shape (P,)."""
        level = self._evaluated(f, own, shared)[1].place.level
        return (self.bench.frames[f] - level) / np.sqrt(self._variance(f))

    def _half(self, f: int, own: Array, shared: Array) -> tuple[Array, Array]:
        """Half the gradient and the information of a frame, own unknowns and then shared ones."""
        fit, found = self._evaluated(f, own, shared)
        k, size = 3 * len(self._contacts(f)), len(self.bench.centre)
        gradient = fit.gradient(found.place, found.left)
        known = self._known(f)
        # a shift of the camera is all but one of the contacts, unless both are taken where it looks
        model = replace(known.model, sensor=known.camera.looking(found.place.extra))
        fit = replace(fit, sampling=for_steps(model, known))
        information = fit.information(found.place)
        off = own - self.mean(f, shared)
        gradient[:k] += self.precision(f)[:k] * off[:k]
        information[np.arange(k), np.arange(k)] += self.precision(f)[:k]
        mine = np.concatenate([np.arange(k), np.arange(k + size, len(gradient))])
        order = np.concatenate([mine, np.arange(k, k + size)])
        # the list of loads acts on what is expected of the own unknowns
        moves, precision = self.bench.moves[f], self.precision(f)
        added = moves.shape[1]
        gradient = np.append(gradient[order], -moves.T @ (precision * off))
        information = np.pad(information[np.ix_(order, order)], (0, added))
        cross = -precision[:, None] * moves
        information[: len(own), size + len(own) :] = cross
        information[size + len(own) :, : len(own)] = cross.T
        information[size + len(own) :, size + len(own) :] = -moves.T @ cross
        return gradient, information

    def terms(
        self, state: State, models: object, which: Sequence[int] | None = None
    ) -> Iterator[FrameTerms]:
        """Half the loss of every frame, or of some, to second order."""
        for f in range(len(state.own)) if which is None else which:
            own = state.own[f]
            gradient, information = self._half(f, own, state.shared)
            count = len(own)
            yield FrameTerms(
                information[:count, :count],
                information[:count, count:],
                information[count:, count:],
                gradient[:count],
                gradient[count:],
            )

    def settled(
        self, state: State, models: object, steps: int, rows: Sequence[int] | None = None
    ) -> State:
        """The own unknowns of all frames, or some, at their best."""
        own = list(state.own)
        for f in range(len(own)) if rows is None else rows:
            own[f] = self._settled(f, own[f], state.shared, steps)
        return replace(state, own=own)

    def _settled(self, f: int, first: Array, shared: Array, steps: int) -> Array:
        count = len(first)

        def loss(own: Array) -> float:
            return self._evaluated(f, own, shared)[1].loss

        def expand(own: Array) -> Expansion[Array]:
            gradient, information = self._half(f, own, shared)

            def ahead(step: Array) -> tuple[Array, float]:
                there = self._within(f, own + step, shared)
                return there, loss(there)

            return Expansion(
                loss(own),
                gradient[:count],
                lambda: Curvature(information[:count, :count]),
                ahead,
            )

        best = minimise(self._within(f, first, shared), expand, steps, Stop(close=0.1, near=1.0))
        return self._within(f, best.place + best.step, shared)

    def within(self, state: State) -> State:
        """A state whose layers and contacts are no farther than they are expanded."""
        known, centre, shared = self.bench.known, self.bench.centre, state.shared.copy()
        for group in known.groups:
            if is_layer(group.path):
                unit, here = known.logarithmic(group), centre[group.place]
                low = np.maximum(here - FURTHER / unit, -FURTHEST / unit)
                high = np.minimum(here + FURTHER / unit, FURTHEST / unit)
                shared[group.place] = np.clip(shared[group.place], low, high)
        return super().within(replace(state, shared=shared))

    def _within(self, f: int, own: Array, shared: Array) -> Array:
        """The own unknowns of a frame, with contacts no farther than they are expanded."""
        bench, k = self.bench, len(self._contacts(f))
        if not np.isfinite(own).all():
            return self.mean(f, shared)
        cover = bench.known.model.sensor.transducer.compliant.thickness
        place, width = bench.known.units
        kept = own.copy()
        moved = kept[3 * k + 1 :]
        moved[: 2 * k] = np.clip(moved[: 2 * k], -REACH * cover / place, REACH * cover / place)
        sizes = bench.sizes[f, self._contacts(f)]
        lowest = np.maximum(-REACH * cover, NARROWEST * cover - sizes) / width
        moved[2 * k : 3 * k] = np.clip(moved[2 * k : 3 * k], lowest, REACH * cover / width)
        lowest, highest = (end - bench.exponents[f, self._contacts(f)] for end in EXPONENTS)
        moved[3 * k :] = np.clip(
            moved[3 * k :], np.maximum(lowest, -REACH), np.minimum(highest, REACH)
        )
        return kept
