"""Derivatives of the matrix of every pixel."""

from __future__ import annotations

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.design_jacobian import DesignJacobian
from fringeforce.calibration.measurements import SHIFT, Measurements, Unknowns

EVERY = slice(None)
"""All pixels."""


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
