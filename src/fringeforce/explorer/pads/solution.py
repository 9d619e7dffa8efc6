"""All that the page needs to know of a pad before anything touches it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import lru_cache
from typing import Any

import numpy as np

from fringeforce.design.pad import AreaCamera, Pad, PadPolariscope, PadTactels, PadTransducer
from fringeforce.explorer.figures import Figure
from fringeforce.explorer.limits import check_pad
from fringeforce.explorer.pads.fingers import tactel_forces
from fringeforce.explorer.pads.pictures import eye, views
from fringeforce.explorer.pads.protocol import Finger
from fringeforce.explorer.values import flat_values
from fringeforce.models.pad import PadModel, characterize_pad
from fringeforce.models.pad_influence import PadInfluence
from fringeforce.optics.colour import light_colour
from fringeforce.optics.photoelasticity import stress_optic_constant

WAVELENGTH, OPTIC = 632.8e-9, 0.05
"""Light and strain-optic coefficient at which designs are solved; retardance goes with both."""
FINGER = Finger(x=0.0, y=0.0, radius=4e-3, normal=10.0, shear_x=3.0)
"""By which designs are compared: 10 N with 3 N of shear, on a patch of 8 mm."""


def solved(pad: Pad, known: PadModel | None = None) -> PadModel:
    """The model of a pad; light and camera may change without solving again.

    Parameters
    ----------
    pad : Pad
        The design.
    known : PadModel, optional
        Model of the design, where there is one already.

    Raises
    ------
    InputError
        If the design cannot be explored.
    """
    check_pad(pad, solved=known is not None)
    if known is not None:
        return known
    layer = pad.transducer.photoelastic.model_copy(update={"strain_optic_coefficient": OPTIC})
    block = pad.transducer.model_copy(update={"photoelastic": layer})
    influence = _influence(block, pad.tactels)
    factor = np.float32(_constant(pad) / stress_optic_constant(layer, WAVELENGTH))
    if factor != 1:
        quarters = tuple(quarter * factor for quarter in influence.quarters)
        influence = replace(influence, quarters=quarters)
    return PadModel(pad, influence, {"method": "double Fourier series"})


def facts(model: PadModel) -> Mapping[str, Any]:
    """What the page is told, as JSON values."""
    pad = model.sensor
    block, camera = pad.transducer, pad.camera
    profile = model.influence.profile
    return {
        "name": pad.name,
        "values": flat_values(pad),
        "figures": [asdict(figure) for figure in figures(model)],
        "pad": {
            "length": block.length,
            "width": block.width,
            "layers": [block.compliant.thickness, block.photoelastic.thickness],
        },
        "tactels": {"count": list(pad.tactels.count), "pitch": pad.tactels.pitch},
        "views": [list(view) for view in views(pad)],
        "slices": len(profile),
        "skin": None if pad.skin is None else list(pad.skin.extent),
        "light": light_colour(pad.polariscope.wavelength).tolist(),
        "camera": {"pixels": list(camera.pixels), "full_scale": camera.full_scale},
    }


def blocks(model: PadModel) -> Mapping[str, Any]:
    """Numbers that the page is told before anything touches the pad: none."""
    return {}


def figures(model: PadModel) -> list[Figure]:
    """Figures of a pad under a fingertip, in the order of a designer's questions."""
    pad = model.sensor
    forces = tactel_forces(pad.tactels, [FINGER])
    seen = eye(model, 64)
    waves = np.linalg.norm(seen.retardance(forces), axis=0).max() / (2 * np.pi)
    lit = seen.intensity(forces)
    along = pad.camera.pixels[0] / pad.transducer.length
    common = [
        Figure(
            "order",
            "Fringe order of a fingertip",
            float(waves),
            "",
            "Largest retardance, in waves, under 10 N with 3 N of shear on a patch of 8 mm.",
        ),
        Figure(
            "light",
            "Brightest place",
            100 * float(lit.max()),
            "%",
            "Of the light that a dark field can let through, under the same fingertip.",
        ),
    ]
    if pad.skin is not None:
        return common
    return [
        *common,
        Figure(
            "tactels",
            "Tactels",
            pad.tactels.total,
            "",
            "Places where forces are read, three components each.",
        ),
        Figure(
            "pixels",
            "Pixels per tactel",
            along * pad.tactels.pitch,
            "",
            "Pixels of the camera from one tactel to the next.",
        ),
    ]


def _constant(pad: Pad) -> float:
    return stress_optic_constant(pad.transducer.photoelastic, pad.polariscope.wavelength)


@lru_cache(maxsize=2)
def _influence(block: PadTransducer, tactels: PadTactels) -> PadInfluence:
    camera = {"pixels": (2, 2), "bits": 8, "amplitude": 255.0, "offset": 0.0, "noise": 0.0}
    light = PadPolariscope(wavelength=WAVELENGTH)
    pad = Pad(
        name="any",
        transducer=block,
        tactels=tactels,
        polariscope=light,
        camera=AreaCamera(**camera),
    )
    return characterize_pad(pad).influence
