"""A running strip for pages: its last line, phases, and contacts that slip."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.contacts.contact import Contact, Friction
from fringeforce.estimation.bounds import covariance
from fringeforce.explorer.live import Follower, Glimpse
from fringeforce.models.strip import SensorModel
from fringeforce.reading.reader import Reader
from fringeforce.reading.reading import Status

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class LineEstimate:
    """Forces of a line that a running reader read, with a covariance for contacts.

    Attributes
    ----------
    forces, std : ndarray, shape (n, 2)
        Forces and their standard deviations [N].
    covariance : ndarray, shape (2n, 2n)
        The same deviations, correlated as the sensor's optics correlate them [N^2].
    status : Status
        The verdict.
    """

    forces: Array
    std: Array
    covariance: Array
    status: Status

    @property
    def ok(self) -> bool:
        """Whether one load explains the line."""
        return self.status is Status.OK

    @property
    def trusted(self) -> bool:
        """Whether the forces may be used: they explain the line, or nothing touches."""
        return self.status in (Status.OK, Status.NO_CONTACT)


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
        self.model = model

    def reader(self) -> Reader:
        """What reads the camera's lines."""
        return Reader(self.model)

    def glimpse(self, readings: Readings) -> Glimpse:
        """The last line, its phase, and what contacts are followed by."""
        forces, std, status = readings.forces[-1], readings.std[-1], readings.status[-1]
        matrix = self.model.pixel_influence.reshape(-1, forces.size)
        blocks = {"frame": np.atleast_2d(readings.lines[-1])[0], "phase": matrix @ forces.ravel()}
        estimate = LineEstimate(forces, std, self._covariance(forces, std, status), status)
        return Glimpse({}, blocks, estimate)

    def follower(self) -> Follower:
        """Contacts that a page follows with its own friction."""
        contact = Contact.none(self.model.sensor.tactels.count)

        def follow(glimpse: Glimpse, friction: float) -> Mapping[str, Any]:
            nonlocal contact
            assert glimpse.estimate is not None
            before = Contact(contact.touching, contact.slipping, Friction(friction, 0.0))
            contact, events = before.follow(glimpse.estimate)
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
        psi = self.model.frame_influence
        bound = covariance(psi @ forces.ravel(), psi, self.model.response)
        own = np.sqrt(np.diag(bound))
        return bound / np.outer(own, own) * np.outer(spread, spread)
