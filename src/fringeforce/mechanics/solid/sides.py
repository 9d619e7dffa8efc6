"""Pads with free or bonded sides: the exact series for rollers, and what the sides change.

Beside every load stresses are rough, whatever holds the sides; what the sides change is smooth but
for their own corners.  So the series carries the loads, and finite elements carry only the change:
the difference of two solutions on the same bricks, one with the sides as they are and one with
rollers.  What coarse bricks get wrong beside the loads is the same in both and cancels.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.progress import Progress, counted
from fringeforce.mechanics.mesh import Progression, snapped, subdivision
from fringeforce.mechanics.solid.block import Block, Patches, SolidInfluence
from fringeforce.mechanics.solid.elasticity import Loads, SymmetricPart, symmetric_parts
from fringeforce.mechanics.solid.fourier import stress_influence
from fringeforce.mechanics.solid.influence import patch_loads, stresses_of
from fringeforce.mechanics.solid.mesh import BoxMesh


@dataclass(frozen=True)
class SideGrading:
    """How a block is cut into bricks for what its sides change, in thicknesses of the block.

    Attributes
    ----------
    order : int
        Polynomial order of the displacements in all directions, 2 or more.
    side, base : float
        First brick beside a side, and above the bonded base.
    growth, growth_up : float
        Growth of the bricks that follow them.
    largest, tallest : float
        Largest brick along x and y, and along z.
    close : float
        Largest brick along x and y under loads that reach up to a side.
    cover : float
        Largest brick along z in the cover.
    """

    order: int = 5
    side: float = 0.145
    base: float = 0.09
    growth: float = 2.0
    growth_up: float = 4.0
    largest: float = 0.86
    tallest: float = 0.43
    close: float = 0.43
    cover: float = 0.2


def side_mesh(block: Block, loads: Loads, sizes: SideGrading) -> BoxMesh:
    """The bricks that what the sides change asks for.

    Parameters
    ----------
    block : Block
        The layers and their sides.
    loads : Loads
        What the sides feel varies along them over about twice the distance of the nearest load.
    sizes : SideGrading
        Sizes and order.
    """
    depth, b = -block.base, block.photoelastic.thickness
    reach = (np.abs(loads.places) + np.array(loads.size) / 2).max(axis=0)
    gap = (np.array([block.length, block.width]) / 2 - reach).min()
    largest = float(np.clip(2 * gap, sizes.close * depth, sizes.largest * depth))
    side = Progression(sizes.side * depth, sizes.growth, largest)
    inner = Progression(largest, 1.0, largest)
    base = Progression(sizes.base * depth, sizes.growth_up, sizes.tallest * depth)
    below = Progression(sizes.tallest * depth, 1.0, sizes.tallest * depth)
    cover = Progression(sizes.cover * depth, 1.0, sizes.cover * depth)
    heights = subdivision(b, base, below), subdivision(block.compliant.thickness, cover, cover)
    x, y = (
        np.cumsum(np.concatenate([[0.0], subdivision(length / 2, inner, side)]))
        for length in (block.length, block.width)
    )
    z = np.cumsum(np.concatenate([[block.base], *heights]))
    return BoxMesh(
        snapped(x, np.array([0.0, block.length / 2])),
        snapped(y, np.array([0.0, block.width / 2])),
        snapped(z, np.array([block.base, block.interface, 0.0])),
        sizes.order,
    )


def sided_influence(
    block: Block,
    patches: Patches,
    x: ArrayLike,
    y: ArrayLike,
    slices: int = 8,
    mesh: BoxMesh | SideGrading = SideGrading(),
    progress: Progress | None = None,
) -> SolidInfluence:
    """Stresses inside the photoelastic layer per unit force on every tactel, whatever the sides.

    Parameters
    ----------
    block : Block
        The layers and their sides.
    patches : Patches
        Where the forces act.
    x, y : array_like, shape (nx,), (ny,)
        Places of the samples [m].
    slices : int
        Samples over the depth of the photoelastic layer.
    mesh : BoxMesh or SideGrading
        The bricks for what the sides change, or their sizes.
    progress : callable, optional
        Told words, the steps done and their count.

    Returns
    -------
    SolidInfluence
        In single precision.

    Raises
    ------
    InputError
        If a force reaches beyond the block.
    """
    places = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    loads = patch_loads(patches)
    loads.check(block)
    if not isinstance(mesh, BoxMesh):
        mesh = side_mesh(block, loads, mesh)
    parts = _changes(block, loads, mesh, progress)
    change = stresses_of(block, parts, loads, mesh, places, slices)
    exact = stress_influence(block, patches, *places, slices)
    change.difference[:] += exact.difference
    change.shear[:] += exact.shear
    return change


def _changes(
    block: Block, loads: Loads, mesh: BoxMesh, progress: Progress | None
) -> Iterator[SymmetricPart]:
    """Displacements with the sides as they are, less those with rollers."""
    rollers = replace(block, sides="roller", across=None)
    solutions = (symmetric_parts(b, loads, mesh) for b in (block, rollers))
    count = 2 * len(loads.parities_across)
    both = zip(*solutions, strict=True)
    for own, slid in counted(both, progress, "what the sides change", count):
        yield SymmetricPart(own.mirrors, own.coefficients - slid.coefficients)
