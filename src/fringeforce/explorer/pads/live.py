"""A running pad for pages: its last image, the forces of its tactels, and their sum."""

from __future__ import annotations

import numpy as np

from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.contacts.resultant import resultant
from fringeforce.explorer.live import ContactFollower, Glimpse
from fringeforce.explorer.pads.fingers import SHOWN
from fringeforce.explorer.pads.pictures import camera_picture, polarised_picture
from fringeforce.models.pad import PadModel


class PadDisplay:
    """What pages see of a pad.

    Parameters
    ----------
    model : PadModel
        The sensor that is read.
    """

    queue = None

    def __init__(self, model: PadModel) -> None:
        self.model = model

    def glimpse(self, readings: Readings) -> Glimpse:
        """The last image, and what all forces amount to."""
        tactels = self.model.sensor.tactels
        sums = resultant(tactels.places, readings.forces[-1], np.arange(tactels.total))
        if self.model.sensor.camera.kind == "polarisation":
            image = polarised_picture(self.model, readings.lines[-1])
        else:
            image = camera_picture(self.model, "camera-0", readings.lines[-1])
        return Glimpse({"shape": image.shape}, {"image": image, "sums": sums.values[SHOWN]})

    def follower(self) -> ContactFollower:
        """Nothing is remembered from one image to the next."""
        return lambda glimpse, friction: {}
