"""The influence matrix as a function of the design, to first order about one design."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from fringeforce.calibration.design_entries import (
    POSITIONS,
    STRAIN_OPTIC,
    design_value,
    entries,
    prior,
    varied,
)
from fringeforce.design import Sensor
from fringeforce.model import SensorModel, characterize

__all__ = ["STRAIN_OPTIC", "DesignTangent", "design_tangent", "design_value", "varied"]

Array = NDArray[np.float64]

STEP = 0.004
"""Step of an entry for central differences."""
GRID = 2001
"""Places along the strip between which matrix and derivatives are interpolated."""


@dataclass(frozen=True, eq=False)
class DesignTangent:
    """Influence matrix and its derivatives by the entries of a design.

    Attributes
    ----------
    centre : ndarray, shape (d,)
        Entries, as in `design_entries`; zero for the drawing.
    model : SensorModel
        The sensor characterised there.
    spline : CubicSpline
        Along the strip [m]; values of shape (1 + d, 2n): the matrix, then its derivatives.
    deviations : ndarray, shape (d,)
        Standard deviations of the entries before any frame is seen.
    """

    centre: Array
    model: SensorModel
    spline: CubicSpline
    deviations: Array

    def at(self, x: ArrayLike, slope: bool = False) -> Array:
        """Matrix at the centre and derivatives, or all their slopes along x, (1 + d, m, 2n)."""
        half = self.model.sensor.transducer.length / 2
        values = self.spline(np.clip(x, -half, half), int(slope))
        return np.moveaxis(values, 1, 0)

    def matrix(self, design: Array, x: ArrayLike, slope: bool = False) -> Array:
        """Matrix of a design near the centre, or its slope along x, shape (m, 2n)."""
        parts = self.at(x, slope)
        return parts[0] + np.tensordot(design - self.centre, parts[1:], 1)


def design_tangent(
    sensor: Sensor, paths: tuple[str, ...], centre: Array, step: float = STEP
) -> DesignTangent:
    """Characterise a varied design and differentiate by every varied value.

    Parameters
    ----------
    sensor : Sensor
        The drawing.
    paths : tuple of str, length d
        Dotted paths of the values.
    centre : ndarray, shape (d,)
        Entries of the design.
    step : float
        Of the central differences; the mesh follows the design, so it must be well above the
        finite elements' relative error.
    """
    middle = characterize(varied(sensor, paths, centre))
    half = sensor.transducer.length / 2
    grid = np.linspace(-half, half, GRID)
    values = [middle.influence(grid)]
    owners = np.array(entries(sensor, paths))
    for path in paths:
        if path == STRAIN_OPTIC:  # the phase is proportional to it, equation (2)
            values.append(values[0])
            continue
        unit = (owners == path).astype(float)
        ahead, behind = (
            characterize(varied(sensor, paths, centre + sign * step * unit)).influence(grid)
            for sign in (1, -1)
        )
        change = (ahead - behind) / (2 * step)
        if path != POSITIONS:
            values.append(change)
            continue
        # a tactel's place moves nothing but its own columns: all are differentiated at once
        values += [change * own for own in np.eye(change.shape[2])]
    stacked = np.stack(values, axis=1).reshape(GRID, len(values), -1)
    return DesignTangent(centre, middle, CubicSpline(grid, stacked), prior(sensor, paths))
