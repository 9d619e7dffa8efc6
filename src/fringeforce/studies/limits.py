"""Loads at which something must end: the paper's start, the camera's pixels, linear elasticity.

A load is admissible up to L if every tactel's normal force is from 0 to L and its tangential one
is within friction.  What is asked of phases is linear in the forces, so each limit is a linear
program.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.models.strip import SensorModel
from fringeforce.studies.loads import FRICTION
from fringeforce.studies.summary import surface_strain

PAPER_START = (-np.pi, 0.0)
"""Phases at the borders for which equation (12) may start with m = n = k = 0 [rad]."""
SIGN_BY_CONTACT = (-np.pi, np.pi)
"""The same phases where the knowledge that contact pushes puts a mirrored phase -p right [rad]."""
NYQUIST = 0.5
"""Fringes per pixel that a camera resolves."""
LARGEST_STRAIN = 0.1
"""Strain near which linear elasticity ends."""


def border_influence(model: SensorModel) -> Array:
    """Influence matrix at the strip's two ends, shape (2, n, 2) [rad/N].

    A free end carries no stress, so its phase is zero by the boundary condition; the elements,
    which meet it weakly, come within about 1e-3 of their peak and are not asked.
    """
    half = model.sensor.transducer.length / 2
    if model.sensor.transducer.edges == "free":
        return np.zeros((2, model.sensor.tactels.count, 2))
    return model.influence([-half, half])


def edge_limit(
    border: Array,
    uniform: bool = False,
    interval: tuple[float, float] = PAPER_START,
    friction: float = FRICTION,
) -> float:
    """Largest L for which every admissible load keeps the phase at the borders in an interval.

    Section IV of the paper asks this of the phase at both ends.  It is the smallest L at which some
    load takes some border out: min L such that psi F is beyond the interval, 0 <= N <= L and
    |T| <= friction N.

    Parameters
    ----------
    border : ndarray, shape (k, n, 2)
        Influence matrix at the borders [rad/N].
    uniform : bool
        Whether all tactels carry the same force, instead of the worst distribution.
    interval : (float, float)
        Lowest and highest phase, with zero inside or at an end [rad].
    friction : float
        Largest tangential over normal force.

    Returns
    -------
    float
        Normal force [N]; zero if any load however small may leave, infinite if none does.
    """
    if uniform:
        border = border.sum(axis=1, keepdims=True)
    lowest, highest = interval
    if not lowest <= 0 <= highest:
        raise InputError(f"interval = {interval}: must hold 0, the phase without a load.")
    sides = [(-psi, -lowest) for psi in border] + [(psi, highest) for psi in border]
    return min(_smallest_leaving(psi, distance, friction) for psi, distance in sides)


def _smallest_leaving(psi: Array, distance: float, friction: float) -> float:
    """Smallest L at which some admissible load has psi F = distance, or beyond for distance 0."""
    n = len(psi)
    # unknowns N and T of every tactel, then L: friction both ways, and N <= L
    each = [[-friction, 1.0], [-friction, -1.0], [1.0, 0.0]]
    limits = np.hstack([np.kron(np.eye(n), each), np.tile([[0.0], [0.0], [-1.0]], (n, 1))])
    bounds = [(0, None), (None, None)] * n + [(0, None)]
    # the set scales with L, so reaching one radian tells how far any other distance is
    reach = np.append(psi.ravel(), 0.0)[None]
    found = linprog(
        np.append(np.zeros(2 * n), 1.0),
        A_ub=limits,
        b_ub=np.zeros(3 * n),
        A_eq=reach,
        b_eq=[1.0],
        bounds=bounds,
    )
    return float(found.fun * distance) if found.status == 0 else np.inf


def largest_phase(rows: Array, uniform: bool = False, friction: float = FRICTION) -> Array:
    """Largest size of phases (or of their steps) under admissible loads up to 1 N.

    The same linear program without a border: it falls apart tactel by tactel, and each tactel's
    best is a corner of its triangle of forces, so its optimum is a sum.

    Parameters
    ----------
    rows : ndarray, shape (m, n, 2)
        Rows of an influence matrix [rad/N].
    uniform, friction
        As for `edge_limit`.

    Returns
    -------
    ndarray, shape (m,)
        Per newton of normal force [rad/N].
    """
    if uniform:
        rows = rows.sum(axis=1, keepdims=True)
    normal, tangential = rows[..., 0], friction * np.abs(rows[..., 1])
    upwards = np.maximum(normal + tangential, 0).sum(axis=1)
    downwards = np.maximum(tangential - normal, 0).sum(axis=1)
    return np.maximum(upwards, downwards)


def densest_fringes(model: SensorModel, uniform: bool = False) -> float:
    """Fringes per pixel and newton under the admissible load that packs them closest."""
    steps = np.diff(model.pixel_influence, axis=0)
    return float(largest_phase(steps, uniform).max() / (2 * np.pi))


def nyquist_limit(model: SensorModel, uniform: bool = False) -> float:
    """Largest L at which the camera resolves the fringes of every admissible load [N]."""
    return NYQUIST / densest_fringes(model, uniform)


def strain_per_newton(model: SensorModel) -> float:
    """Strain of the softer layer under 1 N spread over one pitch, as a fraction."""
    strip = model.sensor.transducer
    softer = max(1.0, strip.compliant.youngs_modulus / strip.photoelastic.youngs_modulus)
    return surface_strain(model) * softer


def strain_limit(model: SensorModel) -> float:
    """Largest normal force on every tactel that keeps the strain within linear elasticity [N]."""
    return LARGEST_STRAIN / strain_per_newton(model)
