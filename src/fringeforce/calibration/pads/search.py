"""The search for the most probable pad of a bench."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.calibration.bench_expectation import DOUBT
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.bench_posterior import Expected
from fringeforce.calibration.bench_search import NEAR_DESIGN, SETTLED, BenchSearch, inverse
from fringeforce.calibration.design_entries import design_value
from fringeforce.calibration.pads.bench_uncertainty import bench_uncertainty, is_layer
from fringeforce.calibration.pads.posterior import EXPONENT, PadBench, PadPosterior, Parts
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import number_at, with_values
from fringeforce.mechanics.solid.surface import contact_modulus
from fringeforce.models.as_built import RESIDUAL
from fringeforce.models.imaging import camera_response
from fringeforce.models.pad import PadModel, characterize_pad, seen_pixels
from fringeforce.models.pad_contacts import ContactSeries
from fringeforce.models.pad_slices import block_of

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
        loads: BenchLoads,
        paths: tuple[str, ...],
        model: PadModel | None = None,
    ) -> None:
        self.model = characterize_pad(sensor) if model is None else model
        self.known = bench_uncertainty(self.model, paths)
        super().__init__(sensor, levels, loads, paths)

    def again(self, levels: Array, loads: BenchLoads) -> PadSearch:
        """A new search of the same pad with other frames or loads."""
        return PadSearch(self.sensor, levels, loads, self.paths, self.model)

    def load(self, loads: BenchLoads) -> None:
        """Take the loads of all frames; widths that nobody states are expected."""
        pad = self.model.sensor
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

    def first_bench(self) -> PadBench:
        """The bench as it is drawn and written down."""
        size, residual = int(self.known.lasting.sum()), self.known.group(RESIDUAL)
        assert residual is not None
        bench = PadBench(
            self.levels,
            self.sound,
            self.which,
            self.loads,
            self.loads.places.copy(),
            self.loads.widths.copy(),
            np.full(self.which.shape, EXPONENT[0]),
            self.known,
            camera_response(self.sensor.camera),
            np.zeros(size),
            Parts(residual.place, size),
        )
        return bench.expanded(self._series(bench.centre, STEPS[0]), None)

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
        deviations[at.own("residual")] = sizes["residual"]
        scatter = {name: sizes[name] for name in ("place", "width", "gain")}
        for name in ("normal", "tangential"):
            scatter[name] = DOUBT[name] * sizes[name]
        return Expected(1 / np.square(deviations), scatter)

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
            for group in known.registration
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
        """Expand about the layers and contacts that were found, if these are other ones."""
        bench, shared = self.bench, self.state.shared
        layers = np.zeros(len(shared), bool)
        for group in self.known.groups:
            if is_layer(group.path):
                layers[group.begin] = True
        off = shared - bench.centre
        squared = 0.0
        if layers.any():
            covariance = inverse(self.information)[np.ix_(layers, layers)]
            squared = float(off[layers] @ np.linalg.solve(covariance, off[layers]))
        posterior = self.posterior(np.ones(len(self.levels)), 1.0)
        moved = [
            float(np.abs(own[posterior.group(name, f)]).max(initial=0.0))
            for f, own in enumerate(self.state.own)
            for name in ("place", "width", "exponent")
            if self.kept[f]
        ]
        still = (np.abs(off[layers]) <= NEAR_DESIGN).all()
        if (squared <= SETTLED**2 or still) and max(moved, default=0.0) <= SETTLED:
            return False
        centre = np.where(layers, shared, 0.0)
        before = replace(bench, centre=centre)
        self.bench = before.expanded(self._series(centre, STEPS[1]), self.state)
        own = []
        for f, value in enumerate(self.state.own):
            k = int((self.which[f] >= 0).sum())
            kept = value.copy()
            kept[3 * k + 1 :] = 0.0
            own.append(kept)
        self.state = replace(self.state, own=own)
        return True

    def residuals(self, models: object) -> Array:
        """Grey levels less those expected, in units of the noise, shape (F, P)."""
        posterior = self.posterior(np.ones(len(self.levels)), 1.0)
        return np.array(
            [posterior.left(f, own, self.state.shared) for f, own in enumerate(self.state.own)]
        )
