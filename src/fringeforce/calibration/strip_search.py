"""The search for the most probable strip of a bench: mechanics, camera, light, delay of a log."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from fringeforce.base.arrays import Array, Mask
from fringeforce.calibration.bench import LAMP, Bench, parts
from fringeforce.calibration.bench_expectation import (
    DOUBT,
    FIELDS,
    SCALE,
    SHIFT,
    SMOOTH,
    THINNED,
    contact_size,
    frame_template,
)
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.bench_posterior import GROUPS, BenchPosterior
from fringeforce.calibration.bench_search import (
    HEATS,
    NEAR_DESIGN,
    SETTLED,
    STAGES,
    STILL,
    BenchSearch,
    inverse,
)
from fringeforce.calibration.checks import see_strip
from fringeforce.calibration.columns import Columns
from fringeforce.calibration.contact_phase import ContactSize, contact_phases, distinct
from fringeforce.calibration.design_entries import DEVIATION, POSITIONS, prior, varied
from fringeforce.calibration.frame_models import FrameModels
from fringeforce.calibration.light.pattern import Pattern
from fringeforce.calibration.residual_length import (
    UNLIKELY,
    ResidualLengths,
    alone,
    correlation_lengths,
)
from fringeforce.calibration.round_contacts import under_radii
from fringeforce.calibration.shared_unknowns import Expected, State
from fringeforce.calibration.strain_phase import FrameContacts, StrainPhases
from fringeforce.calibration.timed_loads import TimedLoads
from fringeforce.design.strip import Sensor
from fringeforce.estimation.frame_exposure import expose, node_phase, positive
from fringeforce.estimation.shared_fit import Eliminated
from fringeforce.models.as_built import PLACEMENT, WIDTH
from fringeforce.models.strip import characterize
from fringeforce.models.strip_nodes import FIELD_SAMPLES, SPLINE_SAMPLES
from fringeforce.optics.camera import least_phase

SHIFTS = np.arange(-2.0, 2.1, 0.25)
"""Shifts of the camera that are tried first [mm]."""
ENTRY_STEP = 0.1, 0.03
"""Steps of an entry to both sides of the first design and of later ones."""
STEADY = 0.05
"""Root-mean-square change of a pattern, in its own deviations, below which it stays."""
SMOOTH_DARK = 5
"""Degree of the polynomial along the frame that is not pattern but uneven darkness."""
FURTHEST = float(np.log(4.0))
"""Logarithm of a layer's thickness over that of the drawing beyond which it is another sensor: thin
layers are solved on many small elements, and one as thick as the strip is long not at all."""
STEADY_LENGTHS = 0.05
"""Change of the probabilities of the residual's lengths, their total variation, below which they
stay."""
GRID = 1e-4
"""Step of places about which contacts are expanded, a part of how far that reaches [m]."""


class StripSearch(BenchSearch):
    """Where the search for the most probable strip is."""

    sensor: Sensor
    bench: Bench
    drawn = {"place": PLACEMENT, "width": WIDTH}

    def __init__(
        self,
        sensor: Sensor,
        levels: Array,
        loads: BenchLoads | TimedLoads,
        paths: tuple[str, ...],
        references: Mapping[str, Array],
        load_cell: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self.mechanical = tuple(path for path in paths if path != POSITIONS)
        self.centre = np.zeros(len(self.mechanical))
        super().__init__(sensor, levels, loads, paths, references, load_cell)
        self._strained()
        self.length_weights = np.eye(1, len(correlation_lengths(sensor)))[0]
        self.light = self.bench.template
        self.pattern = self._first_pattern(references) if references else None

    def moved(self, models: FrameModels) -> Array:
        """`BenchFit.moved`; readings take contacts where they are drawn unless told otherwise."""
        free = self.unstated()
        drawn = {
            name: STILL
            for name, path in (("place", PLACEMENT), ("width", WIDTH))
            if path not in self.stated
        }
        free = replace(free, expected=replace(free.expected, sizes=free.expected.sizes | drawn))
        total = np.zeros((self.bench.at.size,) * 2)
        for f, terms in enumerate(free.terms(self.state, models)):
            loads = 2 * int((self.which[f] >= 0).sum())
            if self.kept[f] and loads:
                one = Eliminated.of(terms)
                moved = np.linalg.solve(
                    np.linalg.cholesky(one.spread)[:loads, :loads], one.response[:loads]
                )
                total[np.ix_(one.which, one.which)] += moved.T @ moved
        return total

    def load(self, loads: BenchLoads) -> None:
        """Take the loads of all frames, and the places about which contacts are expanded."""
        loads, shapes = under_radii(self.sensor, loads)
        self.loads = self.with_references(loads)
        places = np.where(loads.present, loads.places, np.nan)
        self.places, which, beside, self.shapes = distinct(places, GRID, shapes)
        self.which = np.concatenate([which, np.full((self.lit, which.shape[1]), -1)])
        self.beside = np.concatenate([beside, np.zeros((self.lit, which.shape[1]))])

    @cached_property
    def size(self) -> ContactSize:
        """Of the contacts, as first loaded; other delays of a list of loads hardly change it."""
        return contact_size(self.sensor, self.loads)

    def own_places(self, contacts: int) -> tuple[slice, int, float]:
        """Where places of contacts stand among the own unknowns of a frame."""
        return slice(2 * contacts, 3 * contacts), 4 * contacts + LAMP, self.size.place

    def written_changes(self) -> Iterator[tuple[Array, Array, float]]:
        """What unknowns of the list of loads change of it; places of tactels come first."""
        if POSITIONS in self.paths:
            tactels, numbers = self.sensor.tactels, self.loads.tactels
            named = np.full(self.which.shape, -1) if numbers is None else numbers
            for number in range(tactels.count):
                places = np.where(named == number, tactels.pitch, 0.0)
                yield np.zeros_like(self.loads.forces), places, DEVIATION["position"]
        yield from super().written_changes()

    def first_bench(self) -> Bench:
        """The bench as it is drawn and written down."""
        sensor, loads = self.sensor, self.loads
        contacts = contact_phases(
            sensor,
            self.mechanical,
            self.centre,
            self.places,
            self.size,
            ENTRY_STEP[0],
            shapes=self.shapes,
        )
        template, places, lamp = frame_template(sensor, contacts)
        moves, self.written = self.moves()
        strain = None
        if sensor.transducer.strain == "finite":
            strain = StrainPhases.none(self.centre, len(self.levels), len(contacts.grid))
        light = len(template.brightness) // 2  # as many modes of the offset as of the amplitude
        leaks = len(template.leaks)
        at = parts(
            len(self.centre), 0, len(template.fields), light, light, leaks, len(self.written)
        )
        return Bench(
            self.levels,
            self.which,
            self.beside,
            loads,
            contacts,
            template,
            places,
            at,
            lamp,
            self.averaged,
            self.turned,
            moves,
            strain=strain,
        )

    def _first_pattern(self, references: Mapping[str, Array]) -> Pattern:
        dark, template, variance = None, self.bench.template, self.bench.template.variance
        if "dark" in references:
            mean = references["dark"].mean(axis=0).reshape(self.channels, -1)
            along, sound = np.linspace(-1, 1, mean.shape[1]), self.sound.reshape(mean.shape)
            smooth = [
                np.polynomial.Polynomial.fit(along[own], line[own], SMOOTH_DARK)(along)
                for line, own in zip(mean, sound, strict=True)
            ]
            dark = np.where(sound, mean - smooth, 0.0).ravel()
            variance = template.variance / len(references["dark"])
        amplitude = float(np.mean(template.amplitude))
        return Pattern.first(self.levels.shape[1], amplitude, dark, variance)

    def expected(self) -> Expected:
        """What is expected before the frames are seen."""
        at, sizes = self.bench.at, self.sizes
        deviations = np.ones(at.size)
        deviations[at.own("design")] = prior(self.sensor, self.mechanical)
        deviations[at.own("written")] = self.written
        deviations[at.own("camera")] = SHIFT, SCALE
        for name, first in SMOOTH.items():
            deviations[at.own(name)][self.channels * first :] = sizes[name]
        scatter = {name: sizes[name] for name in GROUPS}
        scatter["normal"] *= DOUBT["normal"]
        scatter["tangential"] *= DOUBT["tangential"]
        return Expected(1 / np.square(deviations), scatter)

    def posterior(self, shares: Array, heat: float) -> BenchPosterior:
        """The posterior with what scatters as found so far; parameters as of `BenchPosterior`."""
        return BenchPosterior(self.bench, self.expected(), shares, heat)

    def mask(self) -> None:
        """Leave out pixels that do not see the strip, or do not follow the light."""
        sensor, shared = self.sensor, self.state.shared
        positions = self.bench.positions(shared, sensor.pixel_positions)
        self.seen = np.tile(see_strip(sensor, positions), self.channels)
        frames = np.where(self.sound & self.seen, self.levels, np.nan)
        self.bench = replace(self.bench, frames=frames)

    def peaks(self) -> Array:
        """Largest phase of every frame [rad]."""
        models = self.posterior(np.ones(len(self.levels)), 1.0).models(self.state.shared)
        return np.array(
            [
                np.abs(
                    node_phase(models.of_frame(f), models.unknowns(f, own, self.state.shared))
                ).max()
                for f, own in enumerate(self.state.own)
            ]
        )

    def again(self, levels: Array, loads: BenchLoads) -> StripSearch:
        """A new search of the same strip with other frames or loads."""
        small = self.sensor.small_strain  # rough fits need no more
        return StripSearch(small, levels, loads, self.paths, {})

    def relinearised(self) -> bool:
        """Take the loads at the delay, and expand about the design, that were found."""
        delayed = self.delayed()
        if self.far():
            self._recentre()
        return delayed | self._strained()

    def begin(self) -> None:
        """The shift of the camera under which calm frames fit best."""
        self.mask()
        posterior = self.posterior(self.calm(STAGES[0]).astype(float), HEATS[0])
        camera, losses, trials = self.bench.at.own("camera").start, [], []
        for shift in SHIFTS:
            shared = self.state.shared.copy()
            shared[camera] = shift
            trials.append(replace(self.state, shared=shared))
            losses.append(posterior.loss(trials[-1], posterior.models(shared))[0])
        self.state = trials[int(np.argmin(losses))]

    def allowed(self, shared: Array, step: Array) -> Array:
        """A step that leaves layers as thin and as thick as they are solved."""
        own = np.flatnonzero([path.endswith(".thickness") for path in self.mechanical])
        found = step.copy()
        found[own] = np.clip(shared[own] + step[own], -FURTHEST, FURTHEST) - shared[own]
        return found

    def free_columns(self) -> None:
        """Let the columns of tactels differ from those of the design."""
        made = characterize(varied(self.sensor, self.mechanical, self.centre))
        columns = Columns.of(made)
        at = self.bench.at.resized("height", columns.count).resized("slope", columns.count)
        self.bench = replace(self.bench, columns=columns, at=at)
        added = np.arange(at.height, at.residual)
        kept = np.delete(np.arange(at.size), added)
        shared, information = np.zeros(at.size), np.diag(self.expected().precision)
        shared[kept], information[np.ix_(kept, kept)] = self.state.shared, self.information
        self.state, self.information = replace(self.state, shared=shared), information

    def far(self) -> bool:
        """Whether the design that was found is far from that about which mechanics are solved."""
        at = self.bench.at
        own = at.own("design")
        design = self.state.shared[own]
        off = design - self.centre
        # in deviations of all values together: what frames do not tell apart has wide ones alone
        squared = off @ np.linalg.solve(inverse(self.information)[own, own], off)
        return bool(squared > SETTLED**2 and (np.abs(off) > NEAR_DESIGN).any())

    def _recentre(self) -> None:
        """Solve the mechanics about the design that was found."""
        self.centre = self.state.shared[self.bench.at.own("design")].copy()
        contacts = contact_phases(
            self.sensor,
            self.mechanical,
            self.centre,
            self.places,
            self.size,
            ENTRY_STEP[1],
            self.bench.contacts,
            self.shapes,
        )
        template = self.bench.template._replace(mixing=contacts.mixing)
        self.bench = replace(self.bench, contacts=contacts, template=template)

    def _strained(self) -> bool:
        """Solve frames under large strain at the contacts that were found; whether any moved."""
        before, plain = self.bench.strain, self.posterior(np.ones(len(self.levels)), 1.0)
        if before is None:
            return False
        narrow, depth = self.bench.template.narrow, self.sensor.transducer.compliant.thickness
        contacts = []
        for f, own in enumerate(self.state.own):
            places, normal, tangential, widths = plain.table(f, own).T
            # none at all: neither stated nor found yet
            widths = np.where(widths == 0, depth, positive(widths, narrow)[0])
            contacts.append(FrameContacts(places, widths, np.column_stack([normal, tangential])))
        noise = least_phase(self.sensor)
        strain = before.about(
            self.sensor,
            self.mechanical,
            self.state.shared[self.bench.at.own("design")],
            self.bench.contacts.grid,
            contacts,
            SETTLED * noise,
        )
        self.bench = replace(self.bench, strain=strain)
        return strain.solved != before.solved

    def reload(self, alike: Mask) -> None:
        """Take other loads, as written down, but for frames with contacts like those before."""
        contacts = contact_phases(
            self.sensor,
            self.mechanical,
            self.centre,
            self.places,
            self.size,
            ENTRY_STEP[1],
            shapes=self.shapes,
        )
        moves, _ = self.moves()
        template = self.bench.template._replace(mixing=contacts.mixing)
        self.bench = replace(
            self.bench,
            which=self.which,
            beside=self.beside,
            loads=self.loads,
            contacts=contacts,
            template=template,
            moves=moves,
        )
        fresh = self.posterior(np.ones(len(self.levels)), 1.0).start(self.state.shared)
        own = [
            old if kept else new
            for old, new, kept in zip(self.state.own, fresh.own, alike, strict=True)
        ]
        self.state = replace(fresh, own=own)

    def repattern(self) -> bool:
        """The likeliest pattern of the pixels; whether it changed."""
        if self.pattern is None:
            return False
        before = self.pattern
        models = self.posterior(self.kept.astype(float), 1.0).models(self.state.shared)
        used = self.alive & self.seen
        self.pattern = before.improved(models, self.state, self.levels, self.kept, used)
        amplitude, offset = self.pattern.noise.levels
        light = self.light
        template = self.bench.template._replace(
            amplitude=light.amplitude + amplitude, offset=light.offset + offset
        )
        self.bench = replace(self.bench, template=template)
        return self.pattern.moved(before) > STEADY

    @cached_property
    def lengths(self) -> ResidualLengths:
        """Correlation lengths that the residual may have."""
        places = self.bench.places[:: SPLINE_SAMPLES // FIELD_SAMPLES // THINNED]
        nodes = len(self.bench.template.fixed)
        return ResidualLengths.of(correlation_lengths(self.sensor), places, nodes)

    def relength(self) -> bool:
        """Average over the residual's correlation lengths; whether their probabilities changed.

        To second order about what was found.  A residual that hardly shows keeps the drawing's.
        """
        lengths, at, expected = self.lengths, self.bench.at, self.expected()
        if len(lengths.roots) == 1:
            return False
        fine, shared = self._with_fields(lengths.fields)
        flat = Expected(np.zeros(fine.at.size), expected.sizes)
        posterior = BenchPosterior(fine, flat, self.kept.astype(float))
        state = State(shared, self.state.own)
        told = posterior.eliminated(state, posterior.models(shared))
        gradient, information = posterior.normal(state, told)
        own, rest = fine.at.own("residual"), np.delete(expected.precision, at.own("residual"))
        weighed = lengths.weighed(*alone(information, information @ shared - gradient, own, rest))
        moved = np.abs(weighed.weights - self.length_weights).sum() / 2
        if weighed.gain < -2 * np.log(UNLIKELY) or moved < STEADY_LENGTHS:
            return False
        modes, size = lengths.averaged(weighed)
        modes *= FIELDS["residual"]
        self.length_weights, self.sizes["residual"] = weighed.weights, size / FIELDS["residual"]
        self.bench, shared = self._with_fields(modes @ lengths.fields)
        self.state = State(shared, self.state.own)
        change = block_diag(np.eye(own.start), modes.T, np.eye(fine.at.size - own.stop))
        self.information = change.T @ information @ change + self.expected().information
        return True

    def _with_fields(self, fields: Array) -> tuple[Bench, Array]:
        """The bench with other modes of the residual, shape (r, m), and its shared unknowns."""
        at, shared, template = self.bench.at, self.state.shared, self.bench.template
        residual = shared[at.own("residual")] @ template.fields
        nearest = np.linalg.lstsq(fields.T, residual, rcond=None)[0]
        shared = np.concatenate([shared[: at.residual], nearest, shared[at.bright :]])
        template = template._replace(fields=np.ascontiguousarray(fields))
        at = at.resized("residual", len(fields))
        return replace(self.bench, template=template, at=at), shared

    def residuals(self, models: FrameModels) -> Array:
        """Grey levels less those expected, in units of the noise, shape (F, P)."""
        found = []
        for f, own in enumerate(self.state.own):
            model = models.of_frame(f)
            level = expose(model, models.unknowns(f, own, self.state.shared))[0]
            found.append((self.levels[f] - level) / np.sqrt(model.variance))
        return np.array(found)
