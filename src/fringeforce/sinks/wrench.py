"""The force on the whole strip, as robots state it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
FRAME_ID = "tactile_sensor"


def wrenches(forces: Array, positions: Array) -> tuple[Array, Array]:
    """Resultant force and its moment about the middle of the loaded surface.

    Axes are those of the strip: x along it, z upwards from the loaded surface, so that a pressing
    force points to -z.

    Parameters
    ----------
    forces : ndarray, shape (k, 2, n)
        Normal and tangential forces [N].
    positions : ndarray, shape (n,)
        Of the tactels [m].

    Returns
    -------
    force : ndarray, shape (k, 3)
        [N].
    torque : ndarray, shape (k, 3)
        [N m].
    """
    normal, tangential = forces[:, 0], forces[:, 1]
    nothing = np.zeros(len(forces))
    force = np.stack([tangential.sum(axis=1), nothing, -normal.sum(axis=1)], axis=1)
    torque = np.stack([nothing, normal @ positions, nothing], axis=1)
    return force, torque
