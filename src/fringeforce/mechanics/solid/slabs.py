"""Direct solution of a box of bricks, slab by slab along x.

The eliminations of `mechanics.substructure` one dimension up, each exact: the inside of every
brick, then all that lies between the two mesh planes of a slab, which leaves a block-tridiagonal
chain of mesh planes.  Slabs of equal thickness share one elimination, which even and odd
displacements go through apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cholesky
from scipy.sparse import coo_array

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.mechanics.solid.bricks import brick_stiffness
from fringeforce.mechanics.solid.section import Half, Section, plane_sums
from fringeforce.mechanics.substructure import ROUNDING
from fringeforce.mechanics.tridiagonal import BlockCholesky, backward, block_cholesky, forward

Place = tuple[int, int]


@dataclass(frozen=True, eq=False)
class _Reduced:
    """Half a slab reduced to its mesh planes, and the way back inside.

    With K in blocks of planes (p) and between (b), and K_bb = L L', the coupling is L^-1 K_bp.
    """

    stiffness: Array  # (u, u)
    factor: Array  # L
    coupling: Array
    inside: dict[Place, Array]  # inner displacements of a brick per boundary ones


def _reduced(half: Half, bricks: dict[Place, Array], unknowns: int) -> _Reduced:
    kept = half.planes.size
    number = np.full(unknowns, -1)
    number[half.planes] = np.arange(kept)
    number[half.between] = kept + np.arange(half.between.size)
    known: dict[int, tuple[Array, Array]] = {}
    inside: dict[Place, Array] = {}
    rows, columns, values = [], [], []
    for place, whole in bricks.items():
        if id(whole) not in known:
            known[id(whole)] = _shell(whole[half.local[:, None], half.local], half)
        shell, inside[place] = known[id(whole)]
        here = number[half.bricks[place][half.around]]
        used = np.flatnonzero(here >= 0)
        rows.append(np.repeat(here[used], used.size))
        columns.append(np.tile(here[used], used.size))
        values.append(shell[used[:, None], used].ravel())
    places = np.concatenate(rows), np.concatenate(columns)
    frame = coo_array((np.concatenate(values), places), shape=(kept + half.between.size,) * 2)
    frame = frame.tocsr()
    inner = frame[kept:, kept:].toarray()
    factor = cholesky(inner, lower=True, overwrite_a=True, check_finite=False)
    coupling = forward(factor, frame[kept:, :kept].toarray(order="F"))
    stiffness = frame[:kept, :kept].toarray() - coupling.T @ coupling
    return _Reduced(stiffness, factor, coupling, inside)


def _shell(brick: Array, half: Half) -> tuple[Array, Array]:
    """A brick reduced to its boundary: its stiffness, and the way inside."""
    keep, drop = half.around, half.inside
    across = brick[drop[:, None], keep]
    solved = np.linalg.solve(brick[drop[:, None], drop], across)
    recovery = -np.asarray(solved, dtype=np.float64)
    return brick[keep[:, None], keep] + across.T @ recovery, recovery


@dataclass(frozen=True, eq=False)
class _Slab:
    """A slab reduced to its two mesh planes, in an even and an odd half."""

    section: Section
    halves: tuple[_Reduced, _Reduced]

    @cached_property
    def _turned(self) -> Array:
        """What the mirror does to the components of a plane's unknowns, shape (u, 1)."""
        return np.where(self.section.components == 0, -1.0, 1.0)[:, None]

    @property
    def stiffness(self) -> Array:
        """Stiffness of the last and the first mesh plane, in this order, shape (2u, 2u)."""
        even, odd = (half.stiffness for half in self.halves)
        size, turned = len(even), self._turned
        found = np.empty((2 * size, 2 * size))
        found[size:, size:], found[:size, size:] = (even + odd) / 2, (even - odd) / 2
        found[size:, :size] = found[:size, size:] * turned.T
        found[:size, size:] *= turned
        found[:size, :size] = found[size:, size:] * (turned * turned.T)
        return found

    def condensed(self, loads: Array) -> tuple[Array, list[Array]]:
        """What forces (unknowns, cases) between the planes do on them, (2, u, cases), and L^-1 f.

        Loads are those of the even and odd sums.
        """
        inner = [
            forward(reduced.factor, loads[half.between])
            for reduced, half in zip(self.halves, self.section.halves, strict=True)
        ]
        even, odd = (reduced.coupling.T @ f for reduced, f in zip(self.halves, inner, strict=True))
        return np.sqrt(0.5) * np.stack([even + odd, self._turned * (even - odd)]), inner

    def displacements(self, pair: Array, inner: list[Array]) -> Array:
        """Everything inside from the planes (2, u, cases) and `condensed`, (unknowns, cases)."""
        first, last = pair[0], self._turned * pair[1]
        flat = np.zeros((np.prod(self.section.shape), pair.shape[-1]))
        both = zip(self.halves, self.section.halves, (1, -1), inner, strict=True)
        for reduced, half, sign, forces in both:
            plane = np.sqrt(0.5) * (first + sign * last)
            flat[half.planes] = plane
            flat[half.between] = backward(reduced.factor, forces - reduced.coupling @ plane)
            for place, recovery in reduced.inside.items():
                brick = half.bricks[place]
                flat[brick[half.inside]] = recovery @ flat[brick[half.around]]
        return flat


def _slab(section: Section, thickness: float) -> _Slab:
    bricks = dict(_bricks(section, thickness))
    unknowns = int(np.prod(section.shape))
    even, odd = (_reduced(half, bricks, unknowns) for half in section.halves)
    return _Slab(section, (even, odd))


def _bricks(section: Section, thickness: float) -> Iterator[tuple[Place, Array]]:
    """The stiffness of every brick of a slab by its place; equal bricks share one array."""
    known: dict[tuple[float, ...], Array] = {}
    for c, width in enumerate(section.widths):
        for r, (height, lame) in enumerate(zip(section.heights, section.lame, strict=True)):
            kind = (*np.log([width, height]).round(ROUNDING), *lame)
            if kind not in known:
                known[kind] = brick_stiffness(section.order, (thickness, width, height), lame)
            yield (c, r), known[kind]


@dataclass(frozen=True, eq=False)
class Slabs:
    """The slabs of a box and the chain of their mesh planes, eliminated from the far end."""

    distinct: list[_Slab]
    kind: Index  # (slabs,): which of the distinct slabs stands where
    chain: BlockCholesky

    def solve(self, first: Mask, surface: Array) -> Array:
        """Displacements for forces on the top surface.

        Parameters
        ----------
        first : ndarray of bool, shape (3,)
            Components that are zero on the first mesh plane.
        surface : ndarray, shape (3, along x, along y, cases)
            Nodal forces on the grid of shape functions [N].

        Returns
        -------
        ndarray, shape (3, along x, along y, along z, cases)
            Coefficients of u, v and w on the grid of shape functions [m].
        """
        section, cases = self.distinct[0].section, surface.shape[-1]
        p, components = section.order, section.components
        chain = self.chain.held_last(self.distinct[self.kind[0]].stiffness, first[components])
        loads = np.zeros((len(self.kind) + 1, components.size, cases))
        inner = []
        for s, kind in enumerate(self.kind):
            grid = np.zeros((*section.shape, cases))
            grid[..., -1, :] = surface[:, s * p : (s + 1) * p + 1]
            whole = grid.reshape(-1, cases)
            loads[s] += whole[section.planes[0]]
            if s + 1 == len(self.kind):
                loads[-1] += whole[section.planes[1]]
            condensed, forces = self.distinct[kind].condensed(_summed(grid, p).reshape(-1, cases))
            loads[s : s + 2] -= condensed
            inner.append(forces)
        planes = chain.solve(loads[::-1])[::-1]
        result = np.zeros((3, p * len(self.kind) + 1, *section.shape[2:], cases))
        for s, kind in enumerate(self.kind):
            flat = self.distinct[kind].displacements(planes[s : s + 2], inner[s])
            here = slice(s * p, (s + 1) * p + 1)
            result[:, here] = _summed(flat.reshape(*section.shape, cases), p)
        return result


def _summed(grid: Array, order: int) -> Array:
    """Even and odd sums of a slab's mesh planes, or the planes from their sums."""
    return np.einsum("ij,cj...->ci...", plane_sums(order), grid)


def slabs(section: Section, thicknesses: Array, last: Mask) -> Slabs:
    """Eliminate the slabs of a box.

    Parameters
    ----------
    section : Section
        Common cross-section of the slabs.
    thicknesses : ndarray, shape (slabs,)
        Thicknesses of the slabs along x [m].
    last : ndarray of bool, shape (3,)
        Components that are zero on the last mesh plane.
    """
    _, first, kind = np.unique(
        np.log(thicknesses).round(ROUNDING), return_index=True, return_inverse=True
    )
    distinct = [_slab(section, t) for t in thicknesses[first]]
    held = np.zeros((len(kind) + 1, section.components.size), dtype=bool)
    held[0] = last[section.components]
    stiffness = [slab.stiffness for slab in distinct]
    chain = block_cholesky((stiffness[k] for k in kind[::-1]), held)
    return Slabs(distinct, kind, chain)
