"""Whether loads strain the cover of a sensor further than linear theory holds."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.errors import LargeStrainWarning
from fringeforce.contacts.fingertip import LINEAR
from fringeforce.contacts.press import Press
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.models.presses import Presses, are_presses


def strain_words(sensor: Sensor | Pad, forces: ArrayLike | Presses) -> str:
    """What is wrong if loads strain the cover by more than 10 %, with limit and remedy, or nothing.

    The strain is the mean pressure over the modulus of the cover, of the force of a contact over
    one pitch of the tactels, or over the contact if that is wider; contacts of an indenter are as
    wide as it is.

    Parameters
    ----------
    sensor : Sensor or Pad
        The design.
    forces : array_like, shape (..., n, components), or sequence of Press
        As of `expose`.
    """
    block: Any = sensor.transducer
    if isinstance(sensor, Sensor) and (block.plane == "given" or block.strain == "finite"):
        return ""
    if are_presses(forces):
        pressed = [one for part in forces for one in _each(part)]
        normal = np.array([one.normal for one in pressed])
        areas = np.array([_area(sensor, one) for one in pressed])
    else:
        try:
            normal = np.asarray(forces)
        except ValueError:
            return ""  # who simulates them says what is wrong
        if normal.ndim < 2 or normal.dtype.kind not in "fiu":
            return ""
        normal = np.abs(normal[..., 0].reshape(-1, normal.shape[-2]))
        areas = np.full_like(normal, _pitch_area(sensor))
    if not normal.size or not np.isfinite(normal).all():
        return ""
    strains = normal / (areas * block.compliant.youngs_modulus)
    worst = np.unravel_index(strains.argmax(), strains.shape)
    strain, force = float(strains[worst]), float(normal[worst])
    if strain <= LINEAR:
        return ""
    where = "in a contact" if normal.ndim == 1 else f"on tactel {worst[1] + 1}"
    limit = f"{1e2 * LINEAR:g} %, or {LINEAR / strain * force:.3g} N there"
    finite = 'set strain = "finite" under [transducer], or ' if isinstance(sensor, Sensor) else ""
    return (
        f"{force:.4g} N {where} strains the cover by about {1e2 * strain:.3g} %, and the model "
        f"takes small strain, which holds up to {limit}; {finite}press less."
    )


def warn_of_strain(sensor: Sensor | Pad, forces: ArrayLike | Presses) -> None:
    """Warn whoever calls `expose` of what `strain_words` says, once for each place of a program."""
    if words := strain_words(sensor, forces):
        warnings.warn(words, LargeStrainWarning, stacklevel=3)


def _each(part: Press | Sequence[Press]) -> Sequence[Press]:
    return [part] if isinstance(part, Press) else part


def _area(sensor: Any, press: Press) -> float:
    """Over which a contact spreads its force [m2]."""
    width: Any = 2 * press.radius if press.radius is not None else press.width or 0.0
    if sensor.dimensions == 1:
        own = float(np.min(width)) * sensor.transducer.width
    else:
        sides = np.broadcast_to(width, 2)
        own = float(np.prod(sides)) * (1.0 if press.outline == "rectangle" else np.pi / 4)
    return max(own, _pitch_area(sensor))


def _pitch_area(sensor: Any) -> float:
    across = sensor.tactels.pitch if sensor.dimensions > 1 else sensor.transducer.width
    return sensor.tactels.pitch * across
