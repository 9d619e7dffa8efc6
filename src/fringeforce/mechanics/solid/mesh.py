"""Bricks that follow a block: fine beside loads and singular corners, coarse elsewhere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.mechanics.mesh import Progression, snapped, subdivision
from fringeforce.mechanics.solid.block import Block


@dataclass(frozen=True)
class Grading:
    """How a block is cut into bricks.

    Attributes
    ----------
    order : int
        Polynomial order of the displacements in all directions, 2 or more.
    load : float
        First brick along x and y beside the border of a load, in cover thicknesses.
    surface, below : float
        First brick along z below the surface and below the interface, in cover thicknesses.
    corner : float
        First brick beside the edges where a free side meets base or interface, in thicknesses of
        the whole block.
    growth, growth_down, growth_below, corner_growth : float
        Growth of the bricks that follow.
    largest : float
        Largest brick, in thicknesses of the whole block.
    """

    order: int
    load: float
    surface: float
    below: float
    corner: float
    growth: float = 2.0
    growth_down: float = 2.4
    growth_below: float = 3.0
    corner_growth: float = 6.0
    largest: float = 0.8


@dataclass(frozen=True, eq=False)
class BoxMesh:
    """Bricks of one polynomial order that fill a quarter of a block.

    Attributes
    ----------
    x, y : ndarray, shape (columns + 1,)
        Element boundaries from the mirror plane, 0, to the side [m].
    z : ndarray, shape (rows + 1,)
        From the bonded base up to the surface, 0 [m].
    order : int
        Polynomial order of the displacements in all directions.
    """

    x: Array
    y: Array
    z: Array
    order: int

    def __post_init__(self) -> None:
        if self.order < 2:
            raise InputError(f"order = {self.order}: bricks need 2 or more.")

    @property
    def unknowns(self) -> int:
        """Displacements of the quarter that are solved for, supports at the sides included."""
        p = self.order
        return 3 * (p * (len(self.x) - 1) + 1) * (p * (len(self.y) - 1) + 1) * p * (len(self.z) - 1)


def box_mesh(block: Block, marks_x: ArrayLike, marks_y: ArrayLike, sizes: Grading) -> BoxMesh:
    """The bricks that a block and its loads ask for.

    Parameters
    ----------
    block : Block
        The layers and their sides.
    marks_x, marks_y : array_like, shape (k,)
        Borders of loads on either side of the middle [m]; each becomes an element boundary.
    sizes : Grading
        Sizes and order.
    """
    depth = -block.base
    corner = sizes.corner * depth
    singular = "free" in (block.sides, block.across)
    a, b = block.compliant.thickness, block.photoelastic.thickness
    vertical = corner if singular else np.inf
    below = Progression(min(vertical, sizes.below * a), sizes.growth_below, b)
    base = Progression(vertical, sizes.corner_growth, b)
    above = Progression(vertical, sizes.corner_growth, a)
    surface = Progression(sizes.surface * a, sizes.growth_down, a)
    heights = [subdivision(b, base, below), subdivision(a, above, surface)]
    z = np.cumsum(np.concatenate([[block.base], *heights]))
    return BoxMesh(
        _half_axis(block.length / 2, marks_x, block, sizes, block.sides == "free"),
        _half_axis(block.width / 2, marks_y, block, sizes, (block.across or block.sides) == "free"),
        snapped(z, np.array([block.base, block.interface, 0.0])),
        sizes.order,
    )


def _half_axis(half: float, marks: ArrayLike, block: Block, sizes: Grading, free: bool) -> Array:
    distances = np.abs(np.asarray(marks, dtype=float)).ravel()
    # without loads along an axis the solution changes beside its sides only
    depth, largest = -block.base, -block.base * sizes.largest if distances.size else half
    borders = np.unique(np.concatenate([[0.0, half], distances]).round(15))
    load = Progression(sizes.load * block.compliant.thickness, sizes.growth, largest)
    middle = load if 0.0 in distances.round(15) else Progression(largest, 1.0, largest)
    side = Progression(sizes.corner * depth if free else np.inf, sizes.corner_growth, largest)
    ends = [middle, *[load] * (len(borders) - 2), side]
    pieces = [subdivision(gap, ends[i], ends[i + 1]) for i, gap in enumerate(np.diff(borders))]
    return snapped(np.cumsum(np.concatenate([[0.0], *pieces])), borders)
