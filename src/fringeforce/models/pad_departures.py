"""What a pad may do that its design does not state: departures, each a generous tolerance."""

from __future__ import annotations

from dataclasses import dataclass, replace

from fringeforce.design.tolerances import Tolerances, number_at
from fringeforce.models.as_built import PLACEMENT, RESIDUAL, SIZE
from fringeforce.models.departures import (
    BLUR,
    CAMERA_SCALE,
    CAMERA_SHIFT,
    DARK,
    LAMP,
    LAYERS,
    RETARDANCE,
    SCATTER,
    VISIBILITY,
)
from fringeforce.models.pad import PadModel

TRACTION_WIDTHS = 0.15
"""Standard deviation of the widths of tractions, over the side of a square."""
POINT_SPREAD = BLUR / 3
"""The same of blur [pixels]."""
MANY = RESIDUAL, PLACEMENT, SIZE
"""Departures of many numbers."""


@dataclass(frozen=True)
class PadDeparture:
    """One way in which a pad may depart from its design.

    Attributes
    ----------
    path : str
        Dotted path of the value that departs.
    deviation : float
        Standard deviation before any frame: relative for layers and the amplitude, else in the
        unit of the value.
    unit : float
        What it is relative to; one if it is not.
    begin : float
        Where it is looked for first, in standard deviations.
    """

    path: str
    deviation: float
    unit: float = 1.0
    begin: float = 0.0

    @property
    def one(self) -> bool:
        """Whether one number departs."""
        return self.path not in MANY

    def std(self, stated: float) -> float:
        """Standard deviation in the unit of the value, beyond what a design states."""
        return max(self.deviation * self.unit, 3 * stated)


def pad_departures(model: PadModel) -> tuple[PadDeparture, ...]:
    """All departures that can be told of a pad."""
    pad = model.sensor
    x, _ = pad.pixel_positions
    pitch, camera = pad.tactels.pitch, pad.camera
    layers = []
    for path, share in LAYERS.items():
        found = number_at(pad, path)
        assert found is not None
        layers.append(PadDeparture(path, share, found[0]))
    return (
        PadDeparture("camera.shift_x", CAMERA_SHIFT * pitch),
        PadDeparture("camera.shift_y", CAMERA_SHIFT * pitch),
        PadDeparture("camera.scale", CAMERA_SCALE),
        PadDeparture("camera.blur", POINT_SPREAD * float(x[1] - x[0]), begin=0.5),
        PadDeparture("camera.amplitude", LAMP, camera.amplitude),
        PadDeparture("camera.offset", DARK * camera.full_scale),
        PadDeparture("polariscope.visibility", VISIBILITY),
        PadDeparture(RESIDUAL, RETARDANCE),
        PadDeparture(PLACEMENT, SCATTER * pitch),
        PadDeparture(SIZE, TRACTION_WIDTHS * pad.tactels.side),
        *layers,
    )


def departing(model: PadModel, departures: tuple[PadDeparture, ...]) -> PadModel:
    """A model whose design allows for departures besides what it states."""
    stated = dict(model.sensor.tolerances)
    wide = {one.path: one.std(stated.get(one.path, 0.0)) for one in departures}
    sensor = model.sensor.model_copy(update={"tolerances": Tolerances({**stated, **wide})})
    return replace(model, sensor=sensor)
