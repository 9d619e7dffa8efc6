"""A running strip for pages: its last line, phases, and contacts that slip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.contacts.contact import Contact, Event, Friction
from fringeforce.estimation.bounds import covariance
from fringeforce.explorer.live import Latest, Live, Watcher
from fringeforce.models.strip import SensorModel
from fringeforce.reading.reading import Reading, Status
from fringeforce.reading.single_frame import SingleFrameReader

Array = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Glimpse:
    """The last line of a block, as it was read.

    Attributes
    ----------
    line : int
        Running number of the line.
    time : float
        Since the first line of the run [s].
    frame : ndarray, shape (P,)
        Grey levels; of a sensor with several pictures the first.
    std : ndarray, shape (n, 2)
        Standard deviations that the reader gave [N].
    reading : Reading
        With a covariance that has those deviations.
    """

    line: int
    time: float
    frame: Array
    std: Array
    reading: Reading


class StripLatest(Latest):
    """The newest readings of a strip.

    Parameters
    ----------
    model : SensorModel
        The sensor that is read.
    """

    def __init__(self, model: SensorModel) -> None:
        super().__init__()
        self._model, self._reader = model, SingleFrameReader(model)

    def _seen(self, readings: Readings, elapsed: float) -> Glimpse:
        forces, std, status = readings.forces[-1], readings.std[-1], readings.status[-1]
        matrix = self._model.pixel_influence.reshape(-1, forces.size)
        reading = Reading.of(
            forces=forces,
            covariance=self._covariance(forces, std, status),
            phase=matrix @ forces.ravel(),
            chi2=float(readings.chi2[-1]),
            status=status,
        )
        frame = np.atleast_2d(readings.lines[-1])[0]
        return Glimpse(readings.first + len(readings) - 1, elapsed, frame, std, reading)

    def _covariance(self, forces: Array, std: Array, status: Status) -> Array:
        """Deviations that were read, correlated as the sensor's optics correlate them."""
        spread = std.ravel()
        if status is not Status.OK:
            return np.diag(spread**2)
        psi = self._reader.influence
        bound = covariance(psi @ forces.ravel(), psi, self._model.response)
        own = np.sqrt(np.diag(bound))
        return bound / np.outer(own, own) * np.outer(spread, spread)


class StripLive(Live):
    """The camera of a strip."""

    # who watches wants the newest, not all
    queue = 8

    def watcher(self) -> StripWatcher:
        """What one page sees of it."""
        return StripWatcher(self)

    def _latest(self) -> StripLatest:
        return StripLatest(self.model)


class StripWatcher(Watcher):
    """What one page sees of a strip, and the contacts it follows with its own friction."""

    def __init__(self, source: StripLive) -> None:
        super().__init__(source)
        self._contact = Contact.none(source.model.sensor.tactels.count)

    def _begin(self) -> None:
        self._contact = Contact.none(len(self._contact.touching))

    def _shown(self, glimpse: Glimpse, friction: float) -> tuple[dict[str, Any], dict[str, Array]]:
        return self._facts(glimpse, friction), {
            "frame": glimpse.frame,
            "forces": glimpse.reading.forces,
            "std": glimpse.std,
            "phase": glimpse.reading.phase,
        }

    def _facts(self, glimpse: Glimpse, friction: float) -> dict[str, Any]:
        before = Contact(self._contact.touching, self._contact.slipping, Friction(friction, 0.0))
        self._contact, events = before.follow(glimpse.reading)
        reading = glimpse.reading
        return {
            "time": glimpse.time,
            "line": glimpse.line,
            "status": reading.status.name,
            "advice": reading.advice,
            "chi2": reading.chi2 if np.isfinite(reading.chi2) else None,
            "touching": np.flatnonzero(self._contact.touching).tolist(),
            "slipping": np.flatnonzero(self._contact.slipping).tolist(),
            "events": [_spelled(event) for event in events],
        }


def _spelled(event: Event) -> list[Any]:
    return [event.kind.value, event.tactel]
