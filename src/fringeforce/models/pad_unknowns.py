"""Values of a pad that may be uncertain, and where their unknowns stand among all."""

from __future__ import annotations

from dataclasses import dataclass

from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import number_at
from fringeforce.models.as_built import PLACEMENT, RESIDUAL, SIZE
from fringeforce.models.design_modes import DRIFTS

LIGHT = "camera.amplitude", "camera.offset"
REGISTRATION = "camera.shift_x", "camera.shift_y", "camera.scale"
BLUR, GAMMA, UNEVEN = "camera.blur", "camera.gamma", "camera.unevenness"
FIELDS = RESIDUAL, UNEVEN
"""Values that are smooth fields, of many unknowns each."""
EFFECTS = (
    "transducer.photoelastic.strain_optic_coefficient",
    "transducer.photoelastic.stress_optic_coefficient",
)
SCALING = *EFFECTS, "polariscope.wavelength"
"""Values that only scale the influence: with the effect, and with the inverse of the wavelength."""
LAYERS = "transducer.compliant.", "transducer.photoelastic."
PITCH = "tactels.pitch"
STD_STEP = 0.1
"""Step of numerical derivatives of lens and pitch, in standard deviations."""


@dataclass(frozen=True, eq=False)
class Group:
    """Unknowns of one kind.

    Attributes
    ----------
    path : str
        Dotted path of the design.
    begin, end : int
        Where they stand among the unknowns.
    std : float
        Standard deviation in the unit of the value.
    """

    path: str
    begin: int
    end: int
    std: float

    @property
    def place(self) -> slice:
        """Where they stand."""
        return slice(self.begin, self.end)


def group_at(groups: tuple[Group, ...], path: str) -> Group | None:
    """The unknowns of a value, if it has some."""
    return next((group for group in groups if group.path == path), None)


def refusal(pad: Pad, path: str) -> str:
    """Why readings of a pad do not allow for a tolerance; empty if they do."""
    own_waves = any(channel.wavelength for channel in pad.polariscope.pictures)
    if path == "polariscope.wavelength" and own_waves:
        effect = f"transducer.photoelastic.{pad.transducer.photoelastic.effect}"
        return (
            "polariscope.wavelength has a tolerance beside channels of their own wavelengths; give "
            f"{effect} one instead, which acts on all."
        )
    known = (*LIGHT, *REGISTRATION, *SCALING, BLUR, GAMMA, *FIELDS, DRIFTS[0])
    if pad.skin is None:
        known = (*known, PLACEMENT, SIZE, PITCH)
    if path in known or path.startswith(LAYERS) or is_form(path):
        return ""
    return (
        f"{path} has a tolerance that readings of pads do not allow for; leave it out to read, or "
        "calibrate. as_built draws it."
    )


def is_form(path: str) -> bool:
    """Whether a value changes what pixels measure of the light: visibility, plates, angles."""
    return path == "polariscope.visibility" or (
        path.startswith(("polariscope.plates.", "polariscope.channels."))
        and not path.endswith(".wavelength")
    )


def value_of(pad: Pad, path: str) -> float:
    """The number that a design states at a path."""
    found = number_at(pad, path)
    assert found is not None
    return found[0]
