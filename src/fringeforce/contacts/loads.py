"""Loads as people state them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array, numbers
from fringeforce.base.errors import InputError

PAPER_LOAD, PAPER_ANGLE = 1.0, 10.0
"""The paper's example: force on every tactel [N], and its angle from the normal [degrees]."""


def polar(magnitude: ArrayLike, angle: ArrayLike, n: int | None = None) -> Array:
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
    ndarray, shape (n, 2)
        Normal and tangential force of every tactel [N].

    Examples
    --------
    >>> ff.polar(2.0, angle=30, n=3).round(3)
    array([[1.732, 1.   ],
           [1.732, 1.   ],
           [1.732, 1.   ]])
    """
    size, alpha = np.broadcast_arrays(np.asarray(magnitude, float), np.radians(angle))
    forces = np.stack([size * np.cos(alpha), size * np.sin(alpha)], axis=-1)
    if forces.ndim == 1:
        if n is None:
            raise InputError("One magnitude and one angle say nothing of how many tactels; give n.")
        return np.repeat(forces[None], n, axis=0)
    if n not in (None, forces.shape[-2]):
        raise InputError(f"n = {n}, but magnitude and angle are given for {forces.shape[-2]}.")
    return forces


def paper_load(n: int) -> Array:
    """The load of the paper's example on n tactels, shape (n, 2) [N]."""
    return polar(PAPER_LOAD, PAPER_ANGLE, n)


def finite_loads(forces: ArrayLike, tactels: int) -> Array:
    """As `checked_loads`, of a strip, and InputError if a force is not finite."""
    loads = checked_loads(forces, tactels)
    if not np.isfinite(loads).all():
        place = tuple(np.argwhere(~np.isfinite(loads))[0].tolist())
        raise InputError(f"Force {place} is {loads[place]:g} N; forces must be finite.")
    return loads


def checked_loads(forces: ArrayLike, tactels: int, components: int = 2) -> Array:
    """Forces as floats of shape (..., tactels, components) [N].

    Raises
    ------
    InputError
        If they are no numbers, those of another number of tactels, or have the components before
        the tactels.
    """
    loads = numbers(forces, f"Forces, of shape (..., {tactels}, {components}),")
    if loads.shape[-2:] != (tactels, components):
        turned = loads.shape[-2:] == (components, tactels)
        remedy = " Components come last: pass np.swapaxes(forces, -1, -2)." if turned else ""
        names = {2: "the normal and the tangential force", 3: "N, T_x and T_y"}[components]
        raise InputError(
            f"Forces of shape {loads.shape} do not fit this sensor; its {tactels} tactels "
            f"need (..., {tactels}, {components}): {names} of each.{remedy}"
        )
    return loads
