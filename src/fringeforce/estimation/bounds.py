"""How well a frame can determine loads: Fisher information and the Cramer-Rao bound."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.likelihood import Response

Array = NDArray[np.float64]


def fisher_information(phase: Array, influence: Array, response: Response) -> Array:
    """Information on the loads in one frame, J' J / s^2 with the slopes J of the grey levels.

    Parameters
    ----------
    phase : ndarray, shape (P,)
        Phase [rad].
    influence : ndarray, shape (P, m)
        Influence matrix [rad/N].
    response : Response
        Of the camera.

    Returns
    -------
    ndarray, shape (m, m)
        Information [1/N^2].
    """
    slopes = response.jacobian(phase, influence)
    return np.asarray((slopes.T / response.variance) @ slopes)


def cramer_rao_bound(phase: Array, influence: Array, response: Response) -> Array:
    """Smallest standard deviations that an unbiased reading of one frame can have, shape (m,) [N].

    Infinite where the frame does not change with a load to first order, as at zero load.
    """
    return bounds_of(fisher_information(phase, influence, response))


def bounds_of(information: Array) -> Array:
    """Standard deviations that an information allows, shape (m,); infinite where it has none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        try:
            variances = np.diag(np.linalg.inv(information))
        except np.linalg.LinAlgError:
            return np.full(len(information), np.inf)
        return np.where(variances > 0, np.sqrt(np.maximum(variances, 0)), np.inf)
