"""Fingertips on a pad: a round patch pressed as Hertz found, and the forces of the tactels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.contacts.nodes import Squares, disc
from fringeforce.design.pad import PadTactels
from fringeforce.explorer.pads.protocol import Finger

MARGIN = 1.5
"""Pitches around a finger in which its reading may be found."""


SHOWN = [0, 1, 2, 5, 6, 7]
"""What the page shows of a resultant: N, T_x, T_y, the moment about the normal, the centre."""


def tactel_forces(tactels: PadTactels, fingers: Sequence[Finger]) -> Array:
    """Forces that fingers put on tactels, shape (n, 3): N, T_x, T_y [N].

    The pressure is that of a round elastic contact by Hertz.  What would lie beyond the tactels is
    carried by the others.  Shear is spread as pressure is; a twist pulls across the radius, in
    proportion to pressure and radius.
    """
    forces, squares = np.zeros((tactels.total, 3)), Squares.of(tactels)
    ends = np.array([squares.x[-1], squares.y[-1]])
    for finger in fingers:
        nodes = disc(squares, (finger.x, finger.y), finger.radius)
        inside = (np.abs(nodes.places) <= ends).all(axis=1)
        if not inside.any():
            continue
        places, shares = nodes.places[inside], nodes.shares[inside] / nodes.shares[inside].sum()
        x, y = (places - [finger.x, finger.y]).T
        pull = finger.twist / max(shares @ (x**2 + y**2), 1e-30)
        along, across = finger.shear_x - pull * y, finger.shear_y + pull * x
        small = np.stack([np.full(len(shares), finger.normal), along, across], axis=1)
        squares.add(forces, places, shares[:, None] * small)
    return forces


def groups(tactels: PadTactels, fingers: Sequence[Finger]) -> Mask:
    """Which tactels belong to which finger, shape (k, n): near it, and nearer than to others."""
    if not fingers:
        return np.zeros((0, tactels.total), dtype=bool)
    centres = np.array([[finger.x, finger.y] for finger in fingers])
    reach = np.array([finger.radius for finger in fingers]) + MARGIN * tactels.pitch
    apart = np.linalg.norm(tactels.places - centres[:, None], axis=2)
    nearest = (apart - reach[:, None]).argmin(axis=0)
    return (apart <= reach[:, None]) & (nearest == np.arange(len(fingers))[:, None])
