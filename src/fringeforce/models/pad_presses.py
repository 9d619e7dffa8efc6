"""The light of what really touches a pad: presses anywhere, under tractions of their own."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.contacts.elastic_contact import Compliance, body_forces
from fringeforce.contacts.press import Press, Tractions
from fringeforce.design.pad import Pad, PadTransducer
from fringeforce.mechanics.solid.block import Patches
from fringeforce.mechanics.solid.surface import contact_modulus, patch_displacement
from fringeforce.models.pad_slices import block_of, block_of_transducer, slice_retardance
from fringeforce.models.presses import LADDER

SMALL_FORCES = 24
"""Small forces in the radius that a half-space of the cover would have under a sphere; layers on a
stiffer one give way less."""
SLICES: int = 24
"""Depths at which the light of presses is taken: twice as many change a frame of 8 bits by less
than a tenth of a grey level."""


def pad_tractions(pad: Pad, press: Press) -> Tractions:
    """What a press does to the surface of a pad.

    Raises
    ------
    InputError
        If it has no y, or reaches beyond the pad.
    """
    if press.y is None:
        raise InputError(f"A press at x = {press.x * 1e3:g} mm on a pad needs its y as well.")
    if press.radius is None:
        found = press.distributed_on_pad()
    else:
        found = _under_sphere(pad, press, press.radius)
    checked_on_pad(pad, found)
    return found


def checked_on_pad(pad: Pad, tractions: Tractions) -> None:
    """InputError if tractions reach beyond a pad."""
    half = np.array([pad.transducer.length, pad.transducer.width]) / 2
    low, high = tractions.places.min(axis=0), tractions.places.max(axis=0)
    for axis, a, b, end in zip("xy", low, high, half, strict=True):
        if a < -end or b > end:
            raise InputError(
                f"A press reaches from {a * 1e3:.3g} to {b * 1e3:.3g} mm along {axis}, beyond the "
                f"pad, which ends at +-{end * 1e3:g} mm."
            )


def _under_sphere(pad: Pad, press: Press, radius: float) -> Tractions:
    modulus = contact_modulus(block_of(pad))
    # Hertz, for a half-space of the cover: Johnson's equation (4.22)
    half = float(np.cbrt(3 * press.normal * radius / (4 * modulus)))
    cover = pad.transducer.compliant.thickness
    # steps of a ladder, whose compliances are known after a while
    step = cover * float(2 ** (np.floor(LADDER * np.log2(half / SMALL_FORCES / cover)) / LADDER))
    compliance = surface_of(pad, step, int(np.ceil(2 ** (1 / LADDER) * SMALL_FORCES)) + 3)
    x, y = grid_of(compliance)
    gap = (np.square(x) + np.square(y)) / (2 * radius)
    forces = body_forces(compliance, gap, press.normal, press.shear, press.friction)
    touched = forces[..., 0] > 0
    places = np.column_stack([press.x + x[touched], (press.y or 0.0) + y[touched]])
    return Tractions(places, forces[touched])


def grid_of(compliance: Compliance) -> tuple[Array, Array]:
    """Places x and y of the grid of a compliance, shape (n, n) each, from its middle [m]."""
    n = compliance.count
    steps = (np.arange(n, dtype=np.float64) - n // 2) * compliance.step
    x, y = np.meshgrid(steps, steps, indexing="ij")
    return np.asarray(x), np.asarray(y)


def surface_of(pad: Pad, step: float, half: int) -> Compliance:
    """Compliance of a pad's surface on a grid of 2 half + 1 places along either side."""
    return _surface(pad.transducer.model_dump_json(), step, half)


@lru_cache(maxsize=32)
def _surface(stated: str, step: float, half: int) -> Compliance:
    block = block_of_transducer(PadTransducer.model_validate_json(stated))
    return Compliance(step, patch_displacement(block, step, 2 * half))


def press_slices(
    pad: Pad, loads: Sequence[Press] | Sequence[Tractions], x: Array, y: Array
) -> Array:
    """Single-pass retardance of fine slices under presses, by the exact series.

    Parameters
    ----------
    pad : Pad
        The design.
    loads : sequence of Press or Tractions
        What touches.
    x, y : ndarray, shape (columns,), (rows,)
        Places [m].

    Returns
    -------
    ndarray, shape (slices, 2, rows, columns)
        (A, B) at the polariscope's wavelength [rad].

    Raises
    ------
    InputError
        If the sides of the pad are not rollers, or a press reaches beyond it.
    """
    if pad.transducer.sides != "roller":
        raise InputError(
            f'sides = "{pad.transducer.sides}": the light of presses is that of the exact series; '
            'take transducer.sides = "roller", or forces of tactels.'
        )
    parts = [pad_tractions(pad, load) if isinstance(load, Press) else load for load in loads]
    patches = [(Patches(part.places), part.forces) for part in parts]
    ends = np.array([pad.transducer.length, pad.transducer.width]) / 2
    where = [np.clip(places, -end, end) for places, end in zip((x, y), ends, strict=True)]
    return slice_retardance(pad, patches, where[0], where[1], SLICES)
