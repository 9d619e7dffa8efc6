"""The search for the most probable pad of a bench."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import InputError
from fringeforce.calibration.bench_expectation import DOUBT
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.bench_search import NEAR_DESIGN, SETTLED, BenchSearch, inverse
from fringeforce.calibration.design_entries import design_value
from fringeforce.calibration.pads.bench_uncertainty import (
    SHAPES,
    BenchUncertainty,
    bench_uncertainty,
    is_layer,
)
from fringeforce.calibration.pads.posterior import (
    EXPONENT,
    MOST,
    PadBench,
    PadPosterior,
    Parts,
)
from fringeforce.calibration.shared_unknowns import Expected, State
from fringeforce.calibration.timed_loads import TimedLoads
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import number_at, with_values
from fringeforce.mechanics.solid.surface import contact_modulus
from fringeforce.models.pad import PadModel, characterize_pad, seen_pixels
from fringeforce.models.pad_contacts import ContactSeries
from fringeforce.models.pad_slices import block_of
from fringeforce.models.pad_uncertainty import pad_response
from fringeforce.models.pad_unknowns import FIELDS

STEPS = 0.1, 0.03
"""Steps of the logarithms of layers about the drawing and about what was found."""


class PadSearch(BenchSearch):
    """Where the search for the most probable pad is."""

    sensor: Pad
    bench: PadBench
    steps, weighings = 5, 2  # the next descent starts with contacts expanded anew
    settling = 0

    def __init__(
        self,
        sensor: Pad,
        levels: Array,
        loads: BenchLoads | TimedLoads,
        paths: tuple[str, ...],
        references: Mapping[str, Array] | None = None,
        load_cell: tuple[float, float] = (0.0, 0.0),
        like: PadSearch | None = None,
        model: PadModel | None = None,
    ) -> None:
        for path in paths:
            if not is_layer(path):
                raise InputError(
                    f"{path!r} is not calibrated on a pad: camera, light and residual are found in "
                    "any case; take values of transducer.compliant and transducer.photoelastic."
                )
        if needless := sorted({"dark", "bright"}.intersection(references or {})):
            raise InputError(
                f"Reference frames ({', '.join(needless)}) are for strips, whose pixels each have "
                "light of their own; of a pad give frames without load, unloaded, alone."
            )
        self.sensor = sensor
        if like is None:
            self.model = characterize_pad(sensor) if model is None else model
            self.known = self.uncertain_of(self.model, paths)
            self.series = self._series(np.zeros(self.known.size), STEPS[0])
        else:  # of the same drawing
            self.model, self.known, self.series = like.model, like.known, like.series
        super().__init__(sensor, levels, loads, paths, references, load_cell)

    def uncertain_of(self, model: PadModel, paths: tuple[str, ...]) -> BenchUncertainty:
        """What is uncertain about a pad before the frames, values of its layers among it."""
        return bench_uncertainty(model, paths)

    def again(self, levels: Array, loads: BenchLoads) -> PadSearch:
        """A new search of the same pad with other frames or loads."""
        return PadSearch(self.sensor, levels, loads, self.paths, like=self)

    def load(self, loads: BenchLoads) -> None:
        """Take the loads of all frames; widths that nobody states are expected."""
        pressed = loads.present.sum(axis=1)
        if pressed.max() > MOST:
            raise InputError(
                f"Frame {int(pressed.argmax())} has {int(pressed.max())} contacts; a calibration "
                f"of a pad takes at most {MOST} in a frame. Press with fewer at a time."
            )
        pad, loads, unlit = self.model.sensor, self.with_references(loads), len(loads)
        named = np.zeros(loads.present.shape, bool)
        if loads.tactels is not None:
            named = loads.tactels >= 0
        # Hertz, for a half-space of the cover: Johnson's equation (4.22)
        modulus = contact_modulus(block_of(pad))
        normal = np.maximum(loads.forces[..., 0], 0.0)
        under = 2 * np.cbrt(3 * normal * loads.radii / (4 * modulus))
        widths = np.where(np.isfinite(loads.widths), loads.widths, under)
        widths = np.where(np.isfinite(widths) & ~named, widths, pad.tactels.side)
        self.loads = replace(loads, widths=widths)
        self.which = np.where(loads.present, 0, -1)
        self.which[unlit:] = -1

    def own_places(self, contacts: int) -> tuple[slice, int, float]:
        """Where places of contacts stand among the own unknowns of a frame."""
        begin, count = 3 * contacts + 1, 2 * contacts
        return slice(begin, begin + count), begin + SHAPES * contacts, self.known.units[0]

    def first_bench(self) -> PadBench:
        """The bench as it is drawn and written down."""
        size = int(self.known.lasting.sum())
        groups = (self.known.group(path) for path in FIELDS)
        residual, bright = (slice(0, 0) if group is None else group.place for group in groups)
        moves, self.written = self.moves()
        whole = size + len(self.written)
        bench = PadBench(
            self.levels,
            self.sound,
            self.which,
            self.loads,
            self.loads.places.copy(),
            self.loads.widths.copy(),
            np.full(self.which.shape, EXPONENT[0]),
            self.known,
            pad_response(self.known.model.sensor),
            self.averaged,
            moves,
            np.zeros(size),
            Parts(residual, bright, slice(0, size), slice(size, whole), whole),
        )
        return bench.expanded(self.series, None)

    def _series(self, centre: Array, step: float) -> ContactSeries:
        weights = block_of(self.model.sensor).depths(len(self.model.influence.profile))[1]
        pad = with_values(self.model.sensor, self.layers(centre))
        return ContactSeries(pad, self.known.model.influence, weights, self.known.layers, step)

    def layers(self, shared: Array) -> dict[str, float]:
        """Values that enter by their logarithms."""
        found = {}
        for group in self.known.groups:
            if is_layer(group.path):
                power = self.known.logarithmic(group) * shared[group.begin]
                found[group.path] = design_value(self.sensor, group.path) * float(np.exp(power))
        return found

    def expected(self) -> Expected:
        """What is expected before the frames are seen."""
        at, sizes = self.bench.at, self.sizes
        deviations = np.ones(at.size)
        for name in ("residual", "bright"):
            deviations[at.own(name)] = sizes[name]
        deviations[at.own("written")] = self.written
        scatter = {name: sizes[name] for name in ("place", "width", "gain")}
        for name in ("normal", "tangential"):
            scatter[name] = DOUBT[name] * sizes[name]
        return Expected(1 / np.square(deviations), scatter)

    def fields(self) -> dict[str, slice]:
        """Modes of the residual and of how uneven the light is, all of one size each."""
        return {name: self.bench.at.own(name) for name in ("residual", "bright")}

    def posterior(self, shares: Array, heat: float) -> PadPosterior:
        """The posterior with what scatters as found so far; parameters as of `BenchPosterior`."""
        return PadPosterior(self.bench, self.expected(), shares, heat)

    def begin(self) -> None:
        """Nothing: frames tell a pad's shift from its first descent on."""

    def peaks(self) -> Array:
        """Largest retardance of every frame, over both passes [rad]."""
        whole, found = 2 * self.known.model.influence.profile.sum(axis=0), []
        for own, sampling in zip(self.state.own, self.bench.samplings, strict=True):
            size = sampling.influence.shape[3]
            modes = sampling.modes(own[:size])
            found.append(float(np.hypot(*np.einsum("k,fkm->fm", whole, modes)).max(initial=0.0)))
        return np.array(found)

    def mask(self) -> None:
        """Leave out pixels that do not see the pad, or do not follow the light."""
        pad = self.sensor
        known, shared = self.known, self.state.shared
        places = {
            group.path: value[0] + group.std * shared[group.begin]
            for group in known.camera.registration
            if (value := number_at(pad, group.path)) is not None
        }
        seen = seen_pixels(with_values(pad, places))
        self.seen = np.tile(seen, len(self.model.pictures))
        self.bench = replace(self.bench, used=self.sound & self.seen)

    def descend(self, few: Mask, heat: float) -> None:
        """Minimise the loss of some frames, expanded about what was found."""
        if self.told:
            self.relinearised()
        super().descend(few, heat)

    def relinearised(self) -> bool:
        """Take the loads at the delay that was found, and expand about layers and contacts."""
        delayed = self.delayed()
        if self.far():
            shared = self.state.shared[self.bench.at.pad]
            self._expand(self.state, np.where(self._layers, shared, 0.0))
        return delayed

    @property
    def _layers(self) -> Mask:
        """Which unknowns of the pad are values of layers."""
        layers = np.zeros(self.bench.centre.size, bool)
        for group in self.known.groups:
            if is_layer(group.path):
                layers[group.begin] = True
        return layers

    def reload(self, alike: Mask) -> None:
        """Take other loads, as written down, but for frames with contacts like those before."""
        bench, loads = self.bench, self.loads
        kept = alike[:, None] & (bench.which >= 0) & (self.which >= 0)
        bench = replace(
            bench,
            which=self.which,
            loads=loads,
            centres=np.where(kept[..., None], bench.centres, loads.places),
            sizes=np.where(kept, bench.sizes, loads.widths),
            exponents=np.where(kept, bench.exponents, EXPONENT[0]),
            moves=self.moves()[0],
        )
        self.bench = bench
        fresh = self.posterior(np.ones(len(self.levels)), 1.0).start(self.state.shared)
        own = [
            old if kept else new
            for old, new, kept in zip(self.state.own, fresh.own, alike, strict=True)
        ]
        self._expand(replace(fresh, own=own), bench.centre)

    def far(self) -> bool:
        """Whether layers or contacts that were found are other ones than those expanded about."""
        bench, shared = self.bench, self.state.shared[self.bench.at.pad]
        off, layers = shared - bench.centre, self._layers
        squared = 0.0
        if layers.any():
            own = np.flatnonzero(layers)
            covariance = inverse(self.information)[np.ix_(own, own)]
            squared = float(off[layers] @ np.linalg.solve(covariance, off[layers]))
        posterior = self.posterior(np.ones(len(self.levels)), 1.0)
        moved = [
            float(np.abs(own[posterior.group(name, f)]).max(initial=0.0))
            for f, own in enumerate(self.state.own)
            for name in ("place", "width", "exponent")
            if self.kept[f]
        ]
        moved_layers = squared > SETTLED**2 and (np.abs(off[layers]) > NEAR_DESIGN).any()
        return bool(moved_layers or max(moved, default=0.0) > SETTLED)

    def _expand(self, state: State, centre: Array) -> None:
        """Expand all contacts where they are in a state, about some layers."""
        before = replace(self.bench, centre=centre)
        self.bench = before.expanded(self._series(centre, STEPS[1]), state)
        own = []
        for f, value in enumerate(state.own):
            k = int((self.which[f] >= 0).sum())
            kept = value.copy()
            kept[3 * k + 1 :] = 0.0
            own.append(kept)
        self.state = replace(state, own=own)

    def residuals(self, models: object) -> Array:
        """Grey levels less those expected, in units of the noise, shape (F, P)."""
        posterior = self.posterior(np.ones(len(self.levels)), 1.0)
        return np.array(
            [posterior.left(f, own, self.state.shared) for f, own in enumerate(self.state.own)]
        )
