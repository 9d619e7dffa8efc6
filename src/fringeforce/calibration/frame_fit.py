"""Frames with known loads against a model with unknowns: one step of Gauss and Newton at a time.

Unknowns, in this order: logarithms of design values, the camera's shift (in units of SHIFT) and
scale, coefficients of the amplitude and of the offset along the frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from fringeforce.calibration.design_tangent import DesignTangent
from fringeforce.design import Sensor
from fringeforce.force.likelihood import Response, misfit
from fringeforce.imaging import camera_response

Array = NDArray[np.float64]

SHIFT = 1e-3
"""Unit of the camera's shift [m]."""
PRIOR = {"design": 0.5, "shift": 2.0, "scale": 0.1, "amplitude": 0.5, "offset": 0.2}
"""Standard deviations of the unknowns before any frame is seen; light in units of A."""
FAR = 0.15
"""Change of a design value's logarithm up to which a tangent is followed."""
STAGES = (3.0, 10.0, np.inf)
"""Largest phase of the frames that enter, stage by stage: few fringes bear a rough model [rad]."""
DIMMEST = 1.0
"""Smallest amplitude of the light, where no fringe shows any [grey levels]."""
SUSPECT = 3.0
"""Times the median misfit beyond which a frame loses weight."""


@dataclass(frozen=True, eq=False)
class Bench:
    """What was measured.

    Attributes
    ----------
    sensor : Sensor
        The drawing.
    levels : ndarray, shape (F, P)
        Grey levels.
    loads : ndarray, shape (F, 2n)
        Known loads, normal ones first [N].
    basis : ndarray, shape (P, k)
        Smooth functions along the frame, which sum to one, for the lighting.
    """

    sensor: Sensor
    levels: Array
    loads: Array
    basis: Array

    def rows(self, chosen: NDArray[np.bool_]) -> Bench:
        """Some of the frames."""
        return replace(self, levels=self.levels[chosen], loads=self.loads[chosen])


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Values of the unknowns: design (d,), place (2,) of the camera, lights (k,) each."""

    design: Array
    place: Array
    amplitude: Array
    offset: Array

    @property
    def flat(self) -> Array:
        """All of them, shape (d + 2 + 2k,)."""
        return np.concatenate([self.design, self.place, self.amplitude, self.offset])

    def moved(self, step: Array) -> Unknowns:
        """The unknowns after a step of all of them."""
        ends = np.cumsum([len(self.design), 2, len(self.amplitude)])
        return Unknowns(*np.split(self.flat + step, ends))

    def positions(self, sensor: Sensor) -> Array:
        """Where the pixels look [m]."""
        return self.place[0] * SHIFT + (1 + self.place[1]) * sensor.pixel_positions

    def response(self, bench: Bench) -> Response:
        """Response of the camera under this lighting."""
        bright = np.maximum(bench.basis @ self.amplitude, DIMMEST)
        dark = np.maximum(bench.basis @ self.offset, 0.0)
        return camera_response(bench.sensor.camera, bright, dark)


@dataclass(frozen=True, eq=False)
class Fit:
    """Unknowns and what they leave.

    Attributes
    ----------
    unknowns : Unknowns
        The estimate.
    covariance : ndarray
        Of all unknowns, for unit reduced chi-square.
    slopes : ndarray, shape (F, P)
        Residuals in units of the noise.
    tangent : DesignTangent
        About which the matrix was linear.
    """

    unknowns: Unknowns
    covariance: Array
    slopes: Array
    tangent: DesignTangent


def light_basis(pixels: int, count: int) -> Array:
    """Cubic B-splines along the frame that sum to one, shape (pixels, count)."""
    degree = min(3, count - 1)
    inner = np.linspace(0, 1, count - degree + 1)
    knots = np.concatenate([np.zeros(degree), inner, np.ones(degree)])
    places = (np.arange(pixels) + 0.5) / pixels
    return BSpline.design_matrix(places, knots, degree).toarray()


def on_strip(positions: Array, sensor: Sensor) -> NDArray[np.bool_]:
    """Pixels that see the strip and not its end, shape (P,)."""
    margin = 2 * sensor.transducer.length / sensor.camera.pixels
    return np.abs(positions) < sensor.transducer.length / 2 - margin


def start(bench: Bench, parameters: int) -> Unknowns:
    """Unknowns as drawn."""
    camera, ones = bench.sensor.camera, np.ones(bench.basis.shape[1])
    lights = camera.amplitude * ones, camera.offset * ones
    return Unknowns(np.zeros(parameters), np.zeros(2), *lights)


def precision(bench: Bench, parameters: int) -> Array:
    """Inverse variances of the unknowns before any frame is seen."""
    size, k = bench.sensor.camera.amplitude, bench.basis.shape[1]
    deviations = np.concatenate(
        [
            np.full(parameters, PRIOR["design"]),
            [PRIOR["shift"], PRIOR["scale"]],
            np.full(k, PRIOR["amplitude"] * size),
            np.full(k, PRIOR["offset"] * size),
        ]
    )
    return 1 / deviations**2


def climb(
    bench: Bench, at: Unknowns, tangent: DesignTangent, sound: NDArray[np.bool_], steps: int = 12
) -> Fit:
    """Levenberg and Marquardt's method with the matrix linear in the design.

    Frames that fit much worse than most lose weight in every step, so that a wrong press cannot
    pull the others along.

    Parameters
    ----------
    bench : Bench
        The frames.
    at : Unknowns
        Where to start.
    tangent : DesignTangent
        The matrix about a design.
    sound : ndarray of bool, shape (P,)
        Pixels to use.
    steps : int
        Largest number of steps.
    """
    prior, origin = precision(bench, len(at.design)), start(bench, len(at.design)).flat
    damping, step = 1e-3, np.zeros(len(prior))
    for _ in range(steps):
        weight = (sound & on_strip(at.positions(bench.sensor), bench.sensor)).astype(float)
        slopes, gradient, hessian = linearised(bench, at, tangent, weight)
        shares = frame_weights(slopes)
        before = _loss(slopes, weight, shares) + prior @ (at.flat - origin) ** 2
        gradient = gradient + prior * (at.flat - origin)
        hessian = hessian + np.diag(prior)
        while damping < 1e9:
            step = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), -gradient)
            reach = np.abs((at.design + step[: len(at.design)]) - tangent.centre).max(initial=FAR)
            there = at.moved(step * (FAR / reach))
            left = residuals(bench, there, tangent)
            if _loss(left, weight, shares) + prior @ (there.flat - origin) ** 2 <= before:
                at, damping = there, damping / 10
                break
            damping *= 10
        far = np.abs(at.design - tangent.centre).max(initial=0.0) > 0.99 * FAR
        if far or step @ hessian @ step < 1e-4:
            break
    weight = (sound & on_strip(at.positions(bench.sensor), bench.sensor)).astype(float)
    slopes, _, hessian = linearised(bench, at, tangent, weight)
    return Fit(at, np.asarray(np.linalg.inv(hessian + np.diag(prior)), float), slopes, tangent)


def phase_and_matrix(bench: Bench, at: Unknowns, tangent: DesignTangent) -> tuple[Array, Array]:
    """Phase of every frame, shape (F, P), and matrix with derivatives, (1 + d, P, 2n)."""
    positions = at.positions(bench.sensor)
    return bench.loads @ tangent.matrix(at.design, positions).T, tangent.at(positions)


def residuals(bench: Bench, at: Unknowns, tangent: DesignTangent) -> Array:
    """Residuals of all frames in units of the noise, shape (F, P)."""
    response = at.response(bench)
    phase, _ = phase_and_matrix(bench, at, tangent)
    return misfit(bench.levels, response.level(phase), response).slope


def calm(bench: Bench, at: Unknowns, tangent: DesignTangent, limit: float) -> NDArray[np.bool_]:
    """Frames whose phase is small enough, but never less than the calmest quarter, shape (F,)."""
    peaks = np.abs(phase_and_matrix(bench, at, tangent)[0]).max(axis=1)
    return peaks <= max(limit, float(np.quantile(peaks, 0.25)))


def _loss(slopes: Array, weight: Array, shares: Array) -> float:
    return float(shares @ (slopes**2 @ weight))


def frame_weights(slopes: Array) -> Array:
    """Weights of frames by their residuals (F, P): less for those much worse than most, (F,)."""
    size = np.median(slopes**2, axis=1)
    return 1 / np.maximum(1, size / (SUSPECT * max(float(np.median(size)), 1e-12))) ** 2


def linearised(
    bench: Bench, at: Unknowns, tangent: DesignTangent, weight: Array
) -> tuple[Array, Array, Array]:
    """Residuals (F, P), half the gradient and half the Hessian of the loss by the unknowns."""
    response = at.response(bench)
    phase, parts = phase_and_matrix(bench, at, tangent)
    slopes = misfit(bench.levels, response.level(phase), response).slope
    sigma = np.sqrt(response.variance)
    weights = frame_weights(slopes)[:, None] * weight
    turn = response.slope(phase) / sigma
    along = bench.loads @ tangent.matrix(at.design, at.positions(bench.sensor), slope=True).T
    moving = [turn * (bench.loads @ part.T) for part in parts[1:]]
    moving += [turn * along * SHIFT, turn * along * bench.sensor.pixel_positions]
    light = np.sin(phase / 2) ** 2 / sigma
    dark = np.full_like(light, 1 / sigma)
    lit = (light, dark)
    basis = bench.basis
    corner = [[float((weights * a * b).sum()) for b in moving] for a in moving]
    side = [np.concatenate([(weights * a * b).sum(axis=0) @ basis for b in lit]) for a in moving]
    block = np.block(
        [[basis.T @ ((weights * a * b).sum(axis=0)[:, None] * basis) for b in lit] for a in lit]
    )
    hessian = np.block([[np.array(corner), np.array(side)], [np.array(side).T, block]])
    gradient = np.concatenate(
        [
            [float((weights * a * slopes).sum()) for a in moving],
            *[(weights * a * slopes).sum(axis=0) @ basis for a in lit],
        ]
    )
    return slopes, gradient, hessian
