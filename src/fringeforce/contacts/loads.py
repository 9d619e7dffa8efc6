"""Loads as people state them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import InputError


def polar(magnitude: ArrayLike, angle: ArrayLike, n: int | None = None) -> NDArray[np.float64]:
    """Forces from magnitudes and angles, as the paper states them.

    Parameters
    ----------
    magnitude : array_like, scalar or shape (n,)
        Force on each tactel [N].
    angle : array_like, scalar or shape (n,)
        From the surface normal, towards +x [degrees].
    n : int, optional
        Number of tactels, when magnitude and angle are the same for all.

    Returns
    -------
    ndarray, shape (2, n)
        Normal and tangential forces [N].

    Examples
    --------
    >>> ff.polar(2.0, angle=30, n=3).round(3)
    array([[1.732, 1.732, 1.732],
           [1.   , 1.   , 1.   ]])
    """
    size, alpha = np.broadcast_arrays(np.asarray(magnitude, float), np.radians(angle))
    forces = np.stack([size * np.cos(alpha), size * np.sin(alpha)])
    if forces.ndim == 1:
        if n is None:
            raise InputError("One magnitude and one angle say nothing of how many tactels; give n.")
        return np.repeat(forces[:, None], n, axis=1)
    if n not in (None, forces.shape[1]):
        raise InputError(f"n = {n}, but magnitude and angle are given for {forces.shape[1]}.")
    return forces


def checked_loads(forces: ArrayLike, tactels: int) -> NDArray[np.float64]:
    """Forces as floats of shape (..., 2, tactels) [N].

    Raises
    ------
    InputError
        If they are those of another number of tactels.
    """
    loads = np.asarray(forces, dtype=float)
    if loads.shape[-2:] != (2, tactels):
        raise InputError(
            f"Forces of shape {loads.shape} do not fit this sensor; its {tactels} tactels "
            f"need (..., 2, {tactels}): normal forces first, then tangential ones."
        )
    return loads
