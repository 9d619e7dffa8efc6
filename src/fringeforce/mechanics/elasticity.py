"""Displacements of the strip under a unit force on each tactel, by finite elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.design import Layer, Transducer
from fringeforce.errors import InputError
from fringeforce.mechanics.mesh import Mesh
from fringeforce.mechanics.moduli import PlaneModuli, plane_moduli
from fringeforce.mechanics.substructure import factorise

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Displacement:
    """Displacements per newton, as coefficients of the mesh's shape functions.

    Attributes
    ----------
    transducer : Transducer
        The strip.
    mesh : Mesh
        Where the shape functions live.
    coefficients : ndarray, shape (2, order * columns + 1, order * rows + 1, 2, n)
        Of u and w [m/N], for normal and tangential unit forces on each of the n tactels; without
        the last two axes [m] for one load.
    """

    transducer: Transducer
    mesh: Mesh
    coefficients: Array

    def moduli(self, layer: Layer) -> PlaneModuli:
        """Stiffness of one of the strip's layers in its plane state."""
        return plane_moduli(layer, self.transducer.plane)

    def superposed(self, forces: ArrayLike) -> Displacement:
        """Displacement under one load, forces of shape (2, n) [N]."""
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
    in_cover = mesh.z[:-1] >= -transducer.compliant.thickness * (1 + 1e-9)
    moduli = [
        plane_moduli(transducer.compliant if cover else transducer.photoelastic, transducer.plane)
        for cover in in_cover
    ]
    lines, height = len(mesh.x), mesh.order * (len(mesh.z) - 1)
    held = np.zeros((lines, 2, height), dtype=bool)
    if transducer.edges == "roller":
        held[[0, -1], 0] = True
    system = factorise(
        mesh.order,
        np.diff(mesh.x),
        np.diff(mesh.z),
        np.array([m.c11 for m in moduli]),
        np.array([m.c12 for m in moduli]),
        held,
    )
    loads = _unit_loads(mesh, np.asarray(positions, dtype=float)) / transducer.width
    coefficients = system.solve(loads.reshape(lines, 2, height, -1))
    return Displacement(transducer, mesh, coefficients.reshape(*coefficients.shape[:3], 2, -1))


def _unit_loads(mesh: Mesh, positions: Array) -> Array:
    """Nodal forces on the surface, shape (lines, 2, unknowns along z, 2, n)."""
    nearest = np.abs(mesh.x[:, None] - positions).argmin(axis=0)
    astray = np.abs(mesh.x[nearest] - positions)
    if astray.max(initial=0.0) > 1e-9 * np.ptp(mesh.x):
        worst = positions[astray.argmax()]
        raise InputError(
            f"The tactel at x = {worst:g} m lies inside an element; a mesh needs an element "
            "boundary under each tactel. Build it with strip_mesh."
        )
    tactels = np.arange(len(positions))
    loads = np.zeros((len(mesh.x), 2, mesh.order * (len(mesh.z) - 1), 2, len(positions)))
    loads[nearest, 1, -1, 0, tactels] = -1.0
    loads[nearest, 0, -1, 1, tactels] = 1.0
    return loads
