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
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fringeforce.base.arrays import Array, Index
from fringeforce.mechanics.elements import integrals, interpolation, second_slopes
from fringeforce.mechanics.gauss_rule import gauss_rule

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
        normal, tangential = forces.T @ self.shares
        return DeadLoad(np.stack([tangential, -normal]))

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
        points, weights = gauss_rule(self.order + 1)
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


@dataclass(frozen=True, eq=False)
class SurfacePlaces:
    """Places of the surface that move and turn with it.

    Attributes
    ----------
    order : int
        Of the elements.
    x : ndarray, shape (columns + 1,)
        Their boundaries along the strip [m].
    places : ndarray, shape (q,)
        In the undeformed strip [m].
    """

    order: int
    x: Array
    places: Array

    @cached_property
    def shapes(self) -> tuple[csr_array, csr_array]:
        """Values and slopes [1/m] of the shape functions there, shape (q, along x)."""
        return interpolation(self.order, self.x, self.places)

    def slopes(self, moved: Array) -> ComplexArray:
        """Slope x' of displacements of the surface, shape (2, along x), as complex numbers."""
        return np.asarray(self.shapes[1] @ (moved[0] + 1j * moved[1]))

    def gathered(self, forces: ComplexArray) -> Array:
        """Nodal forces of one force at each place, shape (2, along x) [N]."""
        found = self.shapes[0].T @ forces
        return np.stack([found.real, found.imag])

    def spread(self, moved: Array) -> tuple[ComplexArray, ComplexArray]:
        """Nodal forces of unit forces that turn with the surface, and their change with the place.

        Parameters
        ----------
        moved : ndarray, shape (2, along x)
            Displacements of the surface [m].

        Returns
        -------
        own, rising : ndarray, shape (q, along x)
            Of a force along the surface; the second per metre that its place moves.
        """
        value, slope = (part.toarray() for part in self.shapes)
        along = 1 + self.slopes(moved)
        bend = second_slopes(self.order, self.x, self.places) @ (moved[0] + 1j * moved[1])
        turn = along / np.abs(along)
        turning = 1j * turn * (bend / along).imag
        return turn[:, None] * value, turn[:, None] * slope + turning[:, None] * value


@dataclass(frozen=True, eq=False)
class TurningForces:
    """Small forces at places of the surface, each across and along it as it deforms.

    A fine row of them is a traction that keeps its size per undeformed length and turns with the
    surface, as `FollowerLoad` does on patches that are ever narrower.  With points of the section
    as complex numbers x + i z and the surface at x(X) the nodal forces are

        f_a = sum_q (T_q - i N_q) x'(X_q) / |x'(X_q)| N_a(X_q) .

    Attributes
    ----------
    at : SurfacePlaces
        Where they act.
    forces : ndarray, shape (q, 2)
        Normal (into the strip) and tangential to the surface there [N].
    """

    at: SurfacePlaces
    forces: Array
    follows: ClassVar[bool] = True

    @property
    def _pull(self) -> ComplexArray:
        return self.forces[:, 1] - 1j * self.forces[:, 0]

    def nodal(self, moved: Array) -> Array:
        """Forces under displacements of the surface, shape (2, along x) [N]."""
        along = 1 + self.at.slopes(moved)
        return self.at.gathered(self._pull * along / np.abs(along))

    def changed(self, moved: Array, by: Array) -> Array:
        """Derivative of `nodal` at displacements along others, shape (2, along x) [N]."""
        along = 1 + self.at.slopes(moved)
        angle = (self.at.slopes(by) / along).imag
        return self.at.gathered(self._pull * along / np.abs(along) * 1j * angle)

    def scaled(self, share: float) -> TurningForces:
        """The same load, so many times as large."""
        return replace(self, forces=share * self.forces)


@dataclass(frozen=True, eq=False)
class Together:
    """Several loads at once, some of which follow the surface."""

    loads: tuple[SurfaceLoad, ...]
    follows: ClassVar[bool] = True

    def nodal(self, moved: Array) -> Array:
        """Their sum under displacements of the surface, shape (2, along x) [N]."""
        return np.sum([load.nodal(moved) for load in self.loads], axis=0)

    def changed(self, moved: Array, by: Array) -> Array:
        """Derivative of `nodal` at displacements along others, shape (2, along x) [N]."""
        return np.sum([load.changed(moved, by) for load in self.loads], axis=0)

    def scaled(self, share: float) -> Together:
        """The same loads, each so many times as large."""
        return Together(tuple(load.scaled(share) for load in self.loads))
