"""The force on the whole sensor, as robots state it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
FRAME_ID = "tactile_sensor"


def wrenches(forces: Array, places: Array) -> tuple[Array, Array]:
    """Resultant force and its moment about the middle of the loaded surface.

    Axes are those of the sensor: x along it, z upwards from the loaded surface, so that a pressing
    force points to -z.

    Parameters
    ----------
    forces : ndarray, shape (k, n, 2), or (k, n, 3) of a pad
        Normal and tangential forces, or N, T_x, T_y [N].
    places : ndarray, shape (n,), or (n, 2) of a pad
        Of the tactels [m].

    Returns
    -------
    force : ndarray, shape (k, 3)
        [N].
    torque : ndarray, shape (k, 3)
        [N m].
    """
    nothing = np.zeros(len(forces))
    if places.ndim == 1:
        normal, tangential = np.moveaxis(forces, 2, 0)
        force = np.stack([tangential.sum(axis=1), nothing, -normal.sum(axis=1)], axis=1)
        return force, np.stack([nothing, normal @ places, nothing], axis=1)
    normal, along, across = np.moveaxis(forces, 2, 0)
    x, y = places.T
    force = np.stack([along.sum(axis=1), across.sum(axis=1), -normal.sum(axis=1)], axis=1)
    # r x (T_x, T_y, -N) at z = 0
    return force, np.stack([-(normal @ y), normal @ x, across @ x - along @ y], axis=1)
