"""The light of what really touches a strip: presses anywhere, under tractions of their own."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, TypeGuard

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.contacts.cylinder import Compliance, cylinder_forces
from fringeforce.contacts.press import Press, Tractions
from fringeforce.design.light import Camera
from fringeforce.design.strip import Sensor, Transducer
from fringeforce.mechanics import fourier
from fringeforce.mechanics.surface_influence import SurfaceInfluence, surface_influence
from fringeforce.models.strip_width import light_line
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

Presses = Sequence[Press] | Sequence[Sequence[Press]]
"""What touches in one frame, or in several."""
SMALL_FORCES = 64
"""Small forces in half the width that a half-space of the cover would have under a cylinder; a
layer on a stiffer one gives way less."""
MARGIN = 1.4
"""How far beyond that the surface is looked at: shear and pressure together widen a contact."""
LADDER = 4
"""Widths of small forces in a factor of two."""
MOST_TERMS = 20000
"""Harmonics of the surface at most; small forces are so wide that these resolve them."""


def are_presses(loads: Any) -> TypeGuard[Sequence[Any]]:
    """Whether loads are presses, of one frame or of several, rather than forces of tactels.

    An empty list is nothing that presses.
    """
    while isinstance(loads, list | tuple):
        if not loads:
            return True
        loads = next((part for part in loads if not isinstance(part, list | tuple) or part), ())
    return isinstance(loads, Press)


def tractions(sensor: Sensor, press: Press) -> Tractions:
    """What a press does to the surface of a strip.

    Raises
    ------
    InputError
        If it reaches beyond the strip, is one on a pad, or presses with a cylinder in three
        dimensions.
    """
    transducer = sensor.transducer
    if press.y is not None:
        raise InputError(
            f"A press with y = {press.y * 1e3:g} mm is one on a pad; leave it out on a strip."
        )
    if press.radius is None:
        found = press.distributed()
    else:
        if transducer.plane == "3d":
            raise InputError(
                'A press with a radius needs plane = "stress" or "strain"; give its width instead.'
            )
        found = _under_cylinder(transducer, press, press.radius)
    low, high, half = found.places.min(), found.places.max(), transducer.length / 2
    if low < -half or high > half:
        raise InputError(
            f"A press at x = {press.x * 1e3:g} mm reaches from {low * 1e3:.4g} to "
            f"{high * 1e3:.4g} mm, beyond the strip, which ends at +-{half * 1e3:g} mm; places and "
            "sizes of a press are in metres."
        )
    return found


def _under_cylinder(transducer: Transducer, press: Press, radius: float) -> Tractions:
    cover = transducer.compliant
    line = press.normal / transducer.width
    modulus = cover.youngs_modulus
    if transducer.plane == "strain":
        modulus /= 1 - cover.poissons_ratio**2
    # Hertz, for a half-space of the cover: Johnson's equation (4.43)
    half = MARGIN * np.sqrt(4 * line * radius / (np.pi * modulus))
    # steps of a ladder, whose compliances are known after a while
    finest = 2 ** (1 / LADDER) * 2 * transducer.length / MOST_TERMS
    rung = np.floor(LADDER * np.log2(max(half / SMALL_FORCES, finest) / cover.thickness))
    step = cover.thickness * float(2 ** (rung / LADDER))
    stated = transducer.model_dump_json()
    forces = _cylinder_forces(stated, step, radius, press.normal, press.shear[0], press.friction)
    places = press.x + np.arange(-(len(forces) // 2), len(forces) // 2 + 1, dtype=np.float64) * step
    kept = forces[:, 0] > 0
    return Tractions(places[kept], forces[kept])


@lru_cache(maxsize=64)  # whoever draws or scores a press asks for it beside the light
def _cylinder_forces(
    stated: str, step: float, radius: float, normal: float, shear: float, friction: float
) -> Array:
    return cylinder_forces(_compliance(stated, step), radius, normal, shear, friction)


@lru_cache(maxsize=64)
def _compliance(stated: str, step: float) -> Compliance:
    transducer = Transducer.model_validate_json(stated)
    terms = int(np.ceil(2 * transducer.length / step))
    count = int(np.ceil(2 ** (1 / LADDER) * SMALL_FORCES)) + 4
    return Compliance(step, *fourier.surface_displacement(transducer, step, 2 * count, terms))


def press_phase(sensor: Sensor, x: Array, presses: Sequence[Any]) -> Array:
    """Phase lead under presses, shape (..., m) [rad].

    Parameters
    ----------
    sensor : Sensor
        The strip.
    x : ndarray, shape (m,)
        Positions along it [m].
    presses : sequence of Press, or of such sequences
        What touches, in one frame or in several.
    """
    if len(presses) and not isinstance(presses[0], Press):
        return np.array([press_phase(sensor, x, one) for one in presses])
    found = [tractions(sensor, press) for press in presses]
    if not found:
        return np.zeros(len(x))
    places = np.concatenate([part.places for part in found])
    forces = np.concatenate([part.forces for part in found])
    transducer = sensor.transducer
    constant = stress_optic_constant(transducer.photoelastic, sensor.polariscope.wavelength)
    if transducer.edges == "roller" and transducer.solved_in_a_plane:
        lead = fourier.stress_under_forces(transducer, places, forces, x)
    else:
        camera = sensor.camera.model_dump_json()
        surface = _surface(transducer.model_dump_json(), camera, x.tobytes())
        lines = surface.shares(places, np.zeros(len(places))).T @ forces
        lead = surface.stress.reshape(len(x), -1) @ lines.ravel()
    inside = np.abs(x) <= transducer.length / 2
    return phase_lead(lead, constant) * inside


@lru_cache(maxsize=4)
def _surface(stated: str, camera: str, x: bytes) -> SurfaceInfluence:
    """Line loads all over a strip, solved once."""
    transducer = Transducer.model_validate_json(stated)
    half = transducer.length / 2
    where = np.clip(np.frombuffer(x), -half, half)
    line = light_line(transducer, Camera.model_validate_json(camera))
    return surface_influence(transducer, -half, half, where, line)
