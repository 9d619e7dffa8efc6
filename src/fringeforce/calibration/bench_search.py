"""The search for the most probable sensor of a bench: descents, sizes, what is left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.special import fdtrc

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.measured import INTERVAL
from fringeforce.calibration.bench_expectation import (
    DOUBT,
    ERRORS,
    FIELDS,
    SCALE,
    SHIFT,
    SMOOTH,
    contact_size,
    frame_template,
)
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.bench_posterior import (
    GROUPS,
    Bench,
    BenchPosterior,
    Expected,
    FrameModels,
    State,
    parts,
)
from fringeforce.calibration.checks import misfitting_pixels
from fringeforce.calibration.columns import Columns
from fringeforce.calibration.contact_phase import contact_phases, distinct
from fringeforce.calibration.design_entries import DEVIATION, POSITIONS, prior, varied
from fringeforce.calibration.light.pattern import Pattern
from fringeforce.calibration.timed_loads import TimedLoads
from fringeforce.design.strip import Sensor
from fringeforce.estimation.bad_pixels import stuck_pixels
from fringeforce.estimation.frame_exposure import expose, node_phase
from fringeforce.estimation.levenberg_marquardt import Expansion, Stop, minimise
from fringeforce.estimation.residual_test import FALSE_ALARM, square_limit
from fringeforce.estimation.shared_fit import Eliminated
from fringeforce.models.as_built import PLACEMENT, WIDTH
from fringeforce.models.strip import characterize
from fringeforce.optics.camera import noise_variance

STAGES = (3.0, 10.0, np.inf)
"""Largest phase of the frames that enter, stage by stage: few fringes bear a rough model [rad]."""
HEATS = (100.0, 10.0, 1.0)
"""Factors on the variance of the noise in the first stage: valleys of a rough model are no valleys
there."""
SHIFTS = np.arange(-2.0, 2.1, 0.25)
"""Shifts of the camera that are tried first [mm]."""
STEPS, SETTLING, ROUNDS = 12, 3, 10
"""Most steps of a descent, of the contacts after each, and most rounds of the last stage."""
CLOSE, NEAR = 0.5, 5.0
"""Falls of the loss that a step promises below which it need not be evaluated, and below which it
is the last: twice the logarithm of a probability, in a space of some thirty unknowns."""
KEPT = 0.5
"""Share of the promised fall of the loss that a step must keep if contacts need not settle."""
SUSPECT, WEIGHINGS, REWEIGHED = 3.0, 3, 0.1
"""Times the usual misfit beyond which a frame loses weight, how often frames are weighed, and the
change of a weight that is worth another time."""
ENTRY_STEP = 0.1, 0.03
"""Steps of an entry to both sides of the first design and of later ones."""
SETTLED = 0.1
"""Change of an unknown, in its standard deviations, below which a solution is near enough."""
NEAR_DESIGN = 1e-3
"""Change of the logarithm of a value that expansions bear, however well it is known."""
CHANGED = 0.1
"""Relative change of a size below which it is found."""
FEWEST_ASIDE, REFITS = 4, 3
"""Frames to put aside at least, for fewer tell nothing of a share, and rounds with them."""
UNSTATED = 300.0
"""Times the usual error of forces that stands for forces nobody states."""
STILL = 1e-3
"""Size of what does not scatter."""
DELAY = 1e-3
"""Unit of a delay, over which loads are differentiated [s]."""
LOST = 0.05
"""Share that frames tell of what scatters below which noise hides it: it is as good as none."""
LARGEST = 30.0
"""Times its first value that a size can be: a bench that scatters more cannot be explained."""
STEADY = 0.05
"""Root-mean-square change of a pattern, in its own deviations, below which it stays."""
SMOOTH_DARK = 5
"""Degree of the polynomial along the frame that is not pattern but uneven darkness."""
GRID = 1e-4
"""Step of places about which contacts are expanded, a part of how far that reaches [m]."""


class Check(NamedTuple):
    """How frames that were put aside compare with what is written down.

    Attributes
    ----------
    frames, explained : int
        How many there were, and how many of them the model explains under any forces.
    inside, forces : int
        Forces of these that lie within their 95 % intervals, and all.
    """

    frames: int
    explained: int
    inside: int
    forces: int


def inverse(information: Array) -> Array:
    """Covariance of unknowns, from what is known of them."""
    return np.asarray(np.linalg.inv(information), dtype=float)


class Search:
    """Where the search for the most probable sensor is."""

    def __init__(
        self,
        sensor: Sensor,
        levels: Array,
        loads: BenchLoads | TimedLoads,
        paths: tuple[str, ...],
        references: Mapping[str, Array],
        load_cell: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        lit = {kind: references[kind] for kind in ("unloaded", "bright") if kind in references}
        self.levels = np.concatenate([levels, *[rows.mean(axis=0)[None] for rows in lit.values()]])
        self.averaged = np.append(np.ones(len(levels)), [len(rows) for rows in lit.values()])
        self.turned = np.append(np.zeros(len(levels)), [np.pi * (k == "bright") for k in lit])
        self.sensor, self.paths, self.load_cell = sensor, paths, load_cell
        self.mechanical = tuple(path for path in paths if path != POSITIONS)
        self.timed = loads if isinstance(loads, TimedLoads) else None
        self.delay = 0.0 if self.timed is None else self.timed.delay
        self.lit = len(lit)
        levels = self.levels
        self.stated = sensor.tolerances
        self.alive = ~stuck_pixels(levels, sensor.camera.noise)
        self.sound = self.alive.copy()
        self.wanted = np.ones(len(levels), dtype=bool)
        self.kept = self.wanted.copy()
        self.checked = Check(0, 0, 0, 0)
        self.aside: list[tuple[float, ...]] = []
        self.sizes = dict.fromkeys((*GROUPS, *FIELDS), 1.0) | ERRORS
        self.changes = dict.fromkeys(self.sizes, 0.0)
        self.scattered = dict[str, Array]()
        self.lost = dict.fromkeys(self.sizes, False)
        self.centre = np.zeros(len(self.mechanical))
        self.size = contact_size(sensor)
        self._load(loads if isinstance(loads, BenchLoads) else loads.at(self.delay))
        self.bench = self._bench()
        self.light = self.bench.template
        self.pattern = self._first_pattern(references) if references else None
        shared = np.zeros(self.bench.at.size)
        self.state = self.posterior(np.ones(len(levels)), 1.0).start(shared)
        self.told: list[Eliminated] = []
        self.information = np.eye(len(shared))

    def put_aside(self, every: int) -> None:
        """Put every so many loaded frames aside, if enough are left."""
        loaded = np.flatnonzero((self.which >= 0).any(axis=1))
        if every > 1 and len(loaded) >= every * FEWEST_ASIDE:
            self.wanted[loaded[every - 1 :: every]] = False
            self.kept &= self.wanted

    def check(self) -> None:
        """Compare what frames that were put aside tell of their forces with what is written.

        Their contacts are found with forces that nobody states; then they are taken in.
        """
        aside = np.flatnonzero(~self.wanted)
        free = self.unstated()
        plain = self.posterior(np.ones(len(self.levels)), 1.0)
        models = free.models(self.state.shared)
        state = free.settled(self.state, models, STEPS)
        _, squares, counts = free.loss(state, models)
        covariance, told = inverse(self.information), list(free.terms(state, models))
        inside = total = explained = 0
        for f in aside.tolist():
            if squares[f] > square_limit(counts[f]) * self._usual:
                self.aside.append((f, 0, np.nan, np.nan))
                continue
            explained += 1
            count = 2 * int((self.which[f] >= 0).sum())
            off = (state.own[f] - plain.mean(f, state.shared))[:count]
            unsure = Eliminated.of(told[f]).variances(covariance)[:count]
            unsure = unsure + 1 / plain.precision(f)[:count]
            inside += int((np.abs(off) < INTERVAL * np.sqrt(unsure)).sum())
            total += count
            stds = np.sqrt(unsure)
            self.aside += [(f, j % 2, off[j], stds[j]) for j in range(count)]
        self.checked = Check(len(aside), explained, inside, total)
        self.wanted[:] = True
        self.kept[aside] = True

    def unstated(self) -> BenchPosterior:
        """The posterior if nobody stated the forces."""
        plain = self.posterior(np.ones(len(self.levels)), 1.0)
        sizes = plain.expected.sizes | {"normal": UNSTATED, "tangential": UNSTATED}
        return replace(plain, expected=replace(plain.expected, sizes=sizes))

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

    def _load(self, loads: BenchLoads) -> None:
        """Take the loads of all frames; references have none."""
        lit = np.zeros(self.lit, dtype=int)
        self.loads = loads.rows(np.append(np.arange(len(loads)), lit))
        places = np.where(loads.present, loads.places, np.nan)
        self.places, which, beside = distinct(places, GRID)
        self.which = np.concatenate([which, np.full((self.lit, which.shape[1]), -1)])
        self.beside = np.concatenate([beside, np.zeros((self.lit, which.shape[1]))])

    def _moves(self) -> tuple[tuple[Array, ...], Array]:
        """What unknowns of the list of loads change in every frame, and their deviations."""
        columns, deviations = [], []
        present, size = self.which >= 0, self.size
        if POSITIONS in self.paths:
            tactels = self.sensor.tactels
            numbers = (
                np.full(present.shape, -1) if self.loads.tactels is None else self.loads.tactels
            )
            for number in range(tactels.count):
                places = np.where(numbers == number, tactels.pitch / size.place, 0.0)
                columns.append((np.zeros((*present.shape, 2)), places))
                deviations.append(DEVIATION["position"])
        for component in range(2):
            own = np.eye(2)[component] * present[..., None]
            changes = np.where(present[..., None], self.loads.forces, 0.0) * own, own
            for change, std in zip(changes, self.load_cell, strict=True):
                if std:
                    columns.append((change, np.zeros(present.shape)))
                    deviations.append(std)
        if self.timed is not None:
            ahead, behind = (self.timed.at(self.delay + step) for step in (DELAY, -DELAY))
            both = ahead.present & behind.present
            moved = np.where(both, ahead.places - behind.places, 0.0) / 2 / size.place
            forces = np.where(both[..., None], ahead.forces - behind.forces, 0.0) / 2
            more = np.zeros((self.lit, present.shape[1]))
            columns.append(
                (
                    np.concatenate([forces, more[..., None] * [0.0, 0.0]]),
                    np.concatenate([moved, more]),
                )
            )
            deviations.append(self.timed.unsure / DELAY)
        found = []
        for f, own in enumerate(present):
            k = int(own.sum())
            moves = np.zeros((4 * k + 2, len(columns)))
            for column, (forces, places) in enumerate(columns):
                moves[: 2 * k, column] = forces[f, own].ravel()
                moves[2 * k : 3 * k, column] = places[f, own]
            found.append(moves)
        return tuple(found), np.array(deviations)

    def _bench(self) -> Bench:
        sensor, loads = self.sensor, self.loads
        contacts = contact_phases(
            sensor, self.mechanical, self.centre, self.places, self.size, ENTRY_STEP[0]
        )
        template, places, lamp = frame_template(sensor, contacts)
        moves, self.written = self._moves()
        light = len(template.brightness) // 2  # as many modes of the offset as of the amplitude
        at = parts(len(self.centre), 0, len(template.fields), light, light, len(self.written))
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
        )

    def _first_pattern(self, references: Mapping[str, Array]) -> Pattern:
        dark, variance, template = None, 1.0, self.bench.template
        if "dark" in references:
            mean = references["dark"].mean(axis=0)
            along = np.linspace(-1, 1, len(mean))
            smooth = np.polynomial.Polynomial.fit(along[self.sound], mean[self.sound], SMOOTH_DARK)
            dark = np.where(self.sound, mean - smooth(along), 0.0)
            variance = noise_variance(self.sensor.camera) / len(references["dark"])
        amplitude = float(np.mean(template.amplitude))
        return Pattern.first(self.levels.shape[1], amplitude, dark, variance)

    def _expected(self) -> Expected:
        at, sizes = self.bench.at, self.sizes
        deviations = np.ones(at.size)
        deviations[at.own("design")] = prior(self.sensor, self.mechanical)
        deviations[at.own("written")] = self.written
        deviations[at.own("camera")] = SHIFT, SCALE
        for name, first in SMOOTH.items():
            deviations[at.own(name)][first:] = sizes[name]
        scatter = {name: sizes[name] for name in GROUPS}
        scatter["normal"] *= DOUBT["normal"]
        scatter["tangential"] *= DOUBT["tangential"]
        return Expected(1 / np.square(deviations), scatter)

    def posterior(self, shares: Array, heat: float) -> BenchPosterior:
        """The posterior with what scatters as found so far; parameters as of `BenchPosterior`."""
        return BenchPosterior(self.bench, self._expected(), shares, heat)

    def _mask(self) -> None:
        """Leave out pixels that do not see the strip, or do not follow the light."""
        sensor, shared = self.sensor, self.state.shared
        positions = self.bench.positions(shared, sensor.pixel_positions)
        margin = 2 * sensor.transducer.length / sensor.camera.pixels
        self.seen = np.abs(positions) < sensor.transducer.length / 2 - margin
        frames = np.where(self.sound & self.seen, self.levels, np.nan)
        self.bench = replace(self.bench, frames=frames)

    def _peaks(self) -> Array:
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

    def misfit(self) -> float:
        """Median over the frames of the reduced chi-square, contacts included."""
        posterior = self.posterior(np.ones(len(self.levels)), 1.0)
        models = posterior.models(self.state.shared)
        _, squares, counts = posterior.loss(self.state, models)
        return float(np.median(squares / np.maximum(counts, 1.0)))

    def calm(self, limit: float) -> Mask:
        """Frames of small phases, but never less than the calmest quarter."""
        peaks = self._peaks()
        return self.kept & (peaks <= max(limit, float(np.quantile(peaks, 0.25))))

    def find_shift(self) -> None:
        """The shift of the camera under which calm frames fit best."""
        self._mask()
        posterior = self.posterior(self.calm(STAGES[0]).astype(float), HEATS[0])
        camera, losses, trials = self.bench.at.own("camera").start, [], []
        for shift in SHIFTS:
            shared = self.state.shared.copy()
            shared[camera] = shift
            trials.append(replace(self.state, shared=shared))
            losses.append(posterior.loss(trials[-1], posterior.models(shared))[0])
        self.state = trials[int(np.argmin(losses))]

    def descend(self, few: Mask, heat: float) -> None:
        """Minimise the loss of some frames; those that fit badly lose weight."""
        self._mask()
        before = np.full(len(few), np.inf)
        for _ in range(WEIGHINGS):
            posterior = self.posterior(few.astype(float), heat)
            models = posterior.models(self.state.shared)
            _, squares, counts = posterior.loss(self.state, models)
            misfit = squares / np.maximum(counts, 1.0)
            usual = float(np.median(misfit[few]))
            shares = few * np.minimum(1.0, SUSPECT * usual / np.maximum(misfit, 1e-9))
            if np.abs(shares - before).max() < REWEIGHED:
                break
            self.state = self._climbed(replace(posterior, shares=shares))
            before = shares

    def _climbed(self, posterior: BenchPosterior) -> State:
        counted = posterior.shares > 0  # the others follow to first order, and settle at the end

        def expand(state: State) -> Expansion[State]:
            models = posterior.models(state.shared)
            self.told = posterior.eliminated(state, models)
            told = self.told
            gradient, self.information = posterior.normal(state, told)
            information = self.information

            def ahead(step: Array) -> tuple[State, float]:
                there = posterior.models(state.shared + step)
                reached = posterior.within(state.moved(step, told))
                found = posterior.loss(reached, there)[0]
                if loss - found < KEPT * -step @ (2 * gradient + information @ step):
                    reached = posterior.settled(reached, there, SETTLING, counted)
                    found = posterior.loss(reached, there)[0]
                return reached, found

            loss = posterior.loss(state, models)[0]
            return Expansion(loss, gradient, lambda: information, ahead)

        found = minimise(self.state, expand, STEPS, Stop(close=CLOSE, near=NEAR))
        moved = found.place.moved(found.step, self.told)
        models = posterior.models(moved.shared)
        moved = posterior.settled(moved, models, STEPS, ~counted)
        return posterior.settled(moved, models, SETTLING, counted)

    def free_columns(self) -> None:
        """Let the columns of tactels differ from those of the design."""
        made = characterize(varied(self.sensor, self.mechanical, self.centre))
        columns, before = Columns.of(made), self.bench.at
        lengths = np.diff(before).tolist()
        at = parts(lengths[0], columns.count, *lengths[4:7], lengths[9])
        self.bench = replace(self.bench, columns=columns, at=at)
        added = np.arange(at.height, at.residual)
        kept = np.delete(np.arange(at.size), added)
        shared, information = np.zeros(at.size), np.diag(self._expected().precision)
        shared[kept], information[np.ix_(kept, kept)] = self.state.shared, self.information
        self.state, self.information = replace(self.state, shared=shared), information

    def improve(self) -> bool:
        """One round of the last stage; whether nothing changed any more."""
        kept, sizes, sound = self.kept.copy(), dict(self.sizes), self.sound.copy()
        moved = self._delayed() | self._recentred()
        self.descend(self.kept, 1.0)
        self._resize()
        moved |= self._repattern()
        self._leave_out()
        same = np.array_equal(kept, self.kept) and np.array_equal(sound, self.sound)
        still = all(
            self.lost[name] or abs(np.log(self.sizes[name] / sizes[name])) < CHANGED
            for name in sizes
        )
        return same and still and not moved

    def _recentred(self) -> bool:
        """Solve the mechanics about the design that was found, if that is not near enough."""
        at = self.bench.at
        own = at.own("design")
        design = self.state.shared[own]
        off = design - self.centre
        # in deviations of all values together: what frames do not tell apart has wide ones alone
        squared = off @ np.linalg.solve(inverse(self.information)[own, own], off)
        if squared <= SETTLED**2 or (np.abs(off) <= NEAR_DESIGN).all():
            return False
        self.centre = design.copy()
        contacts = contact_phases(
            self.sensor,
            self.mechanical,
            design,
            self.places,
            self.size,
            ENTRY_STEP[1],
            self.bench.contacts,
        )
        template = self.bench.template._replace(mixing=contacts.mixing)
        self.bench = replace(self.bench, contacts=contacts, template=template)
        return True

    def _delayed(self) -> bool:
        """Take the loads at the delay that was found, if it is another one."""
        if self.timed is None:
            return False
        own = self.bench.at.own("written").stop - 1
        step = float(self.state.shared[own]) * DELAY
        unsure = float(np.sqrt(np.linalg.inv(self.information)[own, own])) * DELAY
        if abs(step) < SETTLED * unsure:
            return False
        self.delay += step
        before = self.which
        self._load(self.timed.at(self.delay))
        contacts = contact_phases(
            self.sensor, self.mechanical, self.centre, self.places, self.size, ENTRY_STEP[1]
        )
        moves, _ = self._moves()
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
        shared = self.state.shared.copy()
        shared[own] = 0.0
        fresh = self.posterior(np.ones(len(self.levels)), 1.0).start(shared)
        same = (before >= 0).sum(axis=1) == (self.which >= 0).sum(axis=1)
        own_unknowns = [
            old if alike else new
            for old, new, alike in zip(self.state.own, fresh.own, same, strict=True)
        ]
        self.state = State(shared, own_unknowns)
        return True

    def _repattern(self) -> bool:
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

    def _resize(self) -> None:
        """The sizes under which the frames are most probable, of what nobody states."""
        covariance = inverse(self.information)
        scatter = self.scatter(self.told, covariance) | self.smooth(covariance)
        for name, (square, freedom, count) in scatter.items():
            self._scale(name, square, freedom, count)

    def smooth(self, covariance: Array) -> dict[str, tuple[float, float, float]]:
        """The same as `_scatter` of what is smooth along the strip."""
        precision, at, found = self._expected().precision, self.bench.at, {}
        for name, first in SMOOTH.items():
            own = slice(at.own(name).start + first, at.own(name).stop)
            square = float(precision[own] @ np.square(self.state.shared[own]))
            freedom = float((1 - precision[own] * np.diag(covariance)[own]).sum())
            found[name] = (square, freedom, float(own.stop - own.start))
        return found

    def scatter(
        self, told: list[Eliminated], covariance: Array
    ) -> dict[str, tuple[float, float, float]]:
        """What scatters and is stated nowhere: sum of squares, and what frames tell of how many."""
        self.scattered = self._by_frame(told, covariance)
        found = {}
        for name, rows in self.scattered.items():
            square, free, count = rows[self.kept, :3].sum(axis=0)
            found[name] = float(square), float(free), float(count)
        return found

    def _by_frame(self, told: list[Eliminated], covariance: Array) -> dict[str, Array]:
        """The same of each frame, then both sums with what somebody states too, shape (F, 5)."""
        posterior = self.posterior(self.kept.astype(float), 1.0)
        found = {name: np.zeros((len(told), 5)) for name in GROUPS}
        for f, one in enumerate(told):
            precision, variances = posterior.precision(f), one.variances(covariance)
            squares = precision * np.square(
                self.state.own[f] - posterior.mean(f, self.state.shared)
            )
            free = 1 - precision * variances
            for name, rows in found.items():
                own = posterior.group(name, f)
                unstated = own[posterior.free(name, f)]
                if {"place": PLACEMENT, "width": WIDTH}.get(name) in self.stated:
                    unstated = own[:0]
                rows[f, :3] = squares[unstated].sum(), free[unstated].sum(), len(unstated)
                rows[f, 3:] = squares[own].sum(), free[own].sum()
        return found

    def _scale(self, name: str, square: float, freedom: float, count: float) -> None:
        """Give one size its likeliest value, unless nothing tells of it."""
        self.lost[name] = freedom <= LOST * count
        if freedom > 1e-6:
            change = float(np.log(max(square, 1e-12) / freedom)) / 2
            # what is as good as none shrinks by much the same share in every round: twice as fast
            steady = -1 < min(change, self.changes[name]) < max(change, self.changes[name]) < 0
            self.changes[name] = change
            size = self.sizes[name] * float(np.exp((1 + steady) * change))
            self.sizes[name] = min(size, LARGEST)

    def _leave_out(self) -> None:
        """Leave out frames and pixels that contradict the others."""
        posterior = self.posterior(self.kept.astype(float), 1.0)
        models = posterior.models(self.state.shared)
        _, squares, counts = posterior.loss(self.state, models)
        excess = squares - counts
        spread = np.abs(excess) / np.sqrt(2 * counts)
        usual = max(float(np.median(spread[self.wanted])), 1.0)
        self._usual = max(float(np.median(squares[self.kept] / counts[self.kept])), 1.0)
        limits = np.array([square_limit(count) for count in counts])
        self.kept = self.wanted & (excess <= (limits - counts) * usual) & self._near()
        left = self.residuals(models)[self.kept]
        used = self.alive & self.seen
        self.sound = self.alive.copy()
        self.sound[used] = ~misfitting_pixels(left[:, used])

    def _near(self) -> Mask:
        """Frames that scatter as the others do, as far as chance leaves them.

        What the pixels of a frame tell of a wrong force hardly shows among their squares.  Squares
        of a frame over those of all others, each over what frames tell of, are distributed as F.
        """
        near = np.ones(len(self.levels), dtype=bool)
        for name, rows in self.scattered.items():
            unstated = rows[:, 2].any()
            if self.lost[name] and unstated:
                continue  # as good as none
            square, free = rows[:, 3:].T
            others = rows[self.kept, 3:].sum(axis=0) - rows[:, 3:] * self.kept[:, None]
            told = (free > LOST) & (others[:, 1] > LOST)
            least = np.finfo(float).tiny if unstated else 1.0  # as much as somebody states
            usual = np.maximum(others[told, 0] / others[told, 1], least)
            ratio = square[told] / free[told] / usual
            near[told] &= fdtrc(free[told], others[told, 1], ratio) > FALSE_ALARM
        return near

    def residuals(self, models: FrameModels) -> Array:
        """Grey levels less those expected, in units of the noise, shape (F, P)."""
        found = []
        for f, own in enumerate(self.state.own):
            model = models.of_frame(f)
            level = expose(model, models.unknowns(f, own, self.state.shared))[0]
            found.append((self.levels[f] - level) / np.sqrt(model.variance))
        return np.array(found)
