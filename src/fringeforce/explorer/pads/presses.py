"""Fingertips on the skin of a pad: rigid spheres, whose tractions contact mechanics finds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.contacts.nodes import Squares
from fringeforce.contacts.press import Press, Tractions
from fringeforce.contacts.resultant import Resultant, resultant_matrix
from fringeforce.design.pad import Pad
from fringeforce.explorer.pads.fingers import SHOWN
from fringeforce.explorer.pads.protocol import PressedRequest
from fringeforce.models.pad_presses import pad_tractions


def pressed(wish: PressedRequest) -> list[Press]:
    """Presses of the fingers that push at all; their radius is that of the sphere.

    Friction is at least what their shears need, which are rounded.

    Raises
    ------
    InputError
        If one twists.
    """
    if any(finger.twist for finger in wish.contacts):
        raise InputError("A twist is none of what touches a skin here; set it to 0.")
    return [
        Press(
            x=one.x,
            y=one.y,
            normal=one.normal,
            tangential=(one.shear_x, one.shear_y),
            radius=one.radius,
            friction=max(wish.friction, float(np.hypot(one.shear_x, one.shear_y)) / one.normal),
        )
        for one in wish.contacts
        if one.normal > 0
    ]


def acting(pad: Pad, wish: PressedRequest) -> list[Tractions]:
    """Tractions of the fingers, by contact mechanics on the layers.

    Raises
    ------
    InputError
        As of `pressed`, or if one reaches beyond the pad.
    """
    return [pad_tractions(pad, press) for press in pressed(wish)]


def forces_on_squares(pad: Pad, parts: Sequence[Tractions]) -> Array:
    """Forces on the squares in which those of a skin are stated, shape (n, 3) [N]."""
    forces = np.zeros((pad.tactels.total, 3))
    for part in parts:
        Squares.of(pad.tactels).add(forces, part.places, part.forces)
    return forces


def sums(parts: Sequence[Tractions], total: Resultant | None, read: Sequence[Resultant]) -> Array:
    """Of all together and of each contact: what is true, read and its deviations.

    Contacts stand beside the nearest fingers, if there are as many.

    Returns
    -------
    ndarray, shape (1 + k, 3, 6)
        N, T_x, T_y, moment about the normal and centre; not a number where nothing is known.
    """
    rows = np.full((1 + len(read), 3, len(SHOWN)), np.nan)
    for row, one in zip(rows, [total, *read], strict=True):
        if one is not None:
            row[1:] = one.values[SHOWN], one.std[SHOWN]
    if parts:
        rows[0, 0] = _true(*(np.concatenate(values) for values in zip(*parts, strict=True)))
    else:
        rows[0, 0] = 0.0
    if len(parts) == len(read):
        own = np.array([_true(*part) for part in parts]).reshape(-1, len(SHOWN))
        apart = np.linalg.norm(rows[1:, 1, None, -2:] - own[:, -2:], axis=2)
        numbers, fingers = linear_sum_assignment(apart)
        rows[1 + numbers, 0] = own[fingers]
    return rows


def _true(places: Array, forces: Array) -> Array:
    normal, *shear, about_x, about_y, spin = np.einsum(
        "rnc,nc->r", resultant_matrix(places), forces
    )
    return np.array([normal, *shear, spin, about_y / normal, -about_x / normal])
