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
from typing import Any, NamedTuple, Protocol

from numpy.typing import NDArray

from fringeforce.acquisition.cameras.camera import Camera
from fringeforce.acquisition.loop import live
from fringeforce.acquisition.run_statistics import Statistics
from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.base.errors import FringeforceError
from fringeforce.explorer.values import verdict
from fringeforce.reading.reader import Reader
from fringeforce.reading.reading import Reading

Array = NDArray[Any]
PERIOD = 1 / 30
"""Least time between two pictures of a page [s]."""
POLL = 0.004
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

    open: Callable[[Any], Camera]
    recorded: bool = False


class Glimpse(NamedTuple):
    """The last frame of a block, as pages see it.

    Attributes
    ----------
    facts : mapping
        JSON values.
    blocks : mapping of str to ndarray
        Numbers.
    reading : Reading, optional
        What contacts are followed by.
    """

    facts: Mapping[str, Any]
    blocks: Mapping[str, Array]
    reading: Reading | None = None


ContactFollower = Callable[[Glimpse, float], Mapping[str, Any]]
"""What one page remembers from frame to frame: from a frame and a coefficient of friction to facts
about contacts."""


class Display(Protocol):
    """What pages see of one kind of sensor."""

    @property
    def model(self) -> Any:
        """The sensor that is read."""
        ...

    @property
    def queue(self) -> int | None:
        """Blocks that wait for the reader, if not as many as for every other reading."""
        ...

    def glimpse(self, readings: Readings) -> Glimpse:
        """What is shown of the last frame besides its verdict, forces and their uncertainty."""
        ...

    def follower(self) -> ContactFollower:
        """What one page remembers of a run."""
        ...


class Latest(Sink):
    """The newest readings of a run; each block replaces the one before.

    Parameters
    ----------
    display : Display
        What is shown of them.
    """

    name = "page"

    def __init__(self, display: Display) -> None:
        self._display = display
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
        """What to show of the newest block, or None; worked out once for all pages."""
        readings = self._readings
        if readings is None or self._start is None:
            return None
        if self._glimpse is None or self._glimpse[0] is not readings:
            found, status = self._display.glimpse(readings), readings.status[-1]
            facts = {
                "time": float(readings.timestamps[-1]) - self._start,
                "line": readings.first + len(readings) - 1,
                **verdict(status, status.advice, readings.chi2[-1]),
                **found.facts,
            }
            blocks = {"forces": readings.forces[-1], "std": readings.std[-1], **found.blocks}
            self._glimpse = readings, Glimpse(facts, blocks, found.reading)
        return self._glimpse[1]


class Live:
    """One camera, read in a thread of its own while pages ask.

    A camera that no page asks for rests until one does; a recording is played to its end.

    Parameters
    ----------
    display : Display
        The sensor that the camera looks at, and what is shown of it.
    source : Source
        The camera.
    """

    def __init__(self, display: Display, source: Source) -> None:
        self.display, self.source = display, source
        self.run = 0
        """Counts how often the camera was started."""
        self.name = self.ended = ""
        self.latest = Latest(display)
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
        self.latest, self.statistics, self.ended = Latest(self.display), None, ""
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
            camera = self.source.open(self.display.model)
            self.name = camera.name
            queue, reader = self.display.queue, Reader(self.display.model)
            live(reader, camera, [self.latest], stop=self._stop, report=self._told, queue=queue)
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
    """What one page sees of a camera.

    Parameters
    ----------
    source : Live
        The camera.
    """

    def __init__(self, source: Live) -> None:
        self._live = source
        self._run = 0
        self._seen: Glimpse | None = None
        self._follower = source.display.follower()
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
            self._follower = source.display.follower()
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
        if glimpse is None or not new:
            return header, {}
        self._seen = glimpse
        return {**header, **glimpse.facts, **self._follower(glimpse, friction)}, glimpse.blocks


def _counts(statistics: Statistics | None) -> dict[str, Any]:
    if statistics is None:
        return {"lines": 0, "dropped": 0, "rate": 0.0, "trouble": ""}
    return {
        "lines": statistics.lines,
        "dropped": statistics.dropped_camera + statistics.dropped_queue,
        "rate": statistics.rate,
        "trouble": statistics.camera_trouble,
        "counted": statistics.counted,
    }
