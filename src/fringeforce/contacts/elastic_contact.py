"""A rigid body with dry friction on an elastic surface in three dimensions: pressure and shear.

The surface is known by its compliance: how far it gives way beside a small force.  Pressure follows
from the shape of the body where it touches, with no pull anywhere, by conjugate gradients with
Fourier convolutions (Polonsky and Keer, Wear 231, 206-219, 1999).  Shear with stick and slip is the
friction times the difference of two pressures, those under the whole normal force N and under
N - |T| / friction (Cattaneo and Mindlin for spheres; J. Jaeger, Arch. Appl. Mech. 65, 478-487,
1995, and Ciavarella, Int. J. Solids Struct. 35, 2349-2362, 1998, for other shapes).  That is exact
where shear does not act on pressure and both compliances are proportional, and an approximation on
layers.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError

LEAST_SLIP = 1e-3
"""Share of the force by which two pressures differ at least, whose difference is the shear."""
SETTLED = 1e-7
"""Change of all pressures over the normal force at which they are solved."""
ROUNDS = 2000
"""Rounds of conjugate gradients; they take some dozens, for thin layers under wide bodies more."""


@dataclass(frozen=True, eq=False)
class Compliance:
    """Displacement into a surface beside a small normal force, on a square grid.

    Attributes
    ----------
    step : float
        Distance of the places, and side of the square under the small force [m].
    down : ndarray, shape (2 n - 1, 2 n - 1)
        Displacement from n - 1 steps left of it to n - 1 steps right of it, and alike across [m/N].
    """

    step: float
    down: Array

    @property
    def count(self) -> int:
        """Places n along either side of the grid."""
        return (len(self.down) + 1) // 2

    @cached_property
    def _spectrum(self) -> NDArray[np.complex128]:
        size, n = len(self.down) + 1, self.count
        padded = np.zeros((size, size))
        padded[:-1, :-1] = self.down
        return np.fft.rfft2(np.roll(padded, (1 - n, 1 - n), axis=(0, 1)))

    def displacement(self, forces: Array) -> Array:
        """Into the surface under forces, both of shape (n, n) [m]."""
        size, n = (len(self.down) + 1,) * 2, self.count
        return np.fft.irfft2(self._spectrum * np.fft.rfft2(forces, size), size)[:n, :n]


def pressed(compliance: Compliance, gap: Array, normal: float) -> Array:
    """Forces under a rigid body that push nowhere from afar and leave no overlap, shape (n, n) [N].

    Parameters
    ----------
    compliance : Compliance
        Of the surface.
    gap : ndarray, shape (n, n)
        Between body and surface where they only just touch [m]; infinite where there is no body.
    normal : float
        Force on the body [N].

    Raises
    ------
    InputError
        If the contact reaches the end of the grid.
    """
    body = np.isfinite(gap)
    height = np.where(body, gap, 0.0)
    forces = np.where(body & (height <= np.median(height[body])), 1.0, 0.0)
    forces *= normal / forces.sum()
    way, before, conjugate = np.zeros_like(forces), 1.0, False
    for _ in range(ROUNDS):
        touches = forces > 0
        apart = compliance.displacement(forces) + height
        apart -= apart[touches].mean()
        square = float(np.square(apart[touches]).sum())
        way = np.where(touches, apart + (square / before * way if conjugate else 0.0), 0.0)
        change = compliance.displacement(way)
        change -= change[touches].mean()
        length = float((apart * way)[touches].sum() / (change * way)[touches].sum())
        last, forces = forces, np.maximum(forces - length * way, 0.0)
        overlap = body & (forces == 0) & (apart < 0)
        forces[overlap] -= length * apart[overlap]
        before, conjugate = square, not overlap.any()
        forces *= normal / forces.sum()
        if np.abs(forces - last).sum() < SETTLED * normal:
            break
    edge = np.ones_like(body)
    edge[1:-1, 1:-1] = False
    if forces[edge].any():
        raise InputError(
            f"A contact under {normal:g} N is wider than the "
            f"{compliance.count * compliance.step * 1e3:.3g} mm that were looked at; press less, "
            "or take a smaller body."
        )
    return forces


def body_forces(
    compliance: Compliance,
    gap: Array,
    normal: float,
    tangential: tuple[float, float],
    friction: float,
) -> Array:
    """Normal and tangential forces under a rigid body, shape (n, n, 3) [N].

    Parameters
    ----------
    compliance, gap, normal
        As of `pressed`.
    tangential : (float, float)
        Force on the body along x (first axis) and y, after the normal one [N].
    friction : float
        Largest shear over pressure.
    """
    pressure = pressed(compliance, gap, normal)
    size = float(np.hypot(*tangential))
    shear = np.zeros_like(pressure)
    if size > 0:
        less = min(normal - size / friction, (1 - LEAST_SLIP) * normal)
        held = pressed(compliance, gap, less) if less > normal * SETTLED else 0.0
        shear = (pressure - held) / (normal - max(less, 0.0))
    return np.stack([pressure, shear * tangential[0], shear * tangential[1]], axis=-1)
