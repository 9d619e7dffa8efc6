"""The influence matrix as a function of the design, to first order about one design."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from fringeforce.design import Sensor
from fringeforce.errors import InputError
from fringeforce.model import SensorModel, characterize

Array = NDArray[np.float64]

STEP = 0.004
"""Step of the logarithm of a design value for central differences."""
SETTLED = 1e-3
"""Change of a design value's logarithm below which a tangent is as good as the matrix itself."""
GRID = 2001
"""Places along the strip between which matrix and derivatives are interpolated."""
STRAIN_OPTIC = "transducer.photoelastic.strain_optic_coefficient"


@dataclass(frozen=True, eq=False)
class DesignTangent:
    """Influence matrix and its derivatives by logarithms of design values.

    Attributes
    ----------
    centre : ndarray, shape (d,)
        Logarithms of the values over those of the drawing.
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

    def plus(self, change: Array) -> DesignTangent:
        """The same derivatives of a matrix that differs by values (GRID, 2n) on the grid."""
        values = np.array(self.spline(self.spline.x))
        values[:, 0] += change
        return replace(self, spline=CubicSpline(self.spline.x, values))


def design_value(sensor: Sensor, path: str) -> float:
    """Value of a design at a dotted path.

    Raises
    ------
    InputError
        If the path does not name a number other than zero.
    """
    value: object = sensor
    for part in path.split("."):
        value = getattr(value, part, None)
    if isinstance(value, bool) or not isinstance(value, int | float) or value == 0:
        raise InputError(
            f"{path!r} names no number of a design that can be calibrated; take dotted paths such "
            f"as {STRAIN_OPTIC!r} or 'transducer.compliant.thickness'."
        )
    return float(value)


def varied(sensor: Sensor, paths: tuple[str, ...], logarithms: Array) -> Sensor:
    """The drawing with some values multiplied by the exponentials of given logarithms."""
    factors = np.exp(logarithms).tolist()
    values = {p: design_value(sensor, p) * f for p, f in zip(paths, factors, strict=True)}
    return sensor.replace(**values)


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
        Logarithms of the values over those of the drawing.
    step : float
        Of the central differences; the mesh follows the design, so it must be well above the
        finite elements' relative error.
    """
    middle = characterize(varied(sensor, paths, centre))
    half = sensor.transducer.length / 2
    grid = np.linspace(-half, half, GRID)
    values = [middle.influence(grid)]
    for path, unit in zip(paths, np.eye(len(paths)), strict=True):
        if path == STRAIN_OPTIC:  # the phase is proportional to it, equation (2)
            values.append(values[0])
            continue
        ahead, behind = (
            characterize(varied(sensor, paths, centre + sign * step * unit)).influence(grid)
            for sign in (1, -1)
        )
        values.append((ahead - behind) / (2 * step))
    stacked = np.stack(values, axis=1).reshape(GRID, 1 + len(paths), -1)
    return DesignTangent(centre, middle, CubicSpline(grid, stacked))


def followed(
    sensor: Sensor, paths: tuple[str, ...], design: Array, tangent: DesignTangent
) -> DesignTangent:
    """A tangent at another design, or the old one if that is near enough."""
    if np.abs(design - tangent.centre).max(initial=0.0) < SETTLED:
        return tangent
    return design_tangent(sensor, paths, design)
