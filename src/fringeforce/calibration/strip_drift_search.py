"""The search for a strip that drifted since its calibration, under presses that are known."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.bench import SCALE, SHIFT, Bench
from fringeforce.calibration.bench_expectation import FIELDS, THINNED
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.bench_search import inverse
from fringeforce.calibration.design_entries import units
from fringeforce.calibration.drift_rows import DriftRows
from fringeforce.calibration.fit import BenchFit
from fringeforce.calibration.residual_guess import Averaged
from fringeforce.calibration.residual_length import FAINTEST, correlation_lengths
from fringeforce.calibration.shared_unknowns import Expected, ExpectedTogether
from fringeforce.calibration.strip_search import StripSearch
from fringeforce.calibration.timed_loads import TimedLoads
from fringeforce.design.light import pairs_of_channels
from fringeforce.estimation.frame_exposure import NARROWEST_BLUR, positive
from fringeforce.models.imaging import ABSOLUTE
from fringeforce.models.node_splines import coefficients
from fringeforce.models.smooth_field import karhunen_loeve
from fringeforce.models.strip import SensorModel
from fringeforce.models.strip_nodes import FIELD_SAMPLES, SPLINE_SAMPLES, at_nodes

CAMERA = "camera shift", "camera scale"
CERTAIN = 1e-4
"""Standard deviation of an unknown that nothing is left uncertain of, in its unit: some tenth of a
micrometre, and as little of a grey level."""
NEAR = {"residual": 1e-2, "bright": 1e-3, "dark": 0.1}
"""How near modes of the search come to those of the calibration and of the drift: of the residual
[rad], of the amplitude, relative to it, and of the offset, grey levels."""


class StripDriftSearch(StripSearch):
    """As of a calibration, with what is known of the strip before the frames.

    What the calibration leaves uncertain, and the drift, are unknowns of unit variance, which
    change those of the bench to first order.

    Parameters
    ----------
    model : SensorModel
        Calibrated.
    drift : DriftRows
        What unknowns of unit variance of what may have drifted change.
    levels : ndarray, shape (F, C P)
        Grey levels.
    loads : BenchLoads or TimedLoads
        What is written down of them.
    """

    def __init__(
        self,
        model: SensorModel,
        drift: DriftRows,
        levels: Array,
        loads: BenchLoads | TimedLoads,
    ) -> None:
        assert model.imaging is not None
        assert model.calibration is not None
        self.model, self.drift = model, drift
        self.imaging, self.found = model.imaging, model.calibration
        paths = tuple(name for name in self.found.names if not name.startswith(ABSOLUTE))
        super().__init__(model.sensor, levels, loads, paths, {})
        shared = np.zeros(self.bench.at.size)
        shared[: self.bench.at.written] = self.prior[0]
        self.state = self.posterior(np.ones(len(levels)), 1.0).start(shared)

    def first_bench(self) -> Bench:
        """The bench as it was calibrated."""
        bench, imaging = super().first_bench(), self.imaging
        nodes = len(bench.template.fixed)
        samples = bench.places[:: SPLINE_SAMPLES // FIELD_SAMPLES // THINNED]
        shortest = karhunen_loeve(samples, correlation_lengths(self.sensor)[-1], FAINTEST)
        none = np.zeros(len(imaging.positions))
        residual = none if imaging.residual is None else imaging.residual
        template = bench.template._replace(
            fields=np.ascontiguousarray(FIELDS["residual"] * coefficients(shortest, nodes)),
            fixed=at_nodes(self.model, residual),
            amplitude=imaging.amplitude,
            offset=imaging.offset,
            blur=(self.sensor.camera.blur or 0.0) / self._pixel,
        )
        return replace(bench, template=template, at=bench.at.resized("residual", len(shortest)))

    @property
    def _pixel(self) -> float:
        """What a pixel of a camera as drawn sees [m]."""
        return float(self.sensor.transducer.length / self.sensor.camera.pixels)

    @cached_property
    def unsure(self) -> Array:
        """What unknowns of unit variance change in those of the bench, shape (U + S, at.written).

        Those that the calibration left uncertain come first, then those of the drift.
        """
        imaging, drift, at, template = self.imaging, self.drift, self.bench.at, self.bench.template
        design, seen = self._known_values
        left, size = len(design), len(design) + len(drift.camera)

        def both(known: Array | None, drifted: Array) -> Array:
            """Of the calibration, and of the drift."""
            none = np.zeros((left, drifted.shape[1]))
            return np.concatenate([none if known is None else known, drifted])

        place, scale = self._registration
        moved = drift.camera @ np.array([[1.0, 0.0], [place, scale]])
        nodes, light = len(template.fixed), at.dark - at.bright
        basis = {
            "residual": template.fields,
            "bright": template.brightness[:light],
            "dark": template.darkness[light:],
        }
        fields = {
            "residual": both(imaging.phase_modes, drift.fields),
            "bright": both(
                imaging.amplitude_modes / np.maximum(imaging.amplitude, 1.0), drift.brightness
            ),
            "dark": both(imaging.offset_modes, drift.darkness),
        }
        pixels = len(imaging.positions)
        first, weights = template.first[:pixels], template.weights[:pixels]
        found = np.zeros((size, at.written))
        found[:left, at.own("design")] = design
        found[:, at.own("camera")] = both(seen, moved) / [SHIFT, SCALE]
        for name, rows in basis.items():
            own = rows.reshape(len(rows), -1, nodes)
            flat = sum(own[..., first + k] * weights[:, k] for k in range(4))
            modes = np.asarray(flat).reshape(len(rows), -1)
            gram = modes @ modes.T + NEAR[name] ** 2 * modes.shape[1] * np.eye(len(modes))
            found[:, at.own(name)] = np.linalg.solve(gram, modes @ fields[name].T).T
        if imaging.lens_modes is not None:
            slope = positive(template.blur, NARROWEST_BLUR)[1] * template.blur_std * self._pixel
            power = template.gamma_std * self.sensor.camera.gamma / template.gamma
            found[:left, at.blur : at.crosstalk] = imaging.lens_modes / [slope, power]
        pairs = list(pairs_of_channels(self.channels))
        for row, path in enumerate(path for path in pairs if self.sensor.tolerances.get(path)):
            shares = both(imaging.crosstalk_modes, drift.shares)[:, pairs.index(path)]
            found[:, at.crosstalk + row] = shares / self.sensor.tolerances[path]
        return found

    @property
    def _registration(self) -> tuple[float, float]:
        """Shift [m] and scale with which the camera of the calibration looks."""
        scale, place = np.polyfit(self.sensor.pixel_positions, self.imaging.positions, 1)
        return float(place), float(scale)

    @property
    def _known_values(self) -> tuple[Array, Array]:
        """What the calibration's unknowns change in entries of the design, and of the camera."""
        found, count = self.found, len(self.imaging.amplitude_modes)
        known = found.modes
        if known is None:  # the first modes are those of the values
            known = np.asarray(np.linalg.cholesky(found.covariance), dtype=float)
            known = np.pad(known, [(0, 0), (0, count - len(known))])
        rows = [found.names.index(path) for path in (*self.mechanical, *CAMERA)]
        own = known[rows].T
        return own[:, :-2] / units(self.sensor, self.mechanical, self.centre), own[:, -2:]

    @cached_property
    def prior(self) -> tuple[Array, Array]:
        """Mean and precision of what lasts, before the frames."""
        place, scale = self._registration
        at, mean = self.bench.at, np.zeros(self.bench.at.written)
        mean[at.own("camera")] = place / SHIFT, (scale - 1) / SCALE
        unsure = self.unsure
        return mean, inverse(unsure.T @ unsure + CERTAIN**2 * np.eye(at.written))

    def begin(self) -> None:
        """Pixels that see the strip; the camera looks where it did, but for the drift."""
        self.mask()

    def expected(self) -> Expected:
        """What is known before the frames are seen."""
        plain, own = super().expected(), slice(0, self.bench.at.written)
        mean, together = np.zeros(len(plain.precision)), plain.information
        mean[own], together[own, own] = self.prior
        return ExpectedTogether(plain.precision, plain.sizes, mean=mean, together=together)

    def fields(self) -> dict[str, slice]:
        """Nothing: how large fields are, the calibration and the drift say."""
        return {}

    def relength(self) -> bool:
        """Whether the residual is found to be rougher: the drift says how rough it may be."""
        return False

    def drifted(self, fit: BenchFit) -> Averaged:
        """Mean and covariance of the unknowns of the drift, shapes (S,) and (S, S).

        Small errors of contacts' tractions are another in every frame, and make what frames tell
        scatter by more than their noise.
        """
        own = slice(0, self.bench.at.written)
        mean, precision = self.prior
        covariance = fit.covariance
        before = covariance @ fit.posterior.expected.information @ covariance
        more = np.sqrt(np.maximum(fit.excess, max(fit.chi2, 1.0)))
        whole = (before + np.outer(more, more) * (covariance - before))[own, own]
        back = precision @ self.unsure[-len(self.drift.camera) :].T
        left = np.eye(back.shape[1]) - back.T @ (inverse(precision) - whole) @ back
        told = inverse(left)
        found = back.T @ (fit.state.shared[own] - mean)
        return self.drift.average(told - np.eye(len(told)), told @ found)
