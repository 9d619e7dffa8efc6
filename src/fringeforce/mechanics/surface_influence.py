"""What tractions anywhere on the strip's surface do, from line loads at many places.

The stress below the cover changes smoothly with the place of a load: what is narrower than the
cover is thick does not pass through it.  Line loads at a fifth of its thickness, with a spline of
fifth degree between them, therefore give any place to the accuracy of the finite elements, and the
spline's integral gives any width.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, make_interp_spline

from fringeforce.base.arrays import Array
from fringeforce.design.strip import Transducer
from fringeforce.mechanics.mesh import strip_mesh
from fringeforce.mechanics.solid.strip import LightLine, line_stress
from fringeforce.mechanics.stress import unit_stress

DEGREE = 5
"""Degree of the spline over the places of line loads."""
SPACING = 0.2
"""Between line loads, in thicknesses of the cover."""
MARGIN = 0.6
"""Line loads beyond the part that is asked for, in thicknesses of the cover."""
ELEMENT = 0.4
"""Largest element under the line loads, in thicknesses of the cover: to 1e-4 of the peak in plane
stress and 4e-4 in plane strain; half of it gains nothing."""
POINT = 1e-6
"""Width below which a contact is a line, in thicknesses of the cover."""


@dataclass(frozen=True, eq=False)
class SurfaceInfluence:
    """Depth integral of the stress difference that the light sees, per force at any place.

    Attributes
    ----------
    places : ndarray, shape (k,)
        Places of line loads, evenly spaced along the strip [m].
    stress : ndarray, shape (m, k, 2)
        Under a normal and a tangential unit force at each [Pa m / N].
    narrow : float
        Width below which a contact is a line [m].
    ends : tuple of bool
        Whether the line loads reach the left and the right end of the strip.
    """

    places: Array
    stress: Array
    narrow: float
    ends: tuple[bool, bool] = (False, False)

    @cached_property
    def _unit(self) -> BSpline:
        """Share of each line load in a load at any place."""
        spline: BSpline = make_interp_spline(self.places, np.eye(len(self.places)), k=DEGREE)
        return spline

    @cached_property
    def _integral(self) -> BSpline:
        return self._unit.antiderivative()

    def covers(self, centres: Array, widths: Array) -> bool:
        """Whether line loads lie all over contacts [m], or the strip ends there."""
        first, last = self.places[[0, -1]]
        low, high = np.min(centres - widths / 2), np.max(centres + widths / 2)
        return bool((low >= first or self.ends[0]) and (high <= last or self.ends[1]))

    def shares(self, centres: ArrayLike, widths: ArrayLike) -> Array:
        """Line loads that act together like contacts under a uniform traction.

        Parameters
        ----------
        centres, widths : array_like, shape (c,)
            Places and widths of contacts [m]; what reaches beyond the line loads is moved to
            their end.

        Returns
        -------
        ndarray, shape (c, k)
            Share of each contact's force.
        """
        first, last = self.places[[0, -1]]
        half = np.minimum(np.asarray(widths, dtype=float) / 2, (last - first) / 2)
        middle = np.clip(np.asarray(centres, dtype=float), first + half, last - half)
        line = self._unit(middle)
        wide = 2 * half > self.narrow
        if wide.any():
            ends = self._integral(middle[wide] + half[wide])
            line[wide] = (ends - self._integral(middle[wide] - half[wide])) / (2 * half[wide, None])
        return np.asarray(line, dtype=np.float64)

    def under(self, centres: ArrayLike, widths: ArrayLike) -> Array:
        """Depth integral per unit force of contacts, shape (m, c, 2) [Pa m / N]."""
        return np.einsum("mkt,ck->mct", self.stress, self.shares(centres, widths), optimize=True)


def surface_influence(
    transducer: Transducer, first: float, last: float, x: Array, line: LightLine | None = None
) -> SurfaceInfluence:
    """Solve for line loads along a part of the surface.

    Parameters
    ----------
    transducer : Transducer
        The strip.
    first, last : float
        Ends of the part [m], on the strip.
    x : ndarray, shape (m,)
        Where the stress is wanted [m].
    line : LightLine, optional
        What the light crosses, to solve the strip in three dimensions.
    """
    drawn = transducer if line is None else line.like or transducer
    cover = drawn.compliant.thickness
    # a load at the very end of the strip has no elements on one side
    end = transducer.length / 2 - SPACING * cover
    # a spline is best inside its outermost places
    low, high = np.clip([first - MARGIN * cover, last + MARGIN * cover], -end, end)
    ends = bool(low <= -end), bool(high >= end)
    if line is not None:
        step = SPACING * cover
        numbers = np.arange(np.ceil(-end / step), np.floor(end / step) + 1)
        near = (numbers * step > low - step) & (numbers * step < high + step)
        places = numbers[near] * step
        stress = line_stress(transducer, places, x, line)
        return SurfaceInfluence(places, stress, POINT * cover, ends)
    count = max(int(np.ceil((high - low) / (SPACING * cover))) + 1, DEGREE + 1)
    places = np.linspace(low, high, count)
    # an even number of elements: a strip that is its own mirror image is solved by halves
    elements = 2 * int(np.ceil((high - low) / (2 * ELEMENT * cover)))
    mesh = strip_mesh(transducer, np.linspace(low, high, elements + 1))
    stress = unit_stress(transducer, places, mesh, x)
    return SurfaceInfluence(places, stress, POINT * cover, ends)
