"""Whether short waves fold the surface of a strained half-plane under dead loads.

Elements resolve waves as long as they are themselves, so that the load from which they find a
stiffness that is not positive definite falls as they are refined.  Waves that are much shorter than
the contact see a homogeneous half-plane, of which theory tells the limit (Biot, Mechanics of
Incremental Deformations, 1965, chapter 3; Simpson and Spector, J. Elasticity 19, 1989).
"""

from __future__ import annotations

import numpy as np

from fringeforce.base.arrays import Array

ANGLES = 32
"""Directions over which impedances are averaged: twice as many change them by less than 1e-9 at
twice the strain at which surfaces fold."""


def surface_stiffness(moduli: Array) -> Array:
    """Least eigenvalue of the surface impedance: tractions per displacement of a wave, and length.

    With the angular averages S and H of -T^-1 R^T and T^-1 the impedance is H^-1 (1 + i S)
    (Barnett and Lothe, Physica Norvegica 7, 1973; Ting, Anisotropic Elasticity, 1996, chapter 7).
    The half-plane is stable under tractions that do not turn where it is positive definite.

    Parameters
    ----------
    moduli : ndarray, shape (2, 2, 2, 2, n)
        Derivatives of the first Piola-Kirchhoff stress by the deformation gradient; the surface is
        normal to the second direction [Pa].

    Returns
    -------
    ndarray, shape (n,)
        0 where the least surface wave costs no energy, less where it gives some [Pa]; minus
        infinity where shear bands do in the solid itself.
    """
    q, r, t = (np.moveaxis(moduli[:, i, :, j], -1, 0) for i, j in ((0, 0), (0, 1), (1, 1)))
    turned = np.arange(ANGLES) * np.pi / ANGLES
    c, s = np.cos(turned)[:, None, None, None], np.sin(turned)[:, None, None, None]
    back = r.transpose(0, 2, 1)
    across = c**2 * t - c * s * (r + back) + s**2 * q
    between = c**2 * r + c * s * (t - q) - s**2 * back
    elliptic = (np.linalg.det(across) > 0) & (np.trace(across, axis1=-2, axis2=-1) > 0)
    found = np.full(len(q), -np.inf)
    if not (sound := elliptic.all(axis=0)).any():
        return found
    soft = np.linalg.inv(across[:, sound])
    h = soft.mean(axis=0)
    s_mean = -(soft @ between[:, sound].transpose(0, 1, 3, 2)).mean(axis=0)
    found[sound] = np.linalg.eigvalsh(np.linalg.inv(h) @ (np.eye(2) + 1j * s_mean))[:, 0]
    return found
