"""What forces of tactels amount to together: force, moment and centre of pressure."""

from __future__ import annotations

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.contacts.resultant import resultant_matrix

QUANTITIES = ("normal", "shear_x", "shear_y", "twist", "centre_x", "centre_y")
"""Force along -z, x and y [N], moment about the pad's centre [N m], centre of pressure [m]."""


def resultant(
    places: Array, forces: Array, members: Mask, covariance: Array | None = None
) -> tuple[Array, Array]:
    """Resultant of some tactels, and its standard deviations.

    Parameters
    ----------
    places : ndarray, shape (n, 2)
        Of the tactels [m].
    forces : ndarray, shape (n, 3)
        N, T_x, T_y [N].
    members : ndarray of bool, shape (n,)
        Which tactels count.
    covariance : ndarray, shape (3n, 3n), optional
        Of the forces, tactel after tactel [N^2]; they are exact if not given.

    Returns
    -------
    values, std : ndarray, shape (6,)
        `QUANTITIES`; the centre of pressure is not a number where nothing presses.
    """
    weights = resultant_matrix(places)[[0, 1, 2, 5, 5, 5]]
    weights[4:] = 0
    weights[:, ~members] = 0
    values = (weights * forces).sum(axis=(1, 2))
    push = values[0]
    centre = (places[members] * forces[members, :1]).sum(axis=0)
    values[4:] = centre / push if push > 0 else np.nan
    # how the centre moves as a tactel presses more
    weights[4:, members, 0] = ((places[members] - values[4:]) / push).T if push > 0 else np.nan
    if covariance is None:
        return values, np.zeros(6)
    rows = weights.reshape(6, -1)
    return values, np.sqrt(np.maximum(((rows @ covariance) * rows).sum(axis=1), 0))
