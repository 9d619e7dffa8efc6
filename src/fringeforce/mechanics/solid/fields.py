"""Displacements and stresses of a whole block under one load."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.mechanics.elements import along, interpolation
from fringeforce.mechanics.moduli import lame_parameters
from fringeforce.mechanics.solid.block import Block
from fringeforce.mechanics.solid.elasticity import Loads, SymmetricPart, symmetric_parts
from fringeforce.mechanics.solid.mesh import BoxMesh
from fringeforce.mechanics.solid.symmetry import mirrored_interpolation


def superposed(
    block: Block,
    loads: Loads,
    mesh: BoxMesh,
    forces: ArrayLike,
    progress: Progress | None = None,
) -> list[SymmetricPart]:
    """Displacements under one load, in its classes of symmetry.

    Parameters
    ----------
    block, loads, mesh, progress
        As for `symmetric_parts`.
    forces : array_like, shape (n, components)
        N, T_x and T_y on every tactel [N].

    Returns
    -------
    list of SymmetricPart
        With coefficients of shape (3, along x, along y, along z) [m].
    """
    values = np.asarray(forces, dtype=float)
    expected = (len(loads.places), loads.components)
    if values.shape != expected:
        raise InputError(f"Forces of shape {values.shape} do not fit these loads: {expected}.")
    parts = []
    for part in symmetric_parts(block, loads, mesh, progress=progress):
        image, signs = loads.images(part.mirrors)
        onto = np.zeros((len(loads.quarter), loads.components))
        np.add.at(onto, image, signs * values)
        coefficients = np.tensordot(part.coefficients, onto, axes=2)
        parts.append(SymmetricPart(part.mirrors, coefficients))
    return parts


def displacement(parts: list[SymmetricPart], mesh: BoxMesh, x: Array, y: Array, z: Array) -> Array:
    """Displacements of `superposed` parts on a grid of places, shape (3, nx, ny, nz) [m]."""
    return np.stack([_derivative(parts, mesh, (x, y, z), i, None) for i in range(3)])


def stress(
    block: Block, parts: list[SymmetricPart], mesh: BoxMesh, x: Array, y: Array, z: Array
) -> Array:
    """Stresses of `superposed` parts on a grid of places, shape (3, 3, nx, ny, nz) [Pa].

    The interface counts to the photoelastic layer.
    """
    gradient = np.array(
        [[_derivative(parts, mesh, (x, y, z), i, j) for j in range(3)] for i in range(3)]
    )
    layers = [block.compliant if at > block.interface else block.photoelastic for at in z]
    lam, mu = np.array([lame_parameters(layer) for layer in layers]).T
    result = mu * (gradient + gradient.swapaxes(0, 1))
    result[np.arange(3), np.arange(3)] += lam * np.trace(gradient)
    return result


def _derivative(
    parts: list[SymmetricPart],
    mesh: BoxMesh,
    places: tuple[Array, Array, Array],
    component: int,
    axis: int | None,
) -> Array:
    """A component of displacements, or its slope along an axis, shape (nx, ny, nz)."""
    total = np.zeros([len(points) for points in places])
    vertical = interpolation(mesh.order, mesh.z, places[2])[int(axis == 2)]
    for part in parts:
        values = along(vertical, part.coefficients[component], 2)
        for mirror, breaks in zip(part.mirrors, (mesh.x, mesh.y), strict=True):
            matrices = mirrored_interpolation(
                mesh.order, breaks, places[mirror.axis], mirror.of(component)
            )
            values = along(matrices[int(axis == mirror.axis)], values, mirror.axis)
        total += values
    return total
