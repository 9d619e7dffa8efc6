"""The influence matrix as a function of the design, to first order about one design."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.calibration.design_entries import (
    EFFECTS,
    POSITIONS,
    entries,
    varied,
)
from fringeforce.design.strip import Sensor
from fringeforce.models.strip import SensorModel, characterize

STEP = 0.004
"""Step of an entry for central differences."""
GRID = 2001
"""Places along the strip between which matrix and derivatives are interpolated."""


@dataclass(frozen=True, eq=False)
class DesignJacobian:
    """Influence matrix and its derivatives by the entries of a design.

    Attributes
    ----------
    centre : ndarray, shape (d,)
        Entries, as in `design_entries`; zero for the drawing.
    model : SensorModel
        The sensor characterised there.
    spline : CubicSpline
        Along the strip [m]; values of shape (1 + d, 2n): the matrix, then its derivatives.
    """

    centre: Array
    model: SensorModel
    spline: CubicSpline

    def at(self, x: ArrayLike, slope: bool = False) -> Array:
        """Matrix at the centre and derivatives, or all their slopes along x, (1 + d, m, 2n)."""
        half = self.model.sensor.transducer.length / 2
        values = self.spline(np.clip(x, -half, half), int(slope))
        return np.moveaxis(values, 1, 0)

    def matrix(self, design: Array, x: ArrayLike, slope: bool = False) -> Array:
        """Matrix of a design near the centre, or its slope along x, shape (m, 2n)."""
        parts = self.at(x, slope)
        return parts[0] + np.tensordot(design - self.centre, parts[1:], 1)


def design_jacobian(
    sensor: Sensor, paths: tuple[str, ...], centre: Array, step: float = STEP
) -> DesignJacobian:
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
        Step of the central differences; the mesh follows the design, so it must be well above the
        finite elements' relative error.

    Raises
    ------
    InputError
        For a strip in three dimensions, whose elements are too coarse for such differences.
    """
    if sensor.transducer.plane == "3d":
        raise InputError(
            'Derivatives by values of a design need transducer.plane = "stress" or "strain", not '
            '"3d"; calibrate, plan or compare with one of these.'
        )
    middle = characterize(varied(sensor, paths, centre))
    half = sensor.transducer.length / 2
    grid = np.linspace(-half, half, GRID)
    values = [middle.influence(grid)]
    owners = np.array(entries(sensor, paths))
    for path in paths:
        if path in EFFECTS:  # the phase is proportional to it
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
        values += [change * own[:, None] for own in np.eye(change.shape[1])]
    stacked = np.stack(values, axis=1).reshape(GRID, len(values), -1)
    return DesignJacobian(centre, middle, CubicSpline(grid, stacked))
