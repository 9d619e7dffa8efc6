"""Direct solution of a box of bricks, slab by slab along x.

The eliminations of `mechanics.substructure` one dimension up, each exact: the inside of every
brick, then all that lies between the two mesh planes of a slab, which leaves a block-tridiagonal
chain of mesh planes.  Slabs of equal thickness share one elimination.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky
from scipy.sparse import coo_array, csr_array

from fringeforce.mechanics.solid.bricks import brick_stiffness
from fringeforce.mechanics.substructure import ROUNDING
from fringeforce.mechanics.tridiagonal import backward, block_cholesky, forward

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Section:
    """What all slabs have in common: the bricks of a cross-section, and what holds them.

    Attributes
    ----------
    order : int
        Polynomial order of the bricks.
    widths : ndarray, shape (columns,)
        Of the bricks along y [m].
    heights : ndarray, shape (rows,)
        Along z, from the bonded base upwards [m].
    lame : list of (float, float)
        Lame's parameters of each row [Pa].
    held : ndarray of bool, shape (3, order * columns + 1)
        Components that are zero over the height, along y.
    """

    order: int
    widths: Array
    heights: Array
    lame: list[tuple[float, float]]
    held: Mask

    @cached_property
    def shape(self) -> tuple[int, int, int, int]:
        """Of a slab's grid of unknowns: component, along x, y and z."""
        p = self.order
        return 3, p + 1, p * len(self.widths) + 1, p * len(self.heights) + 1

    @cached_property
    def _free(self) -> Mask:
        free = np.broadcast_to(~self.held[:, None, :, None], self.shape).copy()
        free[..., 0] = False  # the base is bonded
        return free

    @cached_property
    def planes(self) -> Index:
        """Flat places of the free unknowns of the left, then the right mesh plane, (2, u)."""
        grid = np.arange(self._free.size).reshape(self.shape)[:, [0, -1]]
        return np.stack([grid[:, side][self._free[:, 0]] for side in (0, 1)])

    @cached_property
    def components(self) -> Index:
        """Component of each unknown of a mesh plane, shape (u,)."""
        return np.nonzero(self._free[:, 0])[0]

    @cached_property
    def between(self) -> Index:
        """Flat places of the free unknowns between the planes, outside the bricks."""
        p = self.order
        frame = self._free.copy()
        frame[:, [0, -1]] = False
        inside = np.ones(self.shape[2:], dtype=bool)
        inside[::p], inside[:, ::p] = False, False
        frame[:, :, inside] = False
        return np.flatnonzero(frame)

    @cached_property
    def bricks(self) -> Index:
        """Flat places of each brick's unknowns, shape (columns, rows, 3 (order + 1)^3)."""
        p = self.order
        grid = np.arange(np.prod(self.shape)).reshape(self.shape)
        return np.array(
            [
                [
                    grid[:, :, c * p : (c + 1) * p + 1, r * p : (r + 1) * p + 1].ravel()
                    for r in range(len(self.heights))
                ]
                for c in range(len(self.widths))
            ]
        )

    @cached_property
    def inside(self) -> Index:
        """Unknowns inside one brick, in its own numbering."""
        q = self.order + 1
        return np.arange(3 * q**3).reshape(3, q, q, q)[:, 1:-1, 1:-1, 1:-1].ravel()

    @cached_property
    def around(self) -> Index:
        """Unknowns on the boundary of one brick, in its own numbering."""
        return np.setdiff1d(np.arange(3 * (self.order + 1) ** 3), self.inside)


@dataclass(frozen=True, eq=False)
class _Slab:
    """A slab reduced to its two mesh planes, and the way back inside.

    With K in blocks of planes (p) and between (b), and K_bb = L L', the coupling is L^-1 K_bp.
    """

    stiffness: Array  # (2u, 2u)
    factor: Array  # L
    coupling: Array
    inside: dict[tuple[int, int], Array]  # inner displacements of a brick per boundary ones


def _slab(section: Section, thickness: float) -> _Slab:
    kept = section.planes.ravel()
    number = np.full(np.prod(section.shape), -1)
    number[kept] = np.arange(kept.size)
    number[section.between] = kept.size + np.arange(section.between.size)
    frame = csr_array((kept.size + section.between.size,) * 2)
    inside: dict[tuple[int, int], Array] = {}
    for place, shell, recovery in _shells(section, thickness):
        inside[place] = recovery
        here = number[section.bricks[place][section.around]]
        used = np.flatnonzero(here >= 0)
        rows, columns = np.meshgrid(here[used], here[used], indexing="ij")
        values = shell[used[:, None], used]
        frame = frame + coo_array(
            (values.ravel(), (rows.ravel(), columns.ravel())), shape=frame.shape
        )
    planes, between = slice(0, kept.size), slice(kept.size, None)
    factor = cholesky(
        frame[between, between].toarray(), lower=True, overwrite_a=True, check_finite=False
    )
    coupling = forward(factor, frame[between, planes].toarray(order="F"))
    stiffness = frame[planes, planes].toarray() - coupling.T @ coupling
    return _Slab(stiffness, factor, coupling, inside)


def _shells(
    section: Section, thickness: float
) -> Iterator[tuple[tuple[int, int], Array, Array]]:
    """Every brick of a slab reduced to its boundary: its place, stiffness, and way inside."""
    known: dict[tuple[float, ...], tuple[Array, Array]] = {}
    keep, drop = section.around, section.inside
    for c, width in enumerate(section.widths):
        for r, (height, lame) in enumerate(zip(section.heights, section.lame, strict=True)):
            kind = (*np.log([width, height]).round(ROUNDING), *lame)
            if kind not in known:
                k = brick_stiffness(section.order, (thickness, width, height), lame)
                across = k[drop[:, None], keep]
                recovery = -np.asarray(np.linalg.solve(k[drop[:, None], drop], across))
                known[kind] = k[keep[:, None], keep] + across.T @ recovery, recovery
            yield (c, r), *known[kind]


@dataclass(frozen=True, eq=False)
class Slabs:
    """The slabs of a box, eliminated; a chain of them can be held at its ends in any way."""

    section: Section
    distinct: list[_Slab]
    kind: Index  # (slabs,): which of the distinct slabs stands where

    def solve(self, first: Mask, last: Mask, surface: Array) -> Array:
        """Displacements for forces on the top surface.

        Parameters
        ----------
        first, last : ndarray of bool, shape (3,)
            Components that are zero on the first and on the last mesh plane.
        surface : ndarray, shape (3, along x, along y, cases)
            Nodal forces on the grid of shape functions [N].

        Returns
        -------
        ndarray, shape (3, along x, along y, along z, cases)
            Coefficients of u, v and w on the grid of shape functions [m].
        """
        section, cases = self.section, surface.shape[-1]
        held = np.zeros((len(self.kind) + 1, section.components.size), dtype=bool)
        held[0], held[-1] = first[section.components], last[section.components]
        chain = block_cholesky([self.distinct[k].stiffness for k in self.kind], held)
        loads = np.zeros((*held.shape, cases))
        reduced = []
        for s, kind in enumerate(self.kind):
            grid = self._slab_loads(surface, s)
            inner = forward(self.distinct[kind].factor, grid[section.between])
            reduced.append(inner)
            loads[s] += grid[section.planes[0]]
            condensed = self.distinct[kind].coupling.T @ inner
            loads[s : s + 2] -= condensed.reshape(2, -1, cases)
        loads[-1] += self._slab_loads(surface, len(self.kind) - 1)[section.planes[1]]
        planes = chain.solve(loads)
        p = section.order
        _, _, along_y, along_z = section.shape
        result = np.zeros((3, p * len(self.kind) + 1, along_y, along_z, cases))
        for s, kind in enumerate(self.kind):
            result[:, s * p : (s + 1) * p + 1] = self._inside(
                self.distinct[kind], planes[s : s + 2], reduced[s]
            )
        return result

    def _slab_loads(self, surface: Array, slab: int) -> Array:
        p, cases = self.section.order, surface.shape[-1]
        grid = np.zeros((*self.section.shape, cases))
        grid[..., -1, :] = surface[:, slab * p : (slab + 1) * p + 1]
        return grid.reshape(-1, cases)

    def _inside(self, slab: _Slab, pair: Array, inner: Array) -> Array:
        section, cases = self.section, pair.shape[-1]
        flat = np.zeros((np.prod(section.shape), cases))
        flat[section.planes] = pair
        flat[section.between] = backward(
            slab.factor, inner - slab.coupling @ pair.reshape(-1, cases)
        )
        for place, recovery in slab.inside.items():
            brick = section.bricks[place]
            flat[brick[section.inside]] = recovery @ flat[brick[section.around]]
        return flat.reshape(*section.shape, cases)


def slabs(section: Section, thicknesses: Array) -> Slabs:
    """Eliminate the slabs of a box.

    Parameters
    ----------
    section : Section
        Their common cross-section.
    thicknesses : ndarray, shape (slabs,)
        Of the slabs along x [m].
    """
    _, first, kind = np.unique(
        np.log(thicknesses).round(ROUNDING), return_index=True, return_inverse=True
    )
    return Slabs(section, [_slab(section, t) for t in thicknesses[first]], kind)
