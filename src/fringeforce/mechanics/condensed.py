"""Direct solution of a tensor mesh of unlike elements.

The unknowns inside each element are eliminated by themselves (static condensation: Bathe, Finite
Element Procedures, 2014, section 8.2.4).  Those on the boundaries of elements, numbered column by
column, have a stiffness half as wide, of a third of the unknowns, which Cholesky's method
factorises.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.sparse import csr_array

from fringeforce.base.arrays import Array, Index, Mask


@dataclass(frozen=True, eq=False)
class Condensation:
    """Which unknowns of a mesh lie inside its elements, and which on their boundaries.

    Attributes
    ----------
    order : int
        Polynomial order of the elements.
    numbers : ndarray of int, shape (2, order * columns + 1, order * rows + 1)
        Equation of every coefficient, -1 where it is held; numbered column by column.
    """

    order: int
    numbers: Index

    @cached_property
    def _local(self) -> tuple[Index, Index]:
        """Unknowns inside an element and on its boundary, in the element's own numbering."""
        points = self.order + 1
        local = np.arange(2 * points**2).reshape(2, points, points)
        inside = local[:, 1:-1, 1:-1].ravel()
        return inside, np.setdiff1d(local, inside)

    @cached_property
    def _equations(self) -> tuple[Index, Index]:
        """Equations inside and around every element, shapes (elements, i) and (elements, o)."""
        along_x, along_z = (
            np.arange((n - 1) // self.order)[:, None] * self.order + np.arange(self.order + 1)
            for n in self.numbers.shape[1:]
        )
        own = self.numbers[:, along_x[:, None, :, None], along_z[None, :, None, :]]
        flat = own.transpose(1, 2, 0, 3, 4).reshape(len(along_x) * len(along_z), -1)
        inside, around = self._local
        return flat[:, inside], flat[:, around]

    @property
    def inside(self) -> Index:
        """Equations inside every element, shape (elements, i)."""
        return self._equations[0]

    @cached_property
    def frame(self) -> Index:
        """Equations on the boundaries of elements, ascending."""
        return np.unique(self._equations[1][self._equations[1] >= 0])

    @cached_property
    def around(self) -> Index:
        """Numbers in `frame` of what is around every element, its length where one is held."""
        there = self._equations[1]
        return np.where(there >= 0, np.searchsorted(self.frame, there), len(self.frame))

    @cached_property
    def gathered(self) -> csr_array:
        """Sums what is around all elements on the frame, shape (frame, elements * o)."""
        rows = self.around.ravel()
        kept = np.flatnonzero(rows < len(self.frame))
        shape = len(self.frame), rows.size
        return csr_array((np.ones(len(kept)), (rows[kept], kept)), shape=shape)

    @cached_property
    def _band(self) -> tuple[Mask, Index, int]:
        """Which entries of the elements' matrices count, their flat places, and the bandwidth."""
        row, column = np.broadcast_arrays(self.around[:, :, None], self.around[:, None, :])
        lower = (row >= column) & (row < len(self.frame))
        row, column = row[lower], column[lower]
        band = int((row - column).max()) + 1
        return lower, column * band + (row - column), band

    def factorised(self, stiffness: Array) -> Tangent:
        """Factorise a stiffness.

        Parameters
        ----------
        stiffness : ndarray, shape (elements, 2 (order + 1)^2, 2 (order + 1)^2)
            Of the elements, column by column.

        Raises
        ------
        scipy.linalg.LinAlgError
            If it is not positive definite.
        """
        inside, around = self._local
        rows, rest = stiffness.take(inside, axis=1), stiffness.take(around, axis=1)
        within, coupling = rows.take(inside, axis=2), rows.take(around, axis=2)
        np.linalg.cholesky(within)  # raises unless it is positive definite
        inverse = np.asarray(np.linalg.inv(within), dtype=np.float64)
        recovery = -(inverse @ coupling)
        shells = rest.take(around, axis=2) + coupling.transpose(0, 2, 1) @ recovery
        lower, place, band = self._band
        banded = np.bincount(place, shells[lower], len(self.frame) * band)
        factor = cholesky_banded(
            banded.reshape(-1, band).T, lower=True, check_finite=False, overwrite_ab=True
        )
        return Tangent(self, factor, inverse, recovery)


@dataclass(frozen=True, eq=False)
class Tangent:
    """A factorised stiffness at one state.

    Attributes
    ----------
    unknowns : Condensation
        Which there are.
    factor : ndarray, shape (bandwidth + 1, frame)
        Banded Cholesky factor of what is on the boundaries, lower form.
    inverse : ndarray, shape (elements, i, i)
        Displacements inside the elements per force there, their boundaries held [m/N].
    recovery : ndarray, shape (elements, i, o)
        Displacements inside the elements per displacement of their boundaries.
    """

    unknowns: Condensation
    factor: Array
    inverse: Array
    recovery: Array

    def solve(self, forces: Array) -> Array:
        """Displacements of the free unknowns under forces on them, shape (free, ...) [m]."""
        at, flat = self.unknowns, forces.reshape(len(forces), -1)
        inside = flat[at.inside]
        pulled = self.recovery.transpose(0, 2, 1) @ inside
        frame = flat[at.frame] + at.gathered @ pulled.reshape(-1, flat.shape[1])
        moved = cho_solve_banded((self.factor, True), frame, check_finite=False)
        around = np.concatenate([moved, np.zeros((1, flat.shape[1]))])[at.around]
        found = np.empty_like(flat)
        found[at.frame] = moved
        found[at.inside] = self.inverse @ inside + self.recovery @ around
        return found.reshape(forces.shape)
