"""The unknowns of a calibration, and how the frames of known presses depend on them.

In this order: logarithms of design values, the camera's shift (in units of SHIFT) and scale,
coefficients of the amplitude and of the offset along the frame.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from fringeforce.calibration.design_tangent import DesignTangent
from fringeforce.design import Sensor
from fringeforce.force.likelihood import Response
from fringeforce.imaging import camera_response

Array = NDArray[np.float64]

SHIFT = 1e-3
"""Unit of the camera's shift [m]."""
PRIOR = {"design": 0.5, "shift": 2.0, "scale": 0.1, "amplitude": 0.5, "offset": 0.2}
"""Standard deviations of the unknowns before any frame is seen; light in units of A."""


@dataclass(frozen=True, eq=False)
class Presses:
    """Known loads on a sensor under smooth lighting.

    Attributes
    ----------
    sensor : Sensor
        The drawing.
    loads : ndarray, shape (F, 2n)
        Known loads, normal ones first [N].
    basis : ndarray, shape (P, k)
        Smooth functions along the frame, which sum to one, for the lighting.
    """

    sensor: Sensor
    loads: Array
    basis: Array


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

    def response(self, presses: Presses) -> Response:
        """Response of the camera under this lighting."""
        lights = (np.maximum(presses.basis @ c, 0.0) for c in (self.amplitude, self.offset))
        return camera_response(presses.sensor.camera, *lights)


@dataclass(frozen=True, eq=False)
class LevelSlopes:
    """Derivatives of the expected grey levels by all unknowns, in units of the noise.

    Attributes
    ----------
    moving : ndarray, shape (d + 2, F, P)
        By the design and the camera's place.
    lit : ndarray, shape (2, F, P)
        By amplitude and offset at the pixel.
    basis : ndarray, shape (P, k)
        Smooth functions that make up the lighting.
    """

    moving: Array
    lit: Array
    basis: Array

    def gradient(self, levels: Array) -> Array:
        """Sum over pixels and frames of derivatives times some (F, P), shape (d + 2 + 2k,)."""
        light = np.einsum("afp,fp->ap", self.lit, levels) @ self.basis
        return np.concatenate([np.einsum("afp,fp->a", self.moving, levels), *light])

    def information(self, weights: Array) -> Array:
        """Fisher's information on all unknowns in pixels of weights (F, P)."""
        basis = self.basis
        corner = [[float((weights * a * b).sum()) for b in self.moving] for a in self.moving]
        side = [
            np.concatenate([(weights * a * b).sum(axis=0) @ basis for b in self.lit])
            for a in self.moving
        ]
        block = np.block(
            [
                [basis.T @ ((weights * a * b).sum(axis=0)[:, None] * basis) for b in self.lit]
                for a in self.lit
            ]
        )
        return np.block([[np.array(corner), np.array(side)], [np.array(side).T, block]])

    def frames(self) -> Iterator[LevelSlopes]:
        """The derivatives of one frame after the other."""
        for row in range(self.moving.shape[1]):
            one = slice(row, row + 1)
            yield replace(self, moving=self.moving[:, one], lit=self.lit[:, one])

    @property
    def dense(self) -> Array:
        """Unknown by unknown, shape (d + 2 + 2k, F, P)."""
        lights = self.lit[:, None] * self.basis.T[None, :, None]
        return np.concatenate([self.moving, *lights])


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


def start(presses: Presses, parameters: int) -> Unknowns:
    """Unknowns as drawn."""
    camera, ones = presses.sensor.camera, np.ones(presses.basis.shape[1])
    lights = camera.amplitude * ones, camera.offset * ones
    return Unknowns(np.zeros(parameters), np.zeros(2), *lights)


def precision(presses: Presses, parameters: int) -> Array:
    """Inverse variances of the unknowns before any frame is seen."""
    size, k = presses.sensor.camera.amplitude, presses.basis.shape[1]
    deviations = np.concatenate(
        [
            np.full(parameters, PRIOR["design"]),
            [PRIOR["shift"], PRIOR["scale"]],
            np.full(k, PRIOR["amplitude"] * size),
            np.full(k, PRIOR["offset"] * size),
        ]
    )
    return 1 / deviations**2


def phase_and_matrix(presses: Presses, at: Unknowns, tangent: DesignTangent) -> tuple[Array, Array]:
    """Phase of every frame, shape (F, P), and matrix with derivatives, (1 + d, P, 2n)."""
    positions = at.positions(presses.sensor)
    return presses.loads @ tangent.matrix(at.design, positions).T, tangent.at(positions)


def level_slopes(presses: Presses, at: Unknowns, tangent: DesignTangent) -> LevelSlopes:
    """Derivatives of the grey levels that are expected of presses."""
    response, positions = at.response(presses), at.positions(presses.sensor)
    phase, parts = phase_and_matrix(presses, at, tangent)
    sigma = np.sqrt(response.variance)
    turn = response.slope(phase) / sigma
    along = turn * (presses.loads @ tangent.matrix(at.design, positions, slope=True).T)
    moving = [turn * (presses.loads @ part.T) for part in parts[1:]]
    moving += [along * SHIFT, along * presses.sensor.pixel_positions]
    light = np.sin(phase / 2) ** 2 / sigma
    lit = np.stack([light, np.full_like(light, 1 / sigma)])
    return LevelSlopes(np.stack(moving), lit, presses.basis)
