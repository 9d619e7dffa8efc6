"""Loads on the surface of a strip under large strain: dead ones, and ones that turn with it.

Dead loads keep their direction and their size per undeformed length.  Follower loads keep their
angle to the deformed surface, as the pressure of a fluid does (Bonet and Wood, Nonlinear Continuum
Mechanics for Finite Element Analysis, 2008, chapter 8; Wriggers, Nonlinear Finite Element Methods,
2008, chapter 4).  The derivative of theirs by the displacements is not symmetric.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Protocol, Self

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fringeforce.base.arrays import Array, Index
from fringeforce.mechanics.elements import integrals, interpolation

ComplexArray = NDArray[np.complex128]


class SurfaceLoad(Protocol):
    """Nodal forces of the surface, which may depend on how it moved.

    Displacements and forces along x and z have the shape (2, along x).
    """

    follows: ClassVar[bool]
    """Whether they depend on it."""

    def nodal(self, moved: Array) -> Array:
        """Forces under displacements of the surface [N]."""
        ...

    def changed(self, moved: Array, by: Array) -> Array:
        """Derivative of `nodal` at displacements of the surface along others [N]."""
        ...

    def scaled(self, share: float) -> Self:
        """The same load, so many times as large."""
        ...


@dataclass(frozen=True, eq=False)
class DeadLoad:
    """Nodal forces that do not depend on the displacements, shape (2, along x) [N]."""

    forces: Array
    follows: ClassVar[bool] = False

    @classmethod
    def pressing(cls, load: Array) -> DeadLoad:
        """Of normal (towards -z) and tangential nodal forces, shape (2, along x) [N]."""
        return cls(np.stack([load[1], -load[0]]))

    def nodal(self, moved: Array) -> Array:
        """The forces."""
        return self.forces

    def changed(self, moved: Array, by: Array) -> Array:
        """Zero."""
        return np.zeros_like(self.forces)

    def scaled(self, share: float) -> DeadLoad:
        """The same load, so many times as large."""
        return DeadLoad(share * self.forces)


@dataclass(frozen=True, eq=False)
class Patches:
    """Parts of the surface that carry uniform tractions.

    Attributes
    ----------
    order : int
        Of the elements.
    x : ndarray, shape (columns + 1,)
        Their boundaries along the strip [m].
    first, last : ndarray of int, shape (n,)
        Boundaries at which each patch begins and ends.
    """

    order: int
    x: Array
    first: Index
    last: Index

    @cached_property
    def shares(self) -> Array:
        """Nodal forces of a unit force on each undeformed patch, shape (n, along x)."""
        found = np.zeros((len(self.first), self.order * (len(self.x) - 1) + 1))
        for share, first, last in zip(found, self.first, self.last, strict=True):
            over = self.x[first : last + 1]
            here = slice(first * self.order, last * self.order + 1)
            share[here] = integrals(self.order, over) / (over[-1] - over[0])
        return found

    def dead(self, forces: Array) -> DeadLoad:
        """Dead loads of normal and tangential forces, shape (n, 2) [N]."""
        return DeadLoad.pressing(forces.T @ self.shares)

    def chords(self, own: float, moved: Array) -> ComplexArray:
        """From one end of each patch to the other, complex numbers, shape (n,) [m].

        Of `own` times the undeformed patch and displacements of the surface, shape (2, along x).
        """
        ends = own * self.x + (moved[0] + 1j * moved[1])[:: self.order]
        return ends[self.last] - ends[self.first]

    def integrated(self, densities: ComplexArray, own: float, moved: Array) -> Array:
        """Integrals of the shape functions, a density on each patch, and the slope of the surface.

        Parameters
        ----------
        densities : ndarray of complex, shape (n,)
            Of each patch.
        own, moved : float and ndarray, shape (2, along x)
            The slope is that of x times `own`, and that of displacements of the surface.

        Returns
        -------
        ndarray, shape (2, along x)
            Along x and z.
        """
        onto, slope, covered = self._at_gauss
        found = onto @ ((densities @ covered) * (own + slope @ (moved[0] + 1j * moved[1])))
        return np.stack([found.real, found.imag])

    @cached_property
    def _at_gauss(self) -> tuple[csr_array, csr_array, Array]:
        """Integrals with the shape functions, slopes, and one on each patch, by Gauss points."""
        points, weights = leggauss(self.order + 1)
        step = np.diff(self.x)[:, None]
        at = (self.x[:-1, None] + step * (points + 1) / 2).ravel()
        value, slope = interpolation(self.order, self.x, at)
        inside = (at > self.x[self.first, None]) & (at < self.x[self.last, None])
        return csr_array(value.T * (step * weights / 2).ravel()), slope, inside.astype(float)


@dataclass(frozen=True, eq=False)
class FollowerLoad:
    """Tractions along and across the deformed surface, uniform over its deformed length.

    With points of the section as complex numbers x + i z, the surface of a patch at x(X) and its
    chord c from one end to the other, the nodal forces are

        f_a = (T - i N) / |c| int N_a x'(X) dX ,

    so that the resultant is (T - i N) c / |c|: the force of a patch is its resultant, normal and
    tangential to the line between the ends of the deformed contact.

    Attributes
    ----------
    patches : Patches
        Where they act.
    forces : ndarray, shape (n, 2)
        Normal (into the strip) and tangential force of each patch [N].
    """

    patches: Patches
    forces: Array
    follows: ClassVar[bool] = True

    def nodal(self, moved: Array) -> Array:
        """Forces under displacements of the surface, shape (2, along x) [N]."""
        return self.patches.integrated(self._densities(moved), 1.0, moved)

    def changed(self, moved: Array, by: Array) -> Array:
        """Derivative of `nodal` at displacements along others, shape (2, along x) [N]."""
        at, densities = self.patches, self._densities(moved)
        stretched = densities * (at.chords(0.0, by) / at.chords(1.0, moved)).real
        return at.integrated(densities, 0.0, by) - at.integrated(stretched, 1.0, moved)

    def _densities(self, moved: Array) -> ComplexArray:
        """Force of each patch over the length of its chord, (T - i N) / |c| [N/m]."""
        normal, tangential = self.forces.T
        return (tangential - 1j * normal) / np.abs(self.patches.chords(1.0, moved))

    def scaled(self, share: float) -> FollowerLoad:
        """The same load, so many times as large."""
        return replace(self, forces=share * self.forces)
