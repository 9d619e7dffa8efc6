"""The search for the most probable sensor of a bench: descents, sizes, what is left out.

What differs between strips and pads is the model of a frame, and where contacts are expanded.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.special import fdtrc

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.base.errors import InputError
from fringeforce.base.measured import INTERVAL
from fringeforce.calibration.bench_expectation import ERRORS, FIELDS, SMOOTH
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.bench_posterior import GROUPS, BenchPosterior
from fringeforce.calibration.checks import misfitting_pixels
from fringeforce.calibration.light.pattern import Pattern
from fringeforce.calibration.shared_unknowns import Expected, State
from fringeforce.calibration.timed_loads import TimedLoads
from fringeforce.calibration.variance_components import Expanded, Scattering
from fringeforce.estimation.bad_pixels import stuck_pixels
from fringeforce.estimation.levenberg_marquardt import Curvature, Expansion, Stop, minimise
from fringeforce.estimation.residual_test import FALSE_ALARM, square_limit
from fringeforce.estimation.shared_fit import Eliminated, FrameTerms

STAGES = (3.0, 10.0, np.inf)
"""Largest phase of the frames that enter, stage by stage: few fringes bear a rough model [rad]."""
HEATS = (100.0, 10.0, 1.0)
"""Factors on the variance of the noise in the first stage: valleys of a rough model are no valleys
there."""
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
SETTLED = 0.1
"""Change of an unknown, in its standard deviations, below which a solution is near enough."""
DELAY = 1e-3
"""Unit of a delay, over which loads are differentiated [s]."""
NEAR_DESIGN = 1e-3
"""Change of the logarithm of a value that expansions bear, however well it is known."""
FEWEST_ASIDE, REFITS = 4, 3
"""Frames to put aside at least, for fewer tell nothing of a share, and rounds with them."""
STILL = 1e-3
"""Size of what does not scatter."""
UNSTATED = 300.0
"""Times the usual error of forces that stands for forces nobody states."""
LOST = 0.05
"""Share that frames tell of what scatters below which noise hides it: it is as good as none."""
LARGEST = 30.0
"""Times its first value that a size can be: a bench that scatters more cannot be explained."""


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


class BenchSearch(ABC):
    """Where the search for the most probable sensor is."""

    sensor: Any
    """The drawing."""
    bench: Any
    """What was measured and how it is modelled."""
    loads: BenchLoads
    """What is written down of all frames."""
    which: Index
    """Not negative where there is a contact, shape (F, k)."""
    delay: float
    """By which a log of the loads is behind the frames [s]."""
    drawn: Mapping[str, str] = {}
    """Groups of what scatters whose size a tolerance of the drawing may state, and its path."""
    steps, weighings = STEPS, WEIGHINGS
    """Most steps of a descent, and how often its frames are weighed."""
    settling = SETTLING
    """Steps of contacts alone where they do not follow the shared unknowns; none if these do."""

    def __init__(
        self,
        sensor: Any,
        levels: Array,
        loads: BenchLoads | TimedLoads,
        paths: tuple[str, ...],
        references: Mapping[str, Array] | None = None,
        load_cell: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        given = references or {}
        lit = {kind: given[kind] for kind in ("unloaded", "bright") if kind in given}
        levels = np.concatenate([levels, *[rows.mean(axis=0)[None] for rows in lit.values()]])
        self.averaged = np.append(
            np.ones(len(levels) - len(lit)), [len(rows) for rows in lit.values()]
        )
        self.turned = np.append(
            np.zeros(len(levels) - len(lit)), [np.pi * (k == "bright") for k in lit]
        )
        self.load_cell, self.lit = load_cell, len(lit)
        self.timed = loads if isinstance(loads, TimedLoads) else None
        self.delay = 0.0 if self.timed is None else self.timed.delay
        self.sensor, self.levels, self.paths = sensor, levels, paths
        self.channels = len(sensor.polariscope.pictures)
        self.pattern: Pattern | None = None
        self.seen: Mask = np.ones(levels.shape[1], dtype=bool)
        self.stated = sensor.tolerances
        self.alive = ~stuck_pixels(levels, sensor.noise)
        self.sound = self.alive.copy()
        self.wanted = np.ones(len(levels), dtype=bool)
        self.kept = self.wanted.copy()
        self.checked = Check(0, 0, 0, 0)
        self.aside: list[tuple[float, ...]] = []
        self.sizes = dict.fromkeys((*GROUPS, *FIELDS), 1.0) | ERRORS
        self.scattered = dict[str, Array]()
        self.resized = True  # whether other sizes are more probable than those before
        self.smoothing = True  # whether the last round found another smoothness of the residual
        self.lost = dict.fromkeys(self.sizes, False)
        self.load(loads if isinstance(loads, BenchLoads) else loads.at(self.delay))
        self.bench = self.first_bench()
        shared = np.zeros(self.bench.at.size)
        self.state = self.posterior(np.ones(len(self.levels)), 1.0).start(shared)
        self.terms: list[FrameTerms] = []  # where the last descent expanded all frames
        self.told: list[Eliminated] = []
        self.about, self.shares = self.state, np.ones(len(self.levels))
        self.information = np.eye(len(shared))

    @abstractmethod
    def load(self, loads: BenchLoads) -> None:
        """Take the loads of all frames, and which contacts there are."""

    @abstractmethod
    def reload(self, alike: Mask) -> None:
        """Take other loads, as written down, but for frames with contacts like those before."""

    @abstractmethod
    def own_places(self, contacts: int) -> tuple[slice, int, float]:
        """Where places of contacts stand among the own unknowns of a frame.

        With the number of these and the unit of places [m].
        """

    @abstractmethod
    def first_bench(self) -> Any:
        """The bench as it is drawn and written down."""

    @abstractmethod
    def posterior(self, shares: Array, heat: float) -> BenchPosterior:
        """The posterior with what scatters as found so far; parameters as of `BenchPosterior`."""

    @abstractmethod
    def begin(self) -> None:
        """Find roughly what no descent finds."""

    @abstractmethod
    def expected(self) -> Expected:
        """What is expected before the frames are seen."""

    @abstractmethod
    def peaks(self) -> Array:
        """Largest phase, or retardance, of every frame [rad]."""

    @abstractmethod
    def residuals(self, models: Any) -> Array:
        """Grey levels less those expected, in units of the noise, shape (F, P)."""

    @abstractmethod
    def relinearised(self) -> bool:
        """Expand about what was found, if that is far; whether anything but expansions changed."""

    @abstractmethod
    def far(self) -> bool:
        """Whether what was found is too far from where models are expanded."""

    @abstractmethod
    def mask(self) -> None:
        """Leave out pixels that do not see the sensor, or do not follow the light."""

    @abstractmethod
    def again(self, levels: Array, loads: BenchLoads) -> BenchSearch:
        """A new search of the same sensor with other frames or loads."""

    def with_references(self, loads: BenchLoads) -> BenchLoads:
        """Loads of all frames; references have none."""
        return loads.rows(np.append(np.arange(len(loads)), np.zeros(self.lit, dtype=int)))

    def written_changes(self) -> Iterator[tuple[Array, Array, float]]:
        """What unknowns of the list of loads change of it, and their deviations.

        Of every one the changes of the forces, shape (F, k, components) [N], and of the places,
        shape (F, k), or (F, k, 2) on a pad [m].
        """
        present, still = self.which >= 0, np.zeros_like(self.loads.places)
        for component in np.eye(self.loads.forces.shape[2]):
            own = component * present[..., None]
            changes = np.where(present[..., None], self.loads.forces, 0.0) * own, own
            for change, std in zip(changes, self.load_cell, strict=True):
                if std:
                    yield change, still, std
        if self.timed is not None:
            ahead, behind = (self.timed.at(self.delay + step) for step in (DELAY, -DELAY))
            both = ahead.present & behind.present
            moved, forces = (
                np.where(both.reshape(*both.shape, *[1] * (a.ndim - 2)), a - b, 0.0) / 2
                for a, b in ((ahead.places, behind.places), (ahead.forces, behind.forces))
            )
            more = [(0, self.lit), (0, 0)]
            yield (
                np.pad(forces, [*more, (0, 0)]),
                np.pad(moved, [*more, *[(0, 0)] * (moved.ndim - 2)]),
                self.timed.unsure / DELAY,
            )

    def moves(self) -> tuple[tuple[Array, ...], Array]:
        """What unknowns of the list of loads change in every frame, and their deviations."""
        changes, found = list(self.written_changes()), []
        for f, own in enumerate(self.which >= 0):
            forces = self.loads.forces.shape[2] * int(own.sum())
            places, size, unit = self.own_places(int(own.sum()))
            moves = np.zeros((size, len(changes)))
            for column, (forced, moved, _) in enumerate(changes):
                moves[:forces, column] = forced[f, own].ravel()
                moves[places, column] = moved[f, own].T.ravel() / unit
            found.append(moves)
        return tuple(found), np.array([std for *_, std in changes])

    def delayed(self) -> bool:
        """Take the loads at the delay that was found, if it is another one."""
        if self.timed is None:
            return False
        own = self.bench.at.own("written").stop - 1
        step = float(self.state.shared[own]) * DELAY
        unsure = float(np.sqrt(np.linalg.inv(self.information)[own, own])) * DELAY
        if abs(step) < SETTLED * unsure:
            return False
        self.delay += step
        before = (self.which >= 0).sum(axis=1)
        self.load(self.timed.at(self.delay))
        shared = self.state.shared.copy()
        shared[own] = 0.0
        self.state = replace(self.state, shared=shared)
        self.reload(before == (self.which >= 0).sum(axis=1))
        return True

    def repattern(self) -> bool:
        """The likeliest pattern of the pixels; whether it changed."""
        return False

    def relength(self) -> bool:
        """How smooth the residual is, as frames tell; whether it changed."""
        return False

    def free_columns(self) -> None:
        """Let the columns of tactels differ from those of the design."""
        raise InputError("columns=True corrects the columns of strips; leave it out.")

    def moved(self, models: Any) -> Array:
        """`BenchFit.moved`; nothing where columns have no errors."""
        return np.zeros((self.bench.at.size,) * 2)

    def put_aside(self, every: int) -> None:
        """Put every so many loaded frames aside, if enough are left."""
        loaded = np.flatnonzero((self.which >= 0).any(axis=1))
        if every > 1 and len(loaded) >= every * FEWEST_ASIDE:
            self.wanted[loaded[every - 1 :: every]] = False
            self.kept &= self.wanted

    def check(self) -> None:
        """Compare what frames that were put aside tell of their forces with what is written.

        Their contacts are found with forces that nobody states; those explained are then taken in.
        """
        aside = np.flatnonzero(~self.wanted)
        free = self.unstated()
        plain = self.posterior(np.ones(len(self.levels)), 1.0)
        models = free.models(self.state.shared)
        rows = aside.tolist()
        state = free.settled(self.state, models, STEPS, rows)
        _, squares, counts = free.loss(state, models)
        covariance = inverse(self.information)
        told = dict(zip(rows, free.terms(state, models, rows), strict=True))
        inside = total = explained = 0
        for f in rows:
            if squares[f] > square_limit(counts[f]):
                self.aside.append((f, 0, np.nan, np.nan))
                continue
            explained += 1
            self.kept[f] = True
            components = self.loads.forces.shape[2]
            count = components * int((self.which[f] >= 0).sum())
            off = (state.own[f] - plain.mean(f, state.shared))[:count]
            unsure = Eliminated.of(told[f]).variances(covariance)[:count]
            unsure = unsure + 1 / plain.precision(f)[:count]
            inside += int((np.abs(off) < INTERVAL * np.sqrt(unsure)).sum())
            total += count
            stds = np.sqrt(unsure)
            self.aside += [(f, j % components, off[j], stds[j]) for j in range(count)]
        self.checked = Check(len(aside), explained, inside, total)
        self.wanted[:] = True

    def unstated(self) -> BenchPosterior:
        """The posterior if nobody stated the forces."""
        plain = self.posterior(np.ones(len(self.levels)), 1.0)
        sizes = plain.expected.sizes | {"normal": UNSTATED, "tangential": UNSTATED}
        return replace(plain, expected=replace(plain.expected, sizes=sizes))

    def misfit(self, few: Mask | None = None) -> float:
        """Median over all frames, or a few, of the reduced chi-square, contacts included."""
        posterior = self.posterior(np.ones(len(self.levels)), 1.0)
        models = posterior.models(self.state.shared)
        _, squares, counts = posterior.loss(self.state, models)
        misfits = squares / np.maximum(counts, 1.0)
        return float(np.median(misfits if few is None else misfits[few]))

    def allowed(self, shared: Array, step: Array) -> Array:
        """A step (S,) of the shared unknowns (S,) that leaves them where the sensor is solved."""
        return step

    def calm(self, limit: float) -> Mask:
        """Frames of small phases, but never less than the calmest quarter."""
        peaks = self.peaks()
        return self.kept & (peaks <= max(limit, float(np.quantile(peaks, 0.25))))

    def descend(self, few: Mask, heat: float) -> None:
        """Minimise the loss of some frames; those that fit badly lose weight."""
        self.mask()
        before = np.full(len(few), np.inf)
        for _ in range(self.weighings):
            posterior = self.posterior(few.astype(float), heat)
            models = posterior.models(self.state.shared)
            _, squares, counts = posterior.loss(self.state, models)
            misfit = squares / np.maximum(counts, 1.0)
            usual = float(np.median(misfit[few]))
            shares = np.minimum(1.0, SUSPECT * usual / np.maximum(misfit, 1e-9)) * few
            if np.abs(shares - before).max() < REWEIGHED:
                break
            self.state = self._climbed(replace(posterior, shares=shares))
            before = shares

    def _climbed(self, posterior: BenchPosterior) -> State:
        # frames that do not count follow to first order, and settle at the end
        on = posterior.shares > 0
        counted, idle = np.flatnonzero(on).tolist(), np.flatnonzero(~on).tolist()
        last: list[tuple[State, float]] = []  # where a step ended, and its loss
        expanded: list[float] = []  # losses where frames were expanded

        def expand(state: State) -> Expansion[State]:
            models = posterior.models(state.shared)
            self.about = state
            about = posterior.second_order(state, models)
            self.terms, self.shares = about.terms, posterior.shares
            self.information, gradient = about.information, about.gradient
            told, information = about.told, about.information
            self.told = told

            def ahead(step: Array) -> tuple[State, float]:
                step = self.allowed(state.shared, step)
                there = posterior.models(state.shared + step)
                reached = posterior.within(state.moved(step, told))
                found = posterior.loss(reached, there)[0]
                falls = -step @ (2 * gradient + information @ step)
                if self.settling and loss - found < KEPT * falls:
                    reached = posterior.settled(reached, there, self.settling, counted)
                    found = posterior.loss(reached, there)[0]
                last[:] = [(reached, found)]
                return reached, found

            known = last and last[0][0] is state
            loss = last[0][1] if known else posterior.loss(state, models)[0]
            expanded.append(loss)
            return Expansion(loss, gradient, lambda: Curvature(information), ahead)

        found = minimise(self.state, expand, self.steps, Stop(close=CLOSE, near=NEAR))
        last_step = self.allowed(found.place.shared, found.step)
        moved = posterior.within(found.place.moved(last_step, self.told))
        models = posterior.models(moved.shared)
        # a step too short to evaluate is one of unknowns that act nonlinearly, if it loses
        if found.gain and posterior.loss(moved, models)[0] > expanded[-1]:
            moved, models = found.place, posterior.models(found.place.shared)
        if self.settling:
            moved = posterior.settled(moved, models, self.steps, idle)
            return posterior.settled(moved, models, self.settling, counted)
        # frames of less weight did not hold a step back that moved them to somewhere worse
        few = posterior.shares < 1
        stayed = posterior.within(replace(moved, own=self.state.own))
        (_, ours, _), (_, theirs, _) = (posterior.loss(one, models) for one in (moved, stayed))
        back = few & (theirs < ours)
        own = [(stayed if back[f] else moved).own[f] for f in range(len(back))]
        return posterior.settled(
            replace(moved, own=own), models, SETTLING, np.flatnonzero(few).tolist()
        )

    def improve(self) -> bool:
        """One round of the last stage; whether nothing changed any more."""
        kept, sound = self.kept.copy(), self.sound.copy()
        moved = self.relinearised()
        self.descend(self.kept, 1.0)
        self._resize()
        moved |= self.repattern()
        self._leave_out()
        same = np.array_equal(kept, self.kept) and np.array_equal(sound, self.sound)
        settled = same and not (moved or self.resized or self.far())
        if settled or self.smoothing:
            self.smoothing = self.relength()
        return settled and not self.smoothing

    def _resize(self) -> None:
        """The sizes under which the frames are most probable, of what nobody states.

        All unknowns follow them to first order.
        """
        self.scatter(self.told, inverse(self.information))
        about, names = self._expanded(), tuple(self.sizes)
        sizes = np.array([self.sizes[name] for name in names])
        low, high = np.minimum(np.log(STILL / sizes), 0.0), np.log(LARGEST / sizes)
        before = about.sized(np.zeros(len(names)))
        found = about.likeliest(before, low, np.maximum(high, 0.0))
        told = found.sums.free[:-1] > LOST * found.sums.members[:-1]
        self.sizes = dict(zip(names, (sizes * np.exp(found.steps)).tolist(), strict=True))
        self.lost = dict(zip(names, (~told).tolist(), strict=True))
        self.resized = before.loss - found.loss > CLOSE
        self.state = self._likelier(
            self.about.by(found.shared, found.own),
            self.state.by(
                found.shared - before.shared,
                [after - first for after, first in zip(found.own, before.own, strict=True)],
            ),
        )

    def _likelier(self, *states: State) -> State:
        """The most probable of some states, with what scatters as found."""
        posterior, here = self.posterior(self.shares, 1.0), self.state.shared
        near = [here + self.allowed(here, state.shared - here) for state in states]
        within = [
            posterior.within(replace(state, shared=shared))
            for state, shared in zip(states, near, strict=True)
        ]
        losses = [posterior.loss(one, posterior.models(one.shared))[0] for one in within]
        return within[int(np.argmin(losses))]

    def _expanded(self) -> Expanded:
        """All frames to second order about where the last descent expanded them."""
        posterior, expected = self.posterior(self.shares, 1.0), self.expected()
        names, shared, scattering = list(self.sizes), self.about.shared, list[Scattering]()
        for f, own in enumerate(self.about.own):
            group = np.full(len(own), -1)
            for name in GROUPS:
                group[self._unstated(posterior, name, f)] = names.index(name)
            off = own - posterior.mean(f, shared)
            scattering.append(Scattering(off, posterior.precision(f), group))
        group = np.full(len(shared), -1)
        for name, fields in self.fields().items():
            group[fields] = names.index(name)
        return Expanded(
            self.terms,
            scattering,
            self.bench.moves,
            self.shares,
            Scattering(shared, expected.precision, group),
            expected.information,
            expected.slope(shared),
            len(names),
        )

    def fields(self) -> dict[str, slice]:
        """Shared unknowns that vary smoothly by a size of their own, which the frames tell."""
        at = self.bench.at
        return {
            name: slice(at.own(name).start + self.channels * first, at.own(name).stop)
            for name, first in SMOOTH.items()
            if name in at._fields
        }

    def smooth(self, covariance: Array) -> dict[str, tuple[float, float, float]]:
        """The same as `scatter` of what is smooth along the strip."""
        precision, found = self.expected().precision, {}
        for name, own in self.fields().items():
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
            moves, response = self.bench.moves[f], one.response.copy()
            response[:, response.shape[1] - moves.shape[1] :] -= moves  # off what is expected
            variances = replace(one, response=response).variances(covariance)
            precision = posterior.precision(f)
            squares = precision * np.square(
                self.state.own[f] - posterior.mean(f, self.state.shared)
            )
            free = 1 - precision * variances
            for name, rows in found.items():
                own, unstated = posterior.group(name, f), self._unstated(posterior, name, f)
                rows[f, :3] = squares[unstated].sum(), free[unstated].sum(), len(unstated)
                rows[f, 3:] = squares[own].sum(), free[own].sum()
        return found

    def _unstated(self, posterior: BenchPosterior, name: str, f: int) -> Index:
        """Own unknowns of a frame in one of GROUPS whose deviation nobody states."""
        own = posterior.group(name, f)
        return own[:0] if self.drawn.get(name) in self.stated else own[posterior.free(name, f)]

    def _leave_out(self) -> None:
        """Leave out frames and pixels that contradict the others."""
        posterior = self.posterior(self.kept.astype(float), 1.0)
        models = posterior.models(self.state.shared)
        _, squares, counts = posterior.loss(self.state, models)
        excess = squares - counts
        spread = np.abs(excess) / np.sqrt(2 * counts)
        usual = max(float(np.median(spread[self.wanted])), 1.0)
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
