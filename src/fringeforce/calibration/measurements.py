"""What was measured, and the unknowns that explain it.

Unknowns, in this order: the design's entries, the camera's shift (in units of SHIFT) and scale,
coefficients of the amplitude and of the offset along the frame.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.calibration.light.fixed_pattern_noise import FixedPatternNoise
from fringeforce.design.strip import Sensor
from fringeforce.estimation.likelihood import Response
from fringeforce.models.imaging import camera_response

SHIFT = 1e-3
"""Unit of the camera's shift [m]."""
DIMMEST = 1.0
"""Smallest amplitude of the light, where no fringe shows any [grey levels]."""


@dataclass(frozen=True, eq=False)
class Measurements:
    """What was measured.

    Attributes
    ----------
    sensor : Sensor
        The drawing.
    levels : ndarray, shape (F, P)
        Grey levels.
    loads : ndarray, shape (F, 2n)
        Known loads, each ordered like `forces.ravel()` [N].
    basis : ndarray, shape (P, k)
        Smooth functions along the frame, which sum to one, for the lighting.
    turned : ndarray, shape (F,)
        Phase that the analyser adds: pi where it is parallel, zero where it is crossed [rad].
    averaged : ndarray, shape (F,)
        How many frames each row is the mean of.
    pattern : FixedPatternNoise, optional
        What single pixels add to the smooth lighting.
    drift : pair of float
        Standard deviations of a frame's own gain, and of its own offset in grey levels.
    """

    sensor: Sensor
    levels: Array
    loads: Array
    basis: Array
    turned: Array = field(default_factory=lambda: np.zeros(1))
    averaged: Array = field(default_factory=lambda: np.ones(1))
    pattern: FixedPatternNoise | None = None
    drift: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        for name in ("turned", "averaged"):
            whole = np.broadcast_to(getattr(self, name), len(self.levels))
            object.__setattr__(self, name, whole)

    def rows(self, chosen: Mask) -> Measurements:
        """Some of the frames."""
        return replace(
            self,
            levels=self.levels[chosen],
            loads=self.loads[chosen],
            turned=self.turned[chosen],
            averaged=self.averaged[chosen],
        )


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

    def response(self, measured: Measurements) -> Response:
        """Response of the camera under this lighting."""
        lights = np.stack([measured.basis @ self.amplitude, measured.basis @ self.offset])
        if measured.pattern is not None:
            lights = lights + measured.pattern.levels
        return camera_response(measured.sensor.camera, *np.maximum(lights, [[DIMMEST], [0.0]]))
