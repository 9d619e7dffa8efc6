"""Fingertips on a pad: a round patch pressed as Hertz found, and the forces of the tactels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fringeforce.design.pad import PadTactels

Array = NDArray[np.float64]
POINTS = 8192
"""Places of equal pressure that stand for one contact."""
GOLDEN = np.pi * (3 - np.sqrt(5))
MARGIN = 1.5
"""Pitches around a contact in which its reading may be found."""


@dataclass(frozen=True)
class Contact:
    """One fingertip.

    Attributes
    ----------
    x, y : float
        Its centre [m].
    radius : float
        Of the round patch that touches [m].
    normal : float
        How hard it presses [N].
    shear_x, shear_y : float
        What it drags with [N].
    twist : float
        Moment about the normal, positive from x to y [N m].
    """

    x: float
    y: float
    radius: float
    normal: float
    shear_x: float = 0.0
    shear_y: float = 0.0
    twist: float = 0.0


def tactel_forces(tactels: PadTactels, contacts: Sequence[Contact]) -> Array:
    """Forces that contacts put on tactels, shape (n, 3): N, T_x, T_y [N].

    Under a round elastic contact the load within r of the centre is 1 - (1 - r^2 / a^2)^(3/2) of
    all of it (Hertz, J. reine angew. Math. 92, 156, 1881).  Points of equal load fill the patch
    in a sunflower's spiral, and each loads the tactel whose cell it lies in.  What would lie beyond
    the tactels is carried by the others.  Shear is spread as pressure is; a twist pulls across
    the radius, in proportion to pressure and radius.
    """
    forces = np.zeros((tactels.total, 3))
    for contact in contacts:
        offset = contact.radius * _spiral()
        places = offset + np.array([contact.x, contact.y])
        cell = np.round(places / tactels.pitch + _middle(tactels)).astype(int)
        inside = ((cell >= 0) & (cell < tactels.count)).all(axis=1)
        if not inside.any():
            continue
        share, offset = 1 / inside.sum(), offset[inside]
        own = cell[inside, 0] * tactels.count[1] + cell[inside, 1]
        pull = contact.twist / max((offset**2).sum(), 1e-30)
        points = (
            np.full(len(own), contact.normal * share),
            contact.shear_x * share - pull * offset[:, 1],
            contact.shear_y * share + pull * offset[:, 0],
        )
        for component, values in enumerate(points):
            forces[:, component] += np.bincount(own, values, tactels.total)
    return forces


def groups(tactels: PadTactels, contacts: Sequence[Contact]) -> NDArray[np.bool_]:
    """Which tactels belong to which contact, shape (k, n): near it, and nearer than to others."""
    if not contacts:
        return np.zeros((0, tactels.total), dtype=bool)
    centres = np.array([[contact.x, contact.y] for contact in contacts])
    reach = np.array([contact.radius for contact in contacts]) + MARGIN * tactels.pitch
    apart = np.linalg.norm(tactels.places - centres[:, None], axis=2)
    nearest = (apart - reach[:, None]).argmin(axis=0)
    return (apart <= reach[:, None]) & (nearest == np.arange(len(contacts))[:, None])


@lru_cache(maxsize=1)
def _spiral() -> Array:
    """Places of equal load in a patch of radius one, shape (POINTS, 2)."""
    load = (np.arange(POINTS) + 0.5) / POINTS
    radius, angle = np.sqrt(1 - (1 - load) ** (2 / 3)), GOLDEN * np.arange(POINTS)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def _middle(tactels: PadTactels) -> Array:
    return (np.array(tactels.count) - 1) / 2
