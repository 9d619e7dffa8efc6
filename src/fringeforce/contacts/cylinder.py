"""A rigid cylinder with dry friction on an elastic surface: pressure, stick and slip.

The surface is known by its compliance: how far it gives way beside a small force.  Pressure follows
from the shape of the cylinder where it touches, with no pull anywhere (Signorini's conditions);
shear follows from one displacement of all that sticks, and Coulomb's law where it slips (Cattaneo
and Mindlin's problem; K. L. Johnson, Contact Mechanics, 1985, chapters 5 and 7).  The normal force
comes first and meets no friction; then shear moves the surface and with it the pressure, and both
are solved in turn until neither changes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import InputError

SETTLED = 1e-7
"""Change of the shear over the normal force at which both are solved."""
ROUNDS = 200
"""Rounds in which places that touch, stick and slip must settle; they take some dozens."""


class Compliance(NamedTuple):
    """Displacement of a surface beside a small force, at equal steps.

    Attributes
    ----------
    step : float
        Between places, and width of the small force [m].
    down : ndarray, shape (2 n + 1,)
        Into the surface under a normal force, from n steps left of it to n right of it [m/N].
    along : ndarray, shape (2 n + 1,)
        Along x under a tangential force [m/N].
    down_by_tangential : ndarray, shape (2 n + 1,)
        Into the surface under a tangential force [m/N].
    """

    step: float
    down: Array
    along: Array
    down_by_tangential: Array

    def between(self, count: int) -> list[Array]:
        """Matrices from forces to displacements at so many places."""
        places = np.arange(count)
        beside = np.subtract.outer(places, places) + len(self.down) // 2
        return [part[beside] for part in self[1:]]


def cylinder_forces(
    compliance: Compliance, radius: float, normal: float, tangential: float, friction: float
) -> Array:
    """Small forces under a cylinder, shape (n + 1, 2), the middle one under its axis [N].

    Parameters
    ----------
    compliance : Compliance
        Of the surface, from -n to n steps; the contact must be narrower than n steps.
    radius : float
        Of the cylinder [m].
    normal, tangential : float
        Its forces [N].
    friction : float
        Largest shear over pressure.

    Raises
    ------
    InputError
        If the contact reaches further than the compliance is known.
    """
    count = len(compliance.down) // 2 + 1
    count -= 1 - count % 2
    down, along, down_by_tangential = compliance.between(count)
    gap = np.square((np.arange(count) - count // 2) * compliance.step) / (2 * radius)
    shear, pressure = np.zeros(count), np.zeros(count)
    for _ in range(ROUNDS):
        pressure = _pressed(down, gap + down_by_tangential @ shear, normal)
        if pressure[0] > 0 or pressure[-1] > 0:
            raise InputError(
                f"A cylinder of {radius * 1e3:g} mm under {normal:g} N makes a contact wider than "
                f"{(count - 1) * compliance.step * 1e3:.3g} mm; press less, or take a smaller one."
            )
        last, shear = shear, _sheared(along, pressure, tangential, friction)
        if np.abs(shear - last).max() < SETTLED * normal:
            break
    return np.column_stack([pressure, shear])


def _pressed(down: Array, gap: Array, normal: float) -> Array:
    """Forces that push nowhere from afar, and leave no overlap, by an active set."""
    touches = gap <= np.sort(gap)[min(8, len(gap) - 1)]
    forces = np.zeros(len(gap))
    for _ in range(ROUNDS):
        solved, approach = _with_sum(down, touches, -gap, normal)
        forces = np.maximum(solved, 0)
        overlap = approach - gap - down @ solved > 0
        now = np.where(touches, solved > 0, overlap)
        if (now == touches).all():
            break
        touches = now
    return forces


def _sheared(along: Array, pressure: Array, tangential: float, friction: float) -> Array:
    """Shear of what sticks together and slips elsewhere, by an active set."""
    limit, touches = friction * pressure, pressure > 0
    if abs(tangential) >= limit.sum() * (1 - 1e-12):
        return np.sign(tangential) * limit
    sticks, slips = touches.copy(), np.zeros(len(pressure))
    shear = np.zeros(len(pressure))
    for _ in range(ROUNDS):
        slipping = np.where(touches & ~sticks, slips * limit, 0.0)
        solved, moved = _with_sum(along, sticks, -along @ slipping, tangential - slipping.sum())
        shear = solved + slipping
        over = sticks & (np.abs(shear) > limit * (1 + 1e-9))
        # slip in the direction of the shear is no slip
        back = touches & ~sticks & ((along @ shear - moved) * slips > 0)
        if not (over.any() or back.any()):
            break
        slips = np.where(over, np.sign(shear), slips)
        sticks = (sticks & ~over) | back
    return shear


def _with_sum(matrix: Array, free: Mask, wanted: Array, total: float) -> tuple[Array, float]:
    """Forces at free places of a given sum, which displace them as wanted but for a constant."""
    own = np.flatnonzero(free)
    system = np.zeros((len(own) + 1, len(own) + 1))
    system[:-1, :-1], system[:-1, -1], system[-1, :-1] = matrix[np.ix_(own, own)], -1.0, 1.0
    solved = np.linalg.solve(system, np.append(wanted[own], total))
    forces = np.zeros(len(free))
    forces[own] = solved[:-1]
    return forces, float(solved[-1])
