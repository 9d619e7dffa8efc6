"""From a recovered phase, or from raw grey levels, to loads."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import InputError

Array = NDArray[np.float64]


def least_squares(phase: ArrayLike, influence: ArrayLike) -> Array:
    """Loads that explain a recovered phase best, equation (14).

    Parameters
    ----------
    phase : array_like, shape (P,)
        Recovered phase [rad]; pixels that are not finite are left out.
    influence : array_like, shape (P, m) or (P, n, 2)
        Influence matrix [rad/N].

    Returns
    -------
    ndarray, shape (m,) or (n, 2)
        Loads [N].

    Raises
    ------
    InputError
        If the shapes do not fit or there are fewer pixels than unknowns.
    """
    measured, matrix = np.asarray(phase, dtype=float), np.asarray(influence, dtype=float)
    flat = matrix.reshape(len(matrix), -1)
    known = np.isfinite(measured)
    if measured.shape != (len(flat),) or known.sum() < flat.shape[1]:
        raise InputError(
            f"{int(known.sum())} known phases of shape {measured.shape} cannot determine "
            f"{flat.shape[1]} loads through an influence matrix of {len(flat)} pixels; give one "
            "phase for every row and at least as many as loads."
        )
    loads = np.linalg.lstsq(flat[known], measured[known], rcond=None)[0]
    return loads.reshape(matrix.shape[1:])
