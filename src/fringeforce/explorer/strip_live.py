"""A running strip for pages: its last line, phases, and contacts that slip."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.contacts.contact import Contact, Friction
from fringeforce.explorer.live import ContactFollower, Glimpse
from fringeforce.models.strip import SensorModel
from fringeforce.reading.reading import Reading, Status
from fringeforce.reading.strip_reader import StripFrameReader

Array = NDArray[Any]


class StripDisplay:
    """What pages see of a strip.

    Parameters
    ----------
    model : SensorModel
        The sensor that is read.
    """

    # who watches wants the newest, not all
    queue = 8

    def __init__(self, model: SensorModel) -> None:
        self.model, self._reader = model, StripFrameReader(model)

    def glimpse(self, readings: Readings) -> Glimpse:
        """The last line, its phase, and what contacts are followed by."""
        forces, std, status = readings.forces[-1], readings.std[-1], readings.status[-1]
        matrix = self.model.pixel_influence.reshape(-1, forces.size)
        reading = Reading.of(
            forces=forces,
            chi2=float(readings.chi2[-1]),
            status=status,
            covariance=self._covariance(forces, std, status),
            phase=matrix @ forces.ravel(),
        )
        blocks = {"frame": np.atleast_2d(readings.lines[-1])[0], "phase": reading.phase}
        return Glimpse({}, blocks, reading)

    def follower(self) -> ContactFollower:
        """Contacts that a page follows with its own friction."""
        contact = Contact.none(self.model.sensor.tactels.count)

        def follow(glimpse: Glimpse, friction: float) -> Mapping[str, Any]:
            nonlocal contact
            assert glimpse.reading is not None
            before = Contact(contact.touching, contact.slipping, Friction(friction, 0.0))
            contact, events = before.follow(glimpse.reading)
            return {
                "touching": np.flatnonzero(contact.touching).tolist(),
                "slipping": np.flatnonzero(contact.slipping).tolist(),
                "events": [[event.kind.value, event.tactel] for event in events],
            }

        return follow

    def _covariance(self, forces: Array, std: Array, status: Status) -> Array:
        """Standard deviations that were read, correlated as the sensor's optics correlate them."""
        spread = std.ravel()
        if status is not Status.OK:
            return np.diag(spread**2)
        bound = self._reader.expected_covariance(forces)
        own = np.sqrt(np.diag(bound))
        return bound / np.outer(own, own) * np.outer(spread, spread)
