"""What is known of a sensor before the next load: from its drawing, or from a calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import InputError
from fringeforce.calibration.calibrate import LIGHTS, PARAMETERS
from fringeforce.calibration.design_entries import (
    POSITIONS,
    checked_paths,
    entries,
    names,
    prior,
    units,
    values,
)
from fringeforce.calibration.design_jacobian import DesignJacobian, design_jacobian
from fringeforce.calibration.frame_fit import light_basis, on_strip, precision, start
from fringeforce.calibration.light.fixed_pattern_noise import FixedPatternNoise
from fringeforce.calibration.measurements import SHIFT, Measurements, Unknowns
from fringeforce.design.strip import Sensor
from fringeforce.models.imaging import Calibration, Imaging
from fringeforce.models.strip import SensorModel

TOLERANCE = 0.1
"""Standard deviation of entries that a drawing is trusted to when the truth is imagined."""


@dataclass(frozen=True, eq=False)
class Knowledge:
    """Estimate and covariance of all unknowns of a calibration.

    Attributes
    ----------
    measured : Measurements
        The sensor as drawn or as calibrated, and its light; no frames yet.
    paths : tuple of str
        Design values that are unknown.
    jacobian : DesignJacobian
        The matrix about the estimate; design values enter relative to the sensor, as zeros.
    unknowns : Unknowns
        The estimate.
    root : ndarray, shape (u, u)
        A root of the covariance of all unknowns.
    used : ndarray of bool, shape (P,)
        Pixels that can be used.
    light_variance : float
        What readings add to the variance of their grey levels.
    """

    measured: Measurements
    paths: tuple[str, ...]
    jacobian: DesignJacobian
    unknowns: Unknowns
    root: Array
    used: Mask
    light_variance: float = 0.0

    @property
    def sensor(self) -> Sensor:
        """The sensor, as drawn or as calibrated."""
        return self.measured.sensor

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the design's entries and of the camera's place."""
        return (*names(self.sensor, self.paths), "camera shift", "camera scale")

    @property
    def values(self) -> Array:
        """Values of what is named, in their own units."""
        shift, scale = self.unknowns.place
        design = values(self.sensor, self.paths, self.unknowns.design)
        return np.array([*design, shift * SHIFT, 1 + scale])

    @property
    def units(self) -> Array:
        """What a unit of the unknowns is in the values' own units."""
        places = np.array([path == POSITIONS for path in entries(self.sensor, self.paths)], bool)
        design = np.where(places, 1.0, np.abs(self.values[:-2]))
        return np.concatenate([design, [1.0, 1.0]]) * _units(self.sensor, self.paths)

    def expected(self, loads: Array, truth: Unknowns) -> Measurements:
        """Calibration loads (F, n, 2) and the frames that are expected of them."""
        flat, turned, averaged = loads.reshape(len(loads), -1), np.zeros(1), np.ones(1)
        matrix = self.jacobian.matrix(truth.design, truth.positions(self.sensor))
        levels = truth.response(self.measured).level(flat @ matrix.T)
        return replace(self.measured, levels=levels, loads=flat, turned=turned, averaged=averaged)

    def imagined(self, pairs: int) -> list[Unknowns]:
        """The estimate, and designs that scatter about it as what is known allows.

        Drawings are trusted to TOLERANCE here: the wide prior of the fit is meant to leave all to
        the frames and not to describe a workshop.
        """
        d = len(self.unknowns.design)
        known = np.linalg.inv(self.root[:d, :d] @ self.root[:d, :d].T)
        root = np.linalg.cholesky(np.linalg.inv(known + np.eye(d) / TOLERANCE**2))
        rest = np.zeros(len(self.root) - d)
        steps = np.random.default_rng(0).standard_normal((pairs, d)) @ root.T
        return [
            self.unknowns,
            *(self.unknowns.moved(np.append(s, rest)) for step in steps for s in (step, -step)),
        ]


def knowledge(source: Sensor | SensorModel, parameters: Sequence[str] | None = None) -> Knowledge:
    """What a drawing or a calibrated model says of all unknowns.

    Parameters
    ----------
    source : Sensor or SensorModel
        A model that was never calibrated says what its drawing says.
    parameters : sequence of str, optional
        Dotted paths of design values to estimate; those of `calibrate`, or of the model's own
        calibration, if not given.

    Raises
    ------
    InputError
        If a path cannot be calibrated, or differs from those of the model's calibration.
    """
    sensor = source if isinstance(source, Sensor) else source.sensor
    pixels, loads = sensor.camera.pixels, 2 * sensor.tactels.count
    basis = light_basis(pixels, LIGHTS)
    measured = Measurements(sensor, np.empty((0, pixels)), np.empty((0, loads)), basis)
    if isinstance(source, SensorModel) and source.calibration and source.imaging:
        found = _of_calibration(measured, source, source.calibration, source.imaging)
        if parameters is not None and set(parameters) != set(found.paths):
            raise InputError(
                f"The model was calibrated in {', '.join(found.paths)}; its covariance says "
                "nothing of others. Leave the parameters out, or plan from the drawing."
            )
        return found
    paths = checked_paths(sensor, tuple(PARAMETERS if parameters is None else parameters))
    unsure = prior(sensor, paths)
    unknowns = start(measured, len(unsure))
    root = np.diag(1 / np.sqrt(precision(measured, unsure)))
    used = on_strip(unknowns.positions(sensor), sensor)
    jacobian = design_jacobian(sensor, paths, unknowns.design)
    return Knowledge(measured, paths, jacobian, unknowns, root, used)


def _of_calibration(
    measured: Measurements, model: SensorModel, found: Calibration, imaging: Imaging
) -> Knowledge:
    """Estimate and covariance behind a calibrated model; its modes are the covariance's root.

    What single pixels add to the smooth lighting is taken as known.
    """
    basis, single = (
        measured.basis,
        [name for name in found.names if not name.startswith("camera s")],
    )
    # the names of all tactels' places stand for one path
    paths = tuple(dict.fromkeys(POSITIONS if n.startswith("tactel ") else n for n in single))
    unit, count = _units(model.sensor, paths), len(found.names)
    own = np.asarray(np.linalg.cholesky(found.covariance / np.outer(unit, unit)), dtype=float)
    modes = [imaging.amplitude_modes, imaging.offset_modes]
    size = count + 2 * basis.shape[1]
    wide = np.zeros((size, max(len(modes[0]), size)))
    wide[:count, :count] = own
    wide[count:, : len(modes[0])] = np.concatenate([_coefficients(basis, m.T) for m in modes])
    root = np.asarray(np.linalg.qr(wide.T)[1], dtype=float).T  # of the same covariance, square
    lights = np.stack([imaging.amplitude, imaging.offset])
    smooth = _coefficients(basis, lights.T)
    place = np.array([found.values[-2] / SHIFT, found.values[-1] - 1])
    unknowns = Unknowns(np.zeros(count - 2), place, *smooth.T)
    single_pixels = lights - (basis @ smooth).T
    pattern = FixedPatternNoise(single_pixels, single_pixels, np.full(lights.shape, np.inf))
    measured = replace(measured, pattern=pattern, drift=imaging.drift)
    jacobian = _jacobian_of_modes(model, imaging, own, prior(model.sensor, paths))
    return Knowledge(
        measured, paths, jacobian, unknowns, root, imaging.usable, imaging.light_variance
    )


def _jacobian_of_modes(
    model: SensorModel, imaging: Imaging, root: Array, deviations: Array
) -> DesignJacobian:
    """The matrix and its derivatives from the modes of a calibration, without any elements."""
    seen = np.abs(imaging.positions) <= model.sensor.transducer.length / 2
    modes = imaging.influence_modes[:, seen]
    changes = np.linalg.solve(root.T, modes.reshape(len(modes), -1)).reshape(modes.shape)
    matrix = np.concatenate([model.pixel_influence[None, seen], changes[:-2]])
    parts = np.moveaxis(matrix.reshape(*matrix.shape[:2], -1), 0, 1)
    spline = CubicSpline(imaging.positions[seen], parts)
    return DesignJacobian(np.zeros(len(deviations)), model, spline, deviations)


def _units(sensor: Sensor, paths: tuple[str, ...]) -> Array:
    """What a unit of the unknowns is in terms of a calibration's covariance."""
    return np.concatenate([units(sensor, paths, np.zeros(len(prior(sensor, paths)))), [SHIFT, 1.0]])


def _coefficients(basis: Array, levels: Array) -> Array:
    """What smooth functions along the frame are made of, shape (k, ...)."""
    return np.asarray(np.linalg.lstsq(basis, levels, rcond=None)[0], float)
