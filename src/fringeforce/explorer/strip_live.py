"""A running strip for pages: its last line, phases, and contacts that slip."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.contacts.contact import Contact, Event, Friction
from fringeforce.estimation.bounds import covariance
from fringeforce.explorer.live import Glimpse, Latest, Live, Watcher
from fringeforce.reading.reading import Status

Array = NDArray[Any]


class StripLive(Live):
    """The camera of a strip."""

    # who watches wants the newest, not all
    queue = 8

    def watcher(self) -> StripWatcher:
        """What one page sees of it."""
        return StripWatcher(self)

    def _latest(self) -> Latest:
        return Latest(lambda line: np.atleast_2d(line)[0], self._covariance, self._phase)

    def _phase(self, forces: Array) -> Array:
        return self.model.pixel_influence.reshape(-1, forces.size) @ forces.ravel()

    def _covariance(self, forces: Array, std: Array, status: Status) -> Array:
        """Deviations that were read, correlated as the sensor's optics correlate them."""
        spread = std.ravel()
        if status is not Status.OK:
            return np.diag(spread**2)
        psi = self.model.frame_influence
        bound = covariance(psi @ forces.ravel(), psi, self.model.response)
        own = np.sqrt(np.diag(bound))
        return bound / np.outer(own, own) * np.outer(spread, spread)


class StripWatcher(Watcher):
    """What one page sees of a strip, and the contacts it follows with its own friction."""

    def __init__(self, source: StripLive) -> None:
        super().__init__(source)
        self._contact = Contact.none(source.model.sensor.tactels.count)

    def _begin(self) -> None:
        self._contact = Contact.none(len(self._contact.touching))

    def _shown(self, glimpse: Glimpse, friction: float) -> tuple[dict[str, Any], dict[str, Array]]:
        before = Contact(self._contact.touching, self._contact.slipping, Friction(friction, 0.0))
        self._contact, events = before.follow(glimpse.reading)
        facts = {
            "touching": np.flatnonzero(self._contact.touching).tolist(),
            "slipping": np.flatnonzero(self._contact.slipping).tolist(),
            "events": [_spelled(event) for event in events],
        }
        return facts, {"frame": glimpse.frame, "phase": glimpse.reading.phase}


def _spelled(event: Event) -> list[Any]:
    return [event.kind.value, event.tactel]
