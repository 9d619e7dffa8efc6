"""From displacements to stresses, and to the one stress integral that the light sees."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array

from fringeforce.base.arrays import Array
from fringeforce.design.strip import Transducer
from fringeforce.mechanics.elasticity import Displacement, unit_solutions
from fringeforce.mechanics.elements import along, integrals, interpolation
from fringeforce.mechanics.mesh import Mesh
from fringeforce.mechanics.moduli import plane_moduli

SOLVED = 64
"""Solved strips that are kept, 0.05 to 4 MB each: designs that differ by camera, light or
optics alone share one, and so do a calibration and the readings with it."""


def integrated_stress(displacement: Displacement, x: ArrayLike) -> Array:
    """Depth integral of the stress difference that the light sees, per unit tactel force.

    Light runs along z and sees sigma_x - sigma_y.  In plane stress sigma_y = 0, and the integral of
    sigma_x over the photoelastic layer is  c11 d/dx int u dz + c12 [w(-a) - w(-a-b)];  in plane
    strain sigma_x - sigma_y = 2 shear eps_x, whose integral is  2 shear d/dx int u dz.  The depth
    integral of u is exact for the elements.

    Parameters
    ----------
    displacement : Displacement
        Displacement of the strip under unit forces.
    x : array_like, shape (m,)
        Where to evaluate [m].

    Returns
    -------
    ndarray, shape (m, n, 2)
        Integral of sigma_x - sigma_y over the photoelastic layer [Pa m / N].
    """
    weights = _crossing(displacement.transducer, displacement.mesh)
    crossed = np.einsum("cz,cxz...->cx...", weights, displacement.coefficients)
    return _integrated(displacement.transducer, displacement.mesh, crossed, x)


def unit_stress(transducer: Transducer, places: ArrayLike, mesh: Mesh, x: ArrayLike) -> Array:
    """`integrated_stress` under unit line loads, without all displacements in between.

    Parameters
    ----------
    transducer : Transducer
        The strip.
    places : array_like, shape (n,)
        Of the line loads [m], anywhere on the surface.
    mesh : Mesh
        The elements; those under the loads may be as large as the cover is thick.
    x : array_like, shape (m,)
        Where to evaluate [m].

    Returns
    -------
    ndarray, shape (m, n, 2)
        Integral of sigma_x - sigma_y over the photoelastic layer [Pa m / N].

    Notes
    -----
    The stress below the cover under a load is, by Betti's theorem, the displacement of the surface
    under a source of that stress; and that is smooth, so that large elements of high order give it
    at any place, though the stress near a load inside one of them is wrong.
    """
    wanted = (np.asarray(part, dtype=float).tobytes() for part in (places, x, mesh.x, mesh.z))
    return _solved(transducer, mesh.order, *wanted).copy()


@lru_cache(maxsize=SOLVED)
def _solved(
    transducer: Transducer, order: int, places: bytes, x: bytes, columns: bytes, rows: bytes
) -> Array:
    """`unit_stress`, with arrays by their bytes, which are hashable."""
    mesh = Mesh(np.frombuffer(columns), np.frombuffer(rows), order)
    crossed = unit_solutions(transducer, np.frombuffer(places), mesh, _crossing(transducer, mesh))
    return _integrated(transducer, mesh, crossed[:, :, 0], np.frombuffer(x))


def _crossing(transducer: Transducer, mesh: Mesh) -> Array:
    """Weights over the depth: of u, to its integral; of w, to the sinking of the interface."""
    rows = int(np.searchsorted(mesh.z, -transducer.compliant.thickness * (1 + 1e-9)))
    interface = rows * mesh.order
    weights = np.zeros((2, mesh.order * (len(mesh.z) - 1) + 1))
    weights[0, : interface + 1] = integrals(mesh.order, mesh.z[: rows + 1])
    weights[1, interface] = 1.0
    return weights


def _integrated(transducer: Transducer, mesh: Mesh, crossed: Array, x: ArrayLike) -> Array:
    """The light's integral, from coefficients along the strip of what `_crossing` weighs."""
    shift, sinking = crossed
    values, slopes = interpolation(mesh.order, mesh.x, np.asarray(x, dtype=float))
    strain = along(slopes, shift)
    moduli = plane_moduli(transducer.photoelastic, transducer.plane)
    if transducer.plane == "strain":
        return 2 * moduli.shear * strain
    return moduli.c11 * strain + moduli.c12 * along(values, sinking)


def stress_field(displacement: Displacement, x: ArrayLike, z: ArrayLike) -> Array:
    """Stresses on a grid, per unit tactel force.

    Parameters
    ----------
    displacement : Displacement
        Displacement of the strip under unit forces.
    x : array_like, shape (m,)
        Positions along the strip [m].
    z : array_like, shape (q,)
        Heights [m]; the interface itself counts to the photoelastic layer.

    Returns
    -------
    ndarray, shape (3, m, q, n, 2)
        sigma_x, sigma_z and tau_xz [Pa/N] for normal and tangential unit forces; (3, m, q) [Pa] for
        a superposed displacement.
    """
    mesh, transducer = displacement.mesh, displacement.transducer
    heights = np.asarray(z, dtype=float)
    value_x, slope_x = interpolation(mesh.order, mesh.x, np.asarray(x, dtype=float))
    value_z, slope_z = interpolation(mesh.order, mesh.z, heights)

    def gradient(component: int, along_x: csr_array, along_z: csr_array) -> Array:
        return along(along_z, along(along_x, displacement.coefficients[component]), axis=1)

    strain_x = gradient(0, slope_x, value_z)
    strain_z = gradient(1, value_x, slope_z)
    shear_strain = gradient(0, value_x, slope_z) + gradient(1, slope_x, value_z)
    field = np.empty((3, *strain_x.shape))
    in_cover = heights > -transducer.compliant.thickness
    for layer, here in ((transducer.compliant, in_cover), (transducer.photoelastic, ~in_cover)):
        moduli = displacement.moduli(layer)
        field[0][:, here] = moduli.c11 * strain_x[:, here] + moduli.c12 * strain_z[:, here]
        field[1][:, here] = moduli.c12 * strain_x[:, here] + moduli.c11 * strain_z[:, here]
        field[2][:, here] = moduli.shear * shear_strain[:, here]
    return field
