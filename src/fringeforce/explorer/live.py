"""A running sensor for pages: the camera is read at its own pace, and each page sees the latest.

A page asks for what is new and is answered at most thirty times a second, so that nothing piles up
before a slow one, and the camera never waits for any.
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.acquisition.live import live
from fringeforce.acquisition.tally import Statistics
from fringeforce.cameras.camera import Camera
from fringeforce.errors import FringeforceError
from fringeforce.force.bounds import covariance
from fringeforce.model import SensorModel
from fringeforce.reading.contact import Contact, Event, Friction
from fringeforce.reading.reader import Reader
from fringeforce.reading.reading import Reading, Status
from fringeforce.reading.single_frame import SingleFrameReader
from fringeforce.sinks.sink import Readings, Sink

Array = NDArray[Any]
PERIOD = 1 / 30
"""Least time between two pictures of a page [s]."""
POLL = 0.004
QUEUE = 8
"""Blocks that wait for the reader: who watches wants the newest, not all."""
PATIENCE = 1.0
"""After which a page hears that nothing is new [s]."""
REST = 5.0
"""Without a question of any page a camera is let go after this time [s]."""


@dataclass(frozen=True)
class Source:
    """A camera by name, opened anew for every run.

    Attributes
    ----------
    open : callable
        From the model of the sensor to a camera that is not yet connected.
    recorded : bool
        Whether it is a recording, all of which a page keeps while it is played.
    """

    open: Callable[[SensorModel], Camera]
    recorded: bool = False


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
    std : ndarray, shape (2, n)
        Standard deviations that the reader gave [N].
    reading : Reading
        With a covariance that has those deviations.
    """

    line: int
    time: float
    frame: Array
    std: Array
    reading: Reading


class Latest(Sink):
    """The newest readings of a run; each block replaces the one before.

    Parameters
    ----------
    model : SensorModel
        The sensor that is read.
    """

    name = "page"

    def __init__(self, model: SensorModel) -> None:
        self._model, self._reader = model, SingleFrameReader(model)
        self._readings: Readings | None = None
        self._glimpse: tuple[Readings, Glimpse] | None = None
        self._start: float | None = None

    def write(self, readings: Readings) -> None:
        """Take a block."""
        if self._start is None:
            self._start = float(readings.timestamps[0])
        self._readings = readings

    def close(self) -> None:
        """Nothing to finish: the last readings stay."""

    def glimpse(self) -> Glimpse | None:
        """What to show of the newest block; worked out once for all pages."""
        readings = self._readings
        if readings is None or self._start is None:
            return None
        if self._glimpse is None or self._glimpse[0] is not readings:
            elapsed = float(readings.timestamps[-1]) - self._start
            self._glimpse = readings, self._seen(readings, elapsed)
        return self._glimpse[1]

    def _seen(self, readings: Readings, elapsed: float) -> Glimpse:
        forces, std, status = readings.forces[-1], readings.std[-1], readings.status[-1]
        matrix = self._model.pixel_influence.reshape(-1, forces.size)
        reading = Reading(
            forces=forces,
            covariance=self._covariance(forces, std, status),
            phase=matrix @ forces.ravel(),
            chi2=float(readings.chi2[-1]),
            status=status,
            detail="",
            alternatives=np.empty((0, *forces.shape)),
            limited=np.zeros(forces.shape[1], dtype=bool),
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


class Live:
    """One camera, read in a thread of its own while pages ask.

    A camera that no page asks for rests until one does; a recording is played to its end.

    Parameters
    ----------
    model : SensorModel
        The sensor that the camera looks at.
    source : Source
        The camera.
    """

    def __init__(self, model: SensorModel, source: Source) -> None:
        self.model, self.source = model, source
        self.run = 0
        """Counts how often the camera was started."""
        self.name = self.ended = ""
        self.latest = Latest(model)
        self.statistics: Statistics | None = None
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._asked = 0.0

    def start(self, again: bool = False) -> None:
        """Begin to read, after a rest anew; once it has ended, again if asked."""
        self._asked = time.monotonic()
        resting = self._thread is None or not (self._thread.is_alive() or self.ended)
        if not (resting or (again and self.ended)):
            return
        self.run += 1
        self.latest, self.statistics, self.ended = Latest(self.model), None, ""
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._read, name="live", daemon=True)
        self._thread.start()

    def watcher(self) -> Watcher:
        """What one page sees of it."""
        return Watcher(self)

    def close(self) -> None:
        """End the camera."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(10)

    def _read(self) -> None:
        try:
            camera = self.source.open(self.model)
            self.name = camera.name
            reader, sinks = Reader(self.model), [self.latest]
            live(reader, camera, sinks, stop=self._stop, report=self._told, queue=QUEUE)
            if self._stop.is_set():
                return
        except FringeforceError as error:
            self.ended = str(error)
        except Exception as error:  # whatever a camera's library raises, the page must hear of it
            self.ended = f"The camera stopped: {error or type(error).__name__}."
        else:
            what = "recording" if self.source.recorded else "camera"
            self.ended = f"The {what} has ended."

    def _told(self, statistics: Statistics, _: Readings | None) -> None:
        self.statistics = statistics
        if not self.source.recorded and time.monotonic() - self._asked > REST:
            self._stop.set()


class Watcher:
    """What one page sees of a camera, and the contacts it follows with its own friction.

    Parameters
    ----------
    source : Live
        The camera.
    """

    def __init__(self, source: Live) -> None:
        self._live = source
        self._contact = Contact.none(source.model.sensor.tactels.count)
        self._run = 0
        self._seen: Glimpse | None = None
        self._told = 0.0

    async def next(
        self, friction: float, again: bool
    ) -> tuple[Mapping[str, Any], Mapping[str, Array]]:
        """Header and blocks of the next message; without blocks if nothing is new for a second.

        Parameters
        ----------
        friction : float
            Coefficient of friction that the page assumes.
        again : bool
            Start once more what has ended.
        """
        source = self._live
        source.start(again)
        if self._run != source.run:
            self._run, self._seen = source.run, None
            self._contact = Contact.none(len(self._contact.touching))
        await asyncio.sleep(max(self._told + PERIOD - time.monotonic(), 0))
        patience = time.monotonic() + PATIENCE
        # taken before the glimpse: what was read last is shown before the end is told
        while True:
            ended, glimpse = source.ended, source.latest.glimpse()
            new = glimpse is not None and glimpse is not self._seen
            if new or ended or time.monotonic() > patience:
                break
            await asyncio.sleep(POLL)
        self._told = time.monotonic()
        header = {"run": self._run, "camera": source.name, "recorded": source.source.recorded}
        header |= {"ended": ended, **_counts(source.statistics)}
        if not new or glimpse is None:
            return header, {}
        self._seen = glimpse
        return header | self._facts(glimpse, friction), {
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


def _counts(statistics: Statistics | None) -> dict[str, Any]:
    if statistics is None:
        return {"lines": 0, "dropped": 0, "rate": 0.0, "trouble": ""}
    return {
        "lines": statistics.lines,
        "dropped": statistics.dropped_camera + statistics.dropped_queue,
        "rate": statistics.rate,
        "trouble": statistics.camera_trouble,
    }
