"""From displacements of a block to the stresses that light along z sees."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array

from fringeforce.base.arrays import Array
from fringeforce.base.progress import Progress
from fringeforce.mechanics.elements import along, interpolation
from fringeforce.mechanics.moduli import lame_parameters
from fringeforce.mechanics.solid.block import Block, Patches, SolidInfluence
from fringeforce.mechanics.solid.elasticity import (
    Loads,
    SymmetricPart,
    symmetric_parts,
)
from fringeforce.mechanics.solid.mesh import BoxMesh, Grading, box_mesh
from fringeforce.mechanics.solid.symmetry import mirrored_interpolation

PAD = Grading(order=5, load=2.0, surface=1.0, below=2.0, corner=1.0)
"""Bricks of a pad whose tactels are about as wide as they are apart."""


def pad_influence(
    block: Block,
    patches: Patches,
    x: ArrayLike,
    y: ArrayLike,
    slices: int = 8,
    mesh: BoxMesh | Grading = PAD,
    progress: Progress | None = None,
) -> SolidInfluence:
    """Stresses inside the photoelastic layer per unit force on every tactel, by finite elements.

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
    mesh : BoxMesh or Grading
        The bricks, or their sizes.
    progress : callable, optional
        Told words, the steps done and their count.

    Returns
    -------
    SolidInfluence
        In single precision.
    """
    loads = patch_loads(patches)
    if not isinstance(mesh, BoxMesh):
        borders = loads.places[..., None] + np.array([-0.5, 0.5]) * loads.size[0]
        mesh = box_mesh(block, borders[:, 0], borders[:, 1], mesh)
    places = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    parts = symmetric_parts(block, loads, mesh, progress=progress)
    return stresses_of(block, parts, loads, mesh, places, slices)


def patch_loads(patches: Patches) -> Loads:
    """The squares of a pad, all of one size, as loads of three components."""
    side = float(patches.size)
    return Loads(np.asarray(patches.places, dtype=float), (side, side))


def stresses_of(
    block: Block,
    parts: Iterable[SymmetricPart],
    loads: Loads,
    mesh: BoxMesh,
    places: tuple[Array, Array],
    slices: int,
) -> SolidInfluence:
    """Stresses that light sees in the photoelastic layer, in single precision.

    Parameters
    ----------
    block : Block
        The layers.
    parts : iterable of SymmetricPart
        All classes of symmetry.
    loads, mesh
        That they belong to.
    places : (ndarray, ndarray)
        Samples along x and y, shape (nx,), (ny,) [m].
    slices : int
        Samples over the depth.
    """
    z, weights = block.depths(slices)
    at_depth, _ = interpolation(mesh.order, mesh.z, z)
    # whole fields of one load after the other, which lie together in memory
    shape = (3, len(loads.places), len(places[0]), len(places[1]), slices)
    totals = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    for part in parts:
        image, signs = loads.images(part.mirrors)
        for component in range(3):
            stresses = light_stresses(block, part, mesh, places, at_depth, component)
            for total, stress in zip(totals, stresses, strict=True):
                fields = np.moveaxis(stress, -1, 0).astype(np.float32, order="C")
                for field, load, sign in zip(
                    total[component], image, signs[:, component], strict=True
                ):
                    (np.add if sign > 0 else np.subtract)(field, fields[load], out=field)
    difference, shear = (np.moveaxis(total, (0, 1), (-1, -2)) for total in totals)
    return SolidInfluence(*places, z, weights, difference, shear)


def light_stresses(
    block: Block,
    part: SymmetricPart,
    mesh: BoxMesh,
    places: tuple[Array, Array],
    depth: csr_array,
    component: int,
) -> tuple[Array, Array]:
    """sigma_x - sigma_y = 2 mu (eps_x - eps_y), and tau_xy = mu gamma_xy, of a class of loads.

    Both need slopes of u and v in the plane only, which the elements give at any depth.

    Parameters
    ----------
    block : Block
        The layers.
    part : SymmetricPart
        Displacements of a quarter.
    mesh : BoxMesh
        Bricks of the block.
    places : (ndarray, ndarray)
        Samples along x and y, shape (nx,), (ny,) [m].
    depth : sparse array, shape (slices, along z)
        What is wanted of the shape functions along z: values at depths, or their integral.
    component : int
        Component of the loads: 0 for N, 1 for T_x, 2 for T_y.

    Returns
    -------
    difference, shear : ndarray, shape (nx, ny, slices, r)
        Per newton on each load of the quarter [Pa/N].
    """
    order = mesh.order
    u, v = (along(depth, part.coefficients[i, ..., component], axis=2) for i in (0, 1))

    def slope(values: Array, displacement: int, axis: int) -> Array:
        for mirror, breaks, points in zip(part.mirrors, (mesh.x, mesh.y), places, strict=True):
            matrices = mirrored_interpolation(order, breaks, points, mirror.of(displacement))
            values = along(matrices[int(mirror.axis == axis)], values, mirror.axis)
        return values

    _, mu = lame_parameters(block.photoelastic)
    difference = 2 * mu * (slope(u, 0, 0) - slope(v, 1, 1))
    return difference, mu * (slope(u, 0, 1) + slope(v, 1, 0))
