"""The light of a strip by small and by finite strain, side by side under the same loads."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.explorer.protocol import StrainRequest
from fringeforce.explorer.skins.protocol import SkinStrainRequest
from fringeforce.explorer.skins.tasks import pressed
from fringeforce.explorer.tasks import Answer, model_of

if TYPE_CHECKING:
    from fringeforce.models.finite_strain import SkinStrain
    from fringeforce.models.strip import SensorModel


def under_forces(path: str, wish: StrainRequest) -> Answer:
    """Phases under forces of tactels, and the deformed mesh of finite strain.

    Raises
    ------
    InputError
        If the model is calibrated, or the strip has no stable state under the forces.
    """
    from fringeforce.models.finite_strain import phase_of, strip_of_tactels

    model = _wide(path)
    strip = strip_of_tactels(model.sensor)
    moved = strip.solved(wish.forces)
    finite = phase_of(model.sensor, strip, model.pixel_positions, moved)
    facts, blocks = _compared(model, model.phase(wish.forces, strain="linear"), finite)
    order = strip.mesh.order
    mesh = {"mesh_x": strip.mesh.x, "mesh_z": strip.mesh.z, "moved": moved[:, ::order, ::order]}
    # under a line strain has no bound, so that a width had to be taken
    taken = 0.0 if _drawn(path).sensor.tactels.contact_width else model.sensor.tactels.contact_width
    return {**facts, "width": taken}, {**blocks, **mesh}


def under_fingers(path: str, wish: SkinStrainRequest) -> Answer:
    """Phases under fingers on a skin.

    What large strain adds is that of tractions as contact mechanics of small strain finds them,
    dead or following the surface, as the design says.

    Raises
    ------
    InputError
        As of `under_forces`.
    """
    from fringeforce.models.presses import tractions

    model, presses = _drawn(path), pressed(wish)
    linear = model.phase(presses, strain="linear")
    acting = [tractions(model.sensor, press) for press in presses]
    facts, blocks = _compared(model, linear, linear + _skin_strain(path).under(acting))
    return {**facts, "width": 0.0}, blocks


def _compared(model: SensorModel, linear: Array, finite: Array) -> Answer:
    """Largest difference of the phases [rad], its share of the peak, and that in the noise.

    The last is the largest difference of a grey level in standard deviations of its noise.
    """
    levels = [
        model.response.level(np.concatenate([ratio * phase for ratio in model.dispersions]))
        for phase in (linear, finite)
    ]
    largest, peak = np.abs(finite - linear).max(), np.abs(linear).max()
    sigma = np.sqrt(model.response.variance)
    facts = {
        "largest": float(largest),
        "share": float(largest / peak) if peak else 0.0,
        "deviations": float(np.max(np.abs(levels[1] - levels[0]) / sigma)),
    }
    return facts, {"linear": linear, "finite": finite}


def _drawn(path: str) -> SensorModel:
    model: SensorModel = model_of(path)
    if model.calibration is not None:
        raise InputError(
            "Large strain is shown of drawings; open the drawing of this sensor to see it."
        )
    return model


@lru_cache(maxsize=2)
def _wide(path: str) -> SensorModel:
    """The model, its contacts as wide as the cover is thick where they have no width."""
    from fringeforce.models.strip import characterize

    model = _drawn(path)
    tactels, cover = model.sensor.tactels, model.sensor.transducer.compliant
    if tactels.contact_width:
        return model
    width = min(cover.thickness, tactels.pitch)
    return characterize(model.sensor.replace(**{"tactels.contact_width": width}))


@lru_cache(maxsize=2)
def _skin_strain(path: str) -> SkinStrain:
    from fringeforce.models.finite_strain import SkinStrain

    model = _drawn(path)
    return SkinStrain(model.sensor, model.pixel_positions)
