"""Loads that a dry contact can exert: it pushes, and friction limits what it drags."""

from __future__ import annotations

import numpy as np
from scipy.optimize import nnls

from fringeforce.base.arrays import Array, Mask


def within_friction_cone(loads: Array, covariance: Array, friction: float) -> tuple[Array, Mask]:
    """Likeliest loads with N >= 0 and |T| <= friction N on every tactel.

    The loads of each tactel are written as a sum of the two edges of its friction cone with
    amounts that are not negative, which makes it a non-negative least-squares problem.

    Parameters
    ----------
    loads : ndarray, shape (2n,)
        Most likely loads without limits, normal and tangential by turns [N].
    covariance : ndarray, shape (2n, 2n)
        Covariance of the forces [N^2].
    friction : float
        Coefficient of friction.

    Returns
    -------
    loads : ndarray, shape (2n,)
        Most likely loads within the limits [N].
    active : ndarray of bool, shape (n,)
        Tactels whose loads the limits have changed.
    """
    edges = np.kron(np.eye(len(loads) // 2), [[1.0, 1.0], [friction, -friction]])
    root = np.linalg.cholesky(np.linalg.inv(covariance)).T
    amounts, _ = nnls(root @ edges, root @ loads)
    limited = edges @ amounts
    normal, tangential = loads.reshape(-1, 2).T
    slack = 1e-9 * max(np.abs(loads).max(), 1e-12)
    active = (normal < -slack) | (np.abs(tangential) > friction * normal + slack)
    return limited, active
