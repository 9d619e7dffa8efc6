"""What the levels of frames and the matrix of every pixel change with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.design_jacobian import DesignJacobian
from fringeforce.calibration.measurements import SHIFT, Measurements, Unknowns

EVERY = slice(None)
"""All pixels."""


@dataclass(frozen=True, eq=False)
class Derivatives:
    """What the levels of every frame change with, in units of the noise.

    Attributes
    ----------
    loads : ndarray, shape (F, 2n)
        Known loads [N].
    weights : ndarray, shape (F, P)
        Weights of all levels.
    turn : ndarray, shape (F, P)
        Derivative by the phase [1/rad].
    lit : ndarray, shape (2, F, P)
        Derivatives by amplitude and offset [1 / grey levels].
    changes : ndarray, shape (d + 2, P, 2n)
        Derivatives of the matrix by the design and the camera's place [rad/N].
    """

    loads: Array
    weights: Array
    turn: Array
    lit: Array
    changes: Array

    def by_matrix(self, levels: Array) -> Array:
        """Mixed derivatives by every pixel's matrix and what changes levels (..., F, P)."""
        return np.swapaxes(self.weights * self.turn * levels, -1, -2) @ self.loads


def matrix_changes(
    measured: Measurements, at: Unknowns, jacobian: DesignJacobian, pixels: slice = EVERY
) -> Array:
    """Derivatives of the matrix by the design and the camera's place, shape (d + 2, p, 2n).

    Parameters
    ----------
    measured, at, jacobian
        Frames, their explanation, and the matrix about a design.
    pixels : slice
        Pixels that are wanted.
    """
    positions = at.positions(measured.sensor)[pixels]
    slope = jacobian.matrix(at.design, positions, slope=True)
    along = np.stack([slope * SHIFT, slope * measured.sensor.pixel_positions[pixels, None]])
    return np.concatenate([jacobian.at(positions)[1:], along])
