"""The cross-section that all slabs of a box share: its bricks, and where their unknowns stand.

A slab is its own mirror image at its middle, so displacements that are even there and those that
are odd know nothing of each other.  Along x the shape functions are therefore replaced by the sum
of those of the two mesh planes (first), their difference (last), and the bubbles between, each of
which is even or odd already.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.mechanics.elements import Interval, interval

HALVES = (1, -1)
"""Even: u odd in the middle of the slab, v and w even; and odd: the other way round."""


@cache
def plane_sums(order: int) -> Array:
    """From the shape functions of an interval to their even and odd sums, orthogonal."""
    q = np.eye(order + 1)
    q[[0, 0, -1, -1], [0, -1, 0, -1]] = np.sqrt(0.5) * np.array([1, 1, 1, -1])
    return q


@cache
def mirrored_interval(order: int) -> Interval:
    """The matrices of an interval for the even and odd sums."""
    line, q = interval(order), plane_sums(order)
    parts = (q @ part @ q.T for part in (line.mass, line.stiffness, line.mixed))
    return Interval(*parts, mean=q @ line.mean)


@dataclass(frozen=True, eq=False)
class Half:
    """Flat places of the even or of the odd unknowns of a slab."""

    planes: Index  # of the sums (or differences) of its mesh planes, (u,)
    between: Index  # of what else is free outside the bricks
    bricks: Index  # (columns, rows, unknowns of a brick)
    inside: Index  # within a row of `bricks`: inside the brick
    around: Index  # within a row of `bricks`: on its boundary
    local: Index  # unknowns of this half in the numbering of a whole brick


@dataclass(frozen=True, eq=False)
class Section:
    """What all slabs have in common: the bricks of a cross-section, and what holds them.

    Attributes
    ----------
    order : int
        Polynomial order of the bricks.
    widths : ndarray, shape (columns,)
        Widths of the bricks along y [m].
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
        """Shape of a slab's grid of unknowns: component, along x, y and z."""
        p = self.order
        return 3, p + 1, p * len(self.widths) + 1, p * len(self.heights) + 1

    @cached_property
    def _free(self) -> Mask:
        """Free unknowns of a plane, shape (3, along y, along z); the base is bonded."""
        free = np.broadcast_to(~self.held[..., None], (3, *self.shape[2:])).copy()
        free[..., 0] = False
        return free

    @cached_property
    def planes(self) -> Index:
        """Flat places of the free unknowns of a slab's first, then its last mesh plane, (2, u)."""
        grid = np.arange(np.prod(self.shape)).reshape(self.shape)
        return np.stack([grid[:, side][self._free] for side in (0, -1)])

    @cached_property
    def components(self) -> Index:
        """Component of each unknown of a mesh plane, shape (u,)."""
        return np.nonzero(self._free)[0]

    @cached_property
    def halves(self) -> tuple[Half, Half]:
        """Unknowns of even and of odd displacements."""
        return self._half(HALVES[0]), self._half(HALVES[1])

    def _half(self, parity: int) -> Half:
        p = self.order
        along_x = np.array([1, *(-1) ** np.arange(2, p + 1), -1])
        own = along_x == np.array([-parity, parity, parity])[:, None]  # (3, p + 1)
        inside = np.ones(self.shape[2:], dtype=bool)
        inside[::p], inside[:, ::p] = False, False
        bubble = np.ones(p + 1, dtype=bool)
        bubble[[0, -1]] = False
        rungs = (own & bubble)[..., None, None] & (self._free & ~inside)[:, None]
        first, last = self.planes
        planes = np.where((self.components == 0) == (parity == 1), last, first)
        local = np.arange(3 * (p + 1) ** 3).reshape(3, p + 1, p + 1, p + 1)
        mine = local[own].ravel()
        core = np.intersect1d(mine, local[:, 1:-1, 1:-1, 1:-1])
        return Half(
            planes,
            np.flatnonzero(rungs),
            self._bricks[..., mine],
            np.searchsorted(mine, core),
            np.searchsorted(mine, np.setdiff1d(mine, core)),
            mine,
        )

    @cached_property
    def _bricks(self) -> Index:
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
