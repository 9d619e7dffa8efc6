"""Displacements of the strip under a unit force on each tactel, by finite elements."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.base.errors import InputError
from fringeforce.design.strip import Layer, Transducer
from fringeforce.mechanics.elements import located, shape_functions
from fringeforce.mechanics.mesh import Mesh
from fringeforce.mechanics.moduli import PlaneModuli, plane_moduli
from fringeforce.mechanics.substructure import TensorSystem, factorise


@dataclass(frozen=True, eq=False)
class Displacement:
    """Displacements per newton, as coefficients of the mesh's shape functions.

    Attributes
    ----------
    transducer : Transducer
        The strip.
    mesh : Mesh
        Where the shape functions live.
    coefficients : ndarray, shape (2, order * columns + 1, order * rows + 1, n, 2)
        Coefficients of u and w [m/N], for normal and tangential unit forces on each of the n
        tactels; without the last two axes [m] for one load.
    """

    transducer: Transducer
    mesh: Mesh
    coefficients: Array

    def moduli(self, layer: Layer) -> PlaneModuli:
        """Stiffness of one of the strip's layers in its plane state."""
        return plane_moduli(layer, self.transducer.plane)

    def superposed(self, forces: ArrayLike) -> Displacement:
        """Displacement under one load, forces of shape (n, 2) [N]."""
        coefficients = np.tensordot(self.coefficients, np.asarray(forces, dtype=float), axes=2)
        return Displacement(self.transducer, self.mesh, coefficients)


def unit_displacements(transducer: Transducer, positions: ArrayLike, mesh: Mesh) -> Displacement:
    """Solve for all unit forces at once, with one factorisation.

    Parameters
    ----------
    transducer : Transducer
        The strip; bonded at its base, its edges free or on rollers.
    positions : array_like, shape (n,)
        Where the tactels' line loads act [m]; each must be an element boundary of the mesh.
    mesh : Mesh
        The elements.

    Returns
    -------
    Displacement
        For a normal force of 1 N (towards -z) and a tangential one (towards +x) on each tactel.
    """
    tactels = np.asarray(positions, dtype=float)
    astray = np.abs(mesh.x[:, None] - tactels).min(axis=0)
    if astray.max(initial=0.0) > 1e-9 * np.ptp(mesh.x):
        worst = tactels[astray.argmax()]
        raise InputError(
            f"The tactel at x = {worst:g} m lies inside an element; a mesh needs an element "
            "boundary under each tactel. Build it with strip_mesh."
        )
    return Displacement(transducer, mesh, unit_solutions(transducer, tactels, mesh))


def unit_solutions(
    transducer: Transducer, positions: ArrayLike, mesh: Mesh, weights: Array | None = None
) -> Array:
    """Coefficients of `unit_displacements`, or what they add up to over the depth.

    Parameters
    ----------
    transducer, mesh
        As of `unit_displacements`.
    positions : array_like, shape (n,)
        Where line loads act [m].  Near one inside an element displacements are rough; further
        away than the elements are large nothing is lost.
    weights : ndarray, shape (2, order * rows + 1), optional
        By which u and w are added up over the depth, far sooner than all of them are found.

    Returns
    -------
    ndarray, shape (2, order * columns + 1, order * rows + 1 or 1, n, 2)
        Coefficients of u and w under a normal and a tangential unit force at each place [m/N], or
        of their weighed sums.
    """
    places = np.asarray(positions, dtype=float)
    # a mirror plane on a mesh line, as evenly spaced tactels have it, halves the strip
    halved = len(mesh.x) % 2 == 1 and _mirrored(mesh.x) and _mirrored(places)
    return (_by_halves if halved else _as_a_whole)(transducer, places, mesh, weights)


def _mirrored(places: Array) -> bool:
    return bool(np.abs(places + places[::-1]).max(initial=0.0) <= 1e-12 * np.ptp(places))


def _as_a_whole(
    transducer: Transducer, positions: Array, mesh: Mesh, weights: Array | None
) -> Array:
    system = _factorised(transducer, mesh, _held(transducer, mesh))
    return _by_component(system.solve(*_line_loads(transducer, positions, mesh), weights))


def _by_halves(
    transducer: Transducer, positions: Array, mesh: Mesh, weights: Array | None
) -> Array:
    """Displacements from the left half, once with u and once with w held at zero in the mirror.

    What a load and its mirror image do together is even, what they do against each other is odd;
    half of the sum is what the load alone does.  The mirror turns u and tangential forces around.
    """
    middle, n = len(mesh.x) // 2, len(positions)
    half, left = replace(mesh, x=mesh.x[: middle + 1]), positions[: (n + 1) // 2]
    held = _held(transducer, half)
    held[-1, 0] = True
    even = _factorised(transducer, half, held)
    pair = even.columns[even.kind[-1]].stiffness
    lines = even.lines.held_last(pair, np.repeat([False, True], held.shape[2]))
    loads = _line_loads(transducer, left, half)
    both = [_by_component(one) for one in even.solve_both(*loads, weights, lines)]
    near, far = (both[0] + both[1]) / 2, (both[0] - both[1]) / 2
    upright = np.array([1.0, -1.0])
    image, sign = _mirror_image(mesh.order, middle)
    turned = np.array([-1.0, 1.0])[:, None, None, None, None] * upright * sign[:, None, None, None]
    columns, right = near.shape[1], np.arange(n // 2)[::-1]
    whole = np.empty((2, 2 * columns - 1, near.shape[2], n, 2))
    whole[:, :columns, :, : len(left)] = near
    whole[:, columns - 1 :, :, : len(left)] = turned * upright * far[:, image]
    whole[:, :columns, :, len(left) :] = upright * far[..., right, :]
    whole[:, columns - 1 :, :, len(left) :] = (turned * near[:, image])[..., right, :]
    return whole


def _mirror_image(order: int, elements: int) -> tuple[Index, Array]:
    """Which coefficient along a line stands in the mirror for which, and with what sign.

    A bubble stays in its element; those of odd degree change their sign.
    """
    element, within = np.divmod(np.arange(order * elements + 1), order)
    vertex = within == 0
    image = order * (elements - element - np.where(vertex, 0, 1)) + within
    return image, np.where(vertex | (within % 2 == 1), 1.0, -1.0)


def _held(transducer: Transducer, mesh: Mesh) -> Mask:
    """Which unknowns of the mesh lines are zero, shape (lines, 2, unknowns along z)."""
    held = np.zeros((len(mesh.x), 2, mesh.order * (len(mesh.z) - 1)), dtype=bool)
    if transducer.edges == "roller":
        held[np.abs(mesh.x) > (1 - 1e-9) * transducer.length / 2, 0] = True
    return held


def _factorised(transducer: Transducer, mesh: Mesh, held: Mask) -> TensorSystem:
    in_cover = mesh.z[:-1] >= -transducer.compliant.thickness * (1 + 1e-9)
    moduli = [
        plane_moduli(transducer.compliant if cover else transducer.photoelastic, transducer.plane)
        for cover in in_cover
    ]
    return factorise(
        mesh.order,
        np.diff(mesh.x),
        np.diff(mesh.z),
        np.array([m.c11 for m in moduli]),
        np.array([m.c12 for m in moduli]),
        held,
    )


def _line_loads(transducer: Transducer, positions: Array, mesh: Mesh) -> tuple[Array, Array]:
    """`_unit_loads` per width of the strip, all cases along the last axis."""
    lines, between = (
        (loads / transducer.width).reshape(*loads.shape[:3], 2 * len(positions))
        for loads in _unit_loads(mesh, positions)
    )
    return lines, between


def _by_component(solved: Array) -> Array:
    """Cases as places and components."""
    return solved.reshape(*solved.shape[:3], -1, 2)


def _unit_loads(mesh: Mesh, positions: Array) -> tuple[Array, Array]:
    """Forces on the surface: on the mesh lines, and between them.

    Returns
    -------
    lines : ndarray, shape (lines, 2, unknowns along z, n, 2)
    between : ndarray, shape (columns, 2, order - 1, n, 2)
    """
    order, rows, tactels = mesh.order, len(mesh.z) - 1, np.arange(len(positions))
    element, fraction = located(mesh.x, positions)
    left, *bubbles, right = shape_functions(order, fraction)[0]
    lines = np.zeros((len(mesh.x), 2, order * rows, len(positions), 2))
    between = np.zeros((len(mesh.x) - 1, 2, order - 1, len(positions), 2))
    for kind, (component, sign) in enumerate([(1, -1.0), (0, 1.0)]):
        lines[element, component, -1, tactels, kind] = sign * left
        lines[element + 1, component, -1, tactels, kind] = sign * right
        for number, bubble in enumerate(bubbles):
            between[element, component, number, tactels, kind] = sign * bubble
    return lines, between
