"""The influence matrix as a function of the design, to first order about one design."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from fringeforce.base.arrays import Array
from fringeforce.calibration.design_entries import (
    EFFECTS,
    POSITIONS,
    entries,
    varied,
)
from fringeforce.design.strip import Sensor
from fringeforce.mechanics.solid.strip import QUICK
from fringeforce.mechanics.surface_influence import surface_influence
from fringeforce.models.strip import SensorModel, characterize
from fringeforce.models.strip_width import light_line
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

STEP = 0.004
"""Step of an entry for central differences."""
PLACES = 2001
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
    """
    middle = characterize(varied(sensor, paths, centre))
    if sensor.skin is not None:  # whose line loads are as dense as its cover is thin
        sensor = sensor.replace(**{"skin.resolution": middle.sensor.tactels.pitch})
    half = sensor.transducer.length / 2
    grid = np.linspace(-half, half, PLACES)
    values = [middle.influence(grid)]
    owners = np.array(entries(sensor, paths))
    for path in paths:
        if path in EFFECTS:  # the phase is proportional to it
            values.append(values[0])
            continue
        unit = (owners == path).astype(float)
        ahead, behind = (
            _influence(varied(sensor, paths, centre + sign * step * unit), sensor, grid)
            for sign in (1, -1)
        )
        change = (ahead - behind) / (2 * step)
        if path != POSITIONS:
            values.append(change)
            continue
        # a tactel's place moves nothing but its own columns: all are differentiated at once
        values += [change * own[:, None] for own in np.eye(change.shape[1])]
    stacked = np.stack(values, axis=1).reshape(PLACES, len(values), -1)
    return DesignJacobian(centre, middle, CubicSpline(grid, stacked))


def _influence(made: Sensor, drawn: Sensor, x: Array) -> Array:
    """Influence of a varied design, shape (m, n, 2); of a solid with bricks like the drawing's."""
    line = light_line(made.transducer, made.camera, drawn.transducer, QUICK)
    if line is None:
        return characterize(made).influence(x)
    tactels = made.tactels
    centres, width = tactels.positions + tactels.placement, tactels.contact_width
    first, last = centres[0] - width / 2, centres[-1] + width / 2
    surface = surface_influence(made.transducer, first, last, x, line)
    constant = stress_optic_constant(made.transducer.photoelastic, made.polariscope.wavelength)
    return phase_lead(surface.under(centres, np.full(tactels.count, width)), constant)
