"""From stress to phase lead, equations (1) to (3) of the paper."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.design.strip import PhotoelasticLayer


def stress_optic_constant(layer: PhotoelasticLayer, wavelength: float) -> float:
    """K_t, the phase that a stress difference adds per length of path [rad/(Pa m)].

    K_t = C 2 pi / lambda with the stress-optic coefficient C = (1 + nu_2) / E_2 * K_s, equation
    (2): the strain-optic law written for a difference of principal stresses.

    Parameters
    ----------
    layer : PhotoelasticLayer
        The birefringent layer.
    wavelength : float
        Wavelength of the light, in vacuum [m].
    """
    return layer.stress_optic * 2 * np.pi / wavelength


def phase_lead(integrated_stress: ArrayLike, stress_optic_constant: float) -> Array:
    """Phase lead of light that crosses the layer twice, equation (1) [rad].

    Parameters
    ----------
    integrated_stress : array_like, any shape
        Integral of sigma_x - sigma_y over the layer's depth [Pa m].
    stress_optic_constant : float
        K_t [rad/(Pa m)].
    """
    return 2 * stress_optic_constant * np.asarray(integrated_stress, dtype=float)


def phase_lead_rectangle_rule(
    sigma_x: ArrayLike, spacing: float, stress_optic_constant: float
) -> Array:
    """Phase lead from nodal stresses by equation (3), kept for comparison.

    The rule gives the two end nodes the weight of an inner one, so on L nodes it integrates over
    L / (L - 1) of the depth.

    Parameters
    ----------
    sigma_x : array_like, shape (m, L, ...)
        Stress at L evenly spaced nodes through the layer, both faces included [Pa].
    spacing : float
        Distance between neighbouring nodes [m].
    stress_optic_constant : float
        K_t [rad/(Pa m)].

    Returns
    -------
    ndarray, shape (m, ...)
        Phase lead [rad].
    """
    return 2 * stress_optic_constant * np.asarray(sigma_x, dtype=float).sum(axis=1) * spacing
