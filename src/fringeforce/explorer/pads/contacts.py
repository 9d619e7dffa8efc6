"""Fingertips on a pad: a round patch pressed as Hertz found, and the forces of the tactels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.contacts.nodes import Squares, disc
from fringeforce.design.pad import PadTactels

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

    The pressure is that of a round elastic contact by Hertz.  What would lie beyond the tactels is
    carried by the others.  Shear is spread as pressure is; a twist pulls across the radius, in
    proportion to pressure and radius.
    """
    forces, squares = np.zeros((tactels.total, 3)), Squares.of(tactels)
    ends = np.array([squares.x[-1], squares.y[-1]])
    for contact in contacts:
        nodes = disc(squares, (contact.x, contact.y), contact.radius)
        inside = (np.abs(nodes.places) <= ends).all(axis=1)
        if not inside.any():
            continue
        places, shares = nodes.places[inside], nodes.shares[inside] / nodes.shares[inside].sum()
        x, y = (places - [contact.x, contact.y]).T
        pull = contact.twist / max(shares @ (x**2 + y**2), 1e-30)
        along, across = contact.shear_x - pull * y, contact.shear_y + pull * x
        small = np.stack([np.full(len(shares), contact.normal), along, across], axis=1)
        squares.add(forces, places, shares[:, None] * small)
    return forces


def groups(tactels: PadTactels, contacts: Sequence[Contact]) -> Mask:
    """Which tactels belong to which contact, shape (k, n): near it, and nearer than to others."""
    if not contacts:
        return np.zeros((0, tactels.total), dtype=bool)
    centres = np.array([[contact.x, contact.y] for contact in contacts])
    reach = np.array([contact.radius for contact in contacts]) + MARGIN * tactels.pitch
    apart = np.linalg.norm(tactels.places - centres[:, None], axis=2)
    nearest = (apart - reach[:, None]).argmin(axis=0)
    return (apart <= reach[:, None]) & (nearest == np.arange(len(contacts))[:, None])
