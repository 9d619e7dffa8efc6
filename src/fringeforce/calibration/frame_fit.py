"""Frames with known loads against a model with unknowns: the damped fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from fringeforce.base.arrays import Array, Mask
from fringeforce.calibration import checks
from fringeforce.calibration.design_jacobian import DesignJacobian
from fringeforce.calibration.light.fixed_pattern_noise import eliminated
from fringeforce.calibration.measurements import Measurements, Unknowns
from fringeforce.calibration.normal_equations import NormalEquations, linearised
from fringeforce.calibration.predictions import Predictions, frame_weights, predict
from fringeforce.design.strip import Sensor
from fringeforce.estimation.levenberg_marquardt import Expansion, Stop, minimise

PRIOR = {"shift": 2.0, "scale": 0.1, "amplitude": 0.5, "offset": 0.2}
"""Standard deviations of camera and light before any frame is seen; light in units of A."""
STAGES = (3.0, 10.0, np.inf)
"""Largest phase of the frames that enter, stage by stage: few fringes bear a rough model [rad]."""
LINEAR_REACH = 0.15
"""Change of a design's entry up to which a linearization is followed."""
SMALLEST_GAIN = 1e-4
"""Gain of twice the log-likelihood below which a step is the last: a hundredth of a deviation."""


@dataclass(frozen=True, eq=False)
class FrameFit:
    """Unknowns, how sure they are, and what they were found with.

    Attributes
    ----------
    unknowns : Unknowns
        The estimate.
    covariance : ndarray
        Covariance of all unknowns, for unit reduced chi-square.
    jacobian : DesignJacobian
        About which the matrix was linear.
    normal : NormalEquations
        The frames linearised there.
    """

    unknowns: Unknowns
    covariance: Array
    jacobian: DesignJacobian
    normal: NormalEquations


@dataclass(frozen=True, eq=False)
class CalibrationFit:
    """A fit of all measurements, and what it leaves out.

    Attributes
    ----------
    measured : Measurements
        All rows, references last, with the pattern and the drift that are left.
    fit : FrameFit
        Fit of the rows that were kept.
    sound : ndarray of bool, shape (P,)
        Pixels that follow the light.
    kept : ndarray of bool, shape (F,)
        Rows that do not contradict the others.
    """

    measured: Measurements
    fit: FrameFit
    sound: Mask
    kept: Mask

    @property
    def used(self) -> Mask:
        """Pixels that are sound and see the strip, shape (P,)."""
        sensor = self.measured.sensor
        return self.sound & on_strip(self.fit.unknowns.positions(sensor), sensor)


def light_basis(pixels: int, count: int) -> Array:
    """Cubic B-splines along the frame that sum to one, shape (pixels, count)."""
    degree = min(3, count - 1)
    inner = np.linspace(0, 1, count - degree + 1)
    knots = np.concatenate([np.zeros(degree), inner, np.ones(degree)])
    places = (np.arange(pixels) + 0.5) / pixels
    return BSpline.design_matrix(places, knots, degree).toarray()


def on_strip(positions: Array, sensor: Sensor) -> Mask:
    """Pixels that see the strip and not its end, shape (P,)."""
    margin = 2 * sensor.transducer.length / sensor.camera.pixels
    return np.abs(positions) < sensor.transducer.length / 2 - margin


def pixel_weight(measured: Measurements, at: Unknowns, sound: Mask) -> Array:
    """One for sound pixels that see the strip, zero for the others, shape (P,)."""
    return (sound & on_strip(at.positions(measured.sensor), measured.sensor)).astype(float)


def start(measured: Measurements, parameters: int) -> Unknowns:
    """Unknowns as drawn."""
    camera, ones = measured.sensor.camera, np.ones(measured.basis.shape[1])
    lights = camera.amplitude * ones, camera.offset * ones
    return Unknowns(np.zeros(parameters), np.zeros(2), *lights)


def precision(measured: Measurements, design: Array) -> Array:
    """Inverse variances of the unknowns before any frame is seen.

    Parameters
    ----------
    measured : Measurements
        The frames.
    design : ndarray, shape (d,)
        Standard deviations of the design's entries.
    """
    size, k = measured.sensor.camera.amplitude, measured.basis.shape[1]
    deviations = np.concatenate(
        [
            design,
            [PRIOR["shift"], PRIOR["scale"]],
            np.full(k, PRIOR["amplitude"] * size),
            np.full(k, PRIOR["offset"] * size),
        ]
    )
    return 1 / deviations**2


def levenberg_marquardt(
    measured: Measurements, at: Unknowns, jacobian: DesignJacobian, sound: Mask, steps: int = 12
) -> FrameFit:
    """Minimise the frames' loss with the matrix linear in the design; see `minimise`.

    Frames that fit much worse than most lose weight in every step, so that a wrong load cannot
    pull the others along.

    Parameters
    ----------
    measured : Measurements
        The frames.
    at : Unknowns
        Where to start.
    jacobian : DesignJacobian
        The matrix about a design.
    sound : ndarray of bool, shape (P,)
        Pixels to use.
    steps : int
        Largest number of steps.
    """
    prior = precision(measured, jacobian.deviations)
    origin = start(measured, len(at.design)).flat

    def expand(here: Unknowns) -> Expansion[Unknowns]:
        weight = pixel_weight(measured, here, sound)
        normal = linearised(measured, here, jacobian, weight)
        shares = frame_weights(normal.predicted.residuals, measured.averaged)

        def loss(place: Unknowns, predicted: Predictions) -> float:
            return _loss(predicted, weight, shares) + float(prior @ (place.flat - origin) ** 2)

        def ahead(step: Array) -> tuple[Unknowns, float]:
            reach = np.abs((here.design + step[: len(here.design)]) - jacobian.centre)
            there = here.moved(step * (LINEAR_REACH / reach.max(initial=LINEAR_REACH)))
            return there, loss(there, predict(measured, there, jacobian, weight))

        gradient = normal.gradient + prior * (here.flat - origin)
        return Expansion(
            loss(here, normal.predicted), gradient, lambda: normal.profiled + np.diag(prior), ahead
        )

    def within(place: Unknowns) -> bool:
        return bool(np.abs(place.design - jacobian.centre).max(initial=0.0) <= 0.99 * LINEAR_REACH)

    at = minimise(at, expand, steps, Stop(near=SMALLEST_GAIN), within).place
    weight = pixel_weight(measured, at, sound)
    normal = linearised(measured, at, jacobian, weight)
    return FrameFit(at, _covariance(measured, normal, prior), jacobian, normal)


def _covariance(measured: Measurements, normal: NormalEquations, prior: Array) -> Array:
    """Covariance of the shared unknowns, with frames' own light and the pixels' pattern free."""
    unknowns = len(prior)
    if measured.pattern is None:
        information = normal.profiled + np.diag(prior)
    else:
        pixels = measured.pattern.information(normal.pixels)
        information = eliminated(normal.whole, normal.coupling, pixels)
        information[np.diag_indices(unknowns)] += prior
    return np.asarray(np.linalg.inv(information), float)[:unknowns, :unknowns]


def small_phases(
    measured: Measurements, at: Unknowns, jacobian: DesignJacobian, limit: float
) -> Mask:
    """Frames whose phase is small enough, but never less than the calmest quarter, shape (F,)."""
    phase = measured.loads @ jacobian.matrix(at.design, at.positions(measured.sensor)).T
    peaks = np.abs(phase).max(axis=1)
    return peaks <= max(limit, float(np.quantile(peaks, 0.25)))


def consistent(
    measured: Measurements, at: Unknowns, jacobian: DesignJacobian, sound: Mask
) -> tuple[Mask, Mask]:
    """Pixels and frames that do not contradict the others, shapes (P,) and (F,).

    Parameters
    ----------
    measured : Measurements
        All frames.
    at : Unknowns
        Unknowns that explain the frames.
    jacobian : DesignJacobian
        The matrix about a design.
    sound : ndarray of bool, shape (P,)
        Pixels by which frames are judged.
    """
    seen_strip = on_strip(at.positions(measured.sensor), measured.sensor)
    used = sound & seen_strip
    left = predict(measured, at, jacobian, used.astype(float)).residuals
    single = left / np.sqrt(measured.averaged)[:, None]
    kept = ~checks.misfitting_frames(single[:, used])
    return ~(checks.misfitting_pixels(left[kept]) & seen_strip), kept


def _loss(predicted: Predictions, weight: Array, shares: Array) -> float:
    own = (predicted.drift**2).sum(axis=0) if predicted.drift.size else np.zeros(len(shares))
    return float(shares @ (predicted.residuals**2 @ weight + own))
