"""The two mirror planes of a box: a quarter stands for the whole, in four classes of symmetry.

Whatever loads a box, it is the sum of four parts, each even or odd in either mirror; the
displacements of an even part are their own mirror image, those of an odd part its negative.  A
quarter of the box carries each part once its inner faces are held as mirrors demand.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse import csr_array, diags_array

from fringeforce.base.arrays import Array, Mask
from fringeforce.mechanics.elements import interpolation, shape_functions
from fringeforce.mechanics.gauss_rule import gauss_rule
from fringeforce.mechanics.solid.block import Sides

EVEN, ODD = 1, -1


@dataclass(frozen=True)
class Mirror:
    """The mirror across one axis, 0 for x or 1 for y, and how a part of the load behaves in it."""

    axis: int
    parity: int  # EVEN or ODD

    def of(self, component: int) -> int:
        """Parity of a component of displacements or forces as a function along the axis."""
        return -self.parity if component == self.axis else self.parity

    @property
    def held_inside(self) -> Mask:
        """Components that are zero on the mirror plane, shape (3,)."""
        return np.array([self.of(component) == ODD for component in range(3)])

    def held_outside(self, sides: Sides) -> Mask:
        """Components that are zero on the side opposite to the mirror plane, shape (3,)."""
        if sides == "roller":
            return np.arange(3) == self.axis
        return np.full(3, sides == "bonded")


def mirrored_interpolation(
    order: int, breaks: Array, points: Array, parity: int
) -> tuple[csr_array, csr_array]:
    """Values and slopes of a function known from the mirror plane outwards, at any place.

    Where two elements meet, slopes are the mean of both sides, which cancels the leading part of
    their errors.

    Parameters
    ----------
    order : int
        Polynomial order.
    breaks : ndarray, shape (e + 1,)
        Element boundaries, from 0 on the mirror plane upwards [m].
    points : ndarray, shape (m,)
        Where to evaluate, on either side of the mirror [m].
    parity : int
        EVEN or ODD.

    Returns
    -------
    values, slopes : sparse array, shape (m, order * e + 1)
        Applied to coefficients they give the function and its derivative [1/m].
    """
    distance = np.abs(points)
    left, right = (interpolation(order, breaks, distance, side) for side in ("left", "right"))
    halves = (np.where(points > 0, 1, parity) + np.where(points < 0, parity, 1)) / 2
    turned = (np.where(points > 0, 1, -parity) + np.where(points < 0, -parity, 1)) / 2
    values = diags_array(halves) @ right[0]
    slopes = diags_array(turned) @ ((left[1] + right[1]) / 2)
    return csr_array(values), csr_array(slopes)


def mirrored_load(order: int, breaks: Array, place: float, size: float, parity: int) -> Array:
    """One dimension of a unit load's part, as forces on the shape functions of half an axis.

    Parameters
    ----------
    order, breaks, parity
        As for `mirrored_interpolation`.
    place : float
        Centre of the load, zero or positive [m].
    size : float
        Length over which it is spread evenly [m]; zero is a point.

    Returns
    -------
    ndarray, shape (order * e + 1,)
        Dimensionless; they add up to half of one for an even part, the other half being the
        mirror's.
    """
    if size == 0:
        share = (1 + parity) / 4 if place == 0 else 0.5
        return share * interpolation(order, breaks, np.array([place]))[0].toarray()[0]
    near, far = place - size / 2, place + size / 2
    # what lies beyond the mirror plane comes back as the image's
    image = parity * _integral(order, breaks, -far, -near)
    return (_integral(order, breaks, near, far) + image) / (2 * size)


def _integral(order: int, breaks: Array, lowest: float, highest: float) -> Array:
    """Integrals of all shape functions over an interval, shape (order * e + 1,) [m]."""
    result = np.zeros(order * (len(breaks) - 1) + 1)
    points, weights = gauss_rule(order)
    for e, (start, end) in enumerate(pairwise(breaks)):
        low, high = max(lowest, start), min(highest, end)
        if high <= low:
            continue
        places = (low + high) / 2 + (high - low) / 2 * points
        values, _ = shape_functions(order, (places - start) / (end - start))
        result[e * order : (e + 1) * order + 1] += values @ weights * (high - low) / 2
    return result
