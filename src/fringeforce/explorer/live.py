"""A running sensor for pages: the camera is read at its own pace, and each page sees the latest.

A page asks for what is new and is answered at most thirty times a second, so that nothing piles up
before a slow one, and the camera never waits for any.
"""

from __future__ import annotations

import asyncio
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.acquisition.cameras.camera import Camera
from fringeforce.acquisition.loop import live
from fringeforce.acquisition.run_statistics import Statistics
from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.base.errors import FringeforceError
from fringeforce.reading.reader import Reader
from fringeforce.reading.reading import Reading, Status

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


@dataclass(frozen=True, eq=False)
class Glimpse:
    """The last frame of a block, as it was read.

    Attributes
    ----------
    number : int
        Running number of the frame.
    time : float
        Since the first frame of the run [s].
    frame : ndarray
        What a page shows of it; of several pictures the first.
    reading : Reading
        With a covariance that has the deviations which the reader gave.
    """

    number: int
    time: float
    frame: Array
    reading: Reading


class Latest(Sink):
    """The newest readings of a run; each block replaces the one before.

    Parameters
    ----------
    frame : callable
        From grey levels to what a page shows of them.
    covariance : callable
        From forces, deviations (n, components) and status to a covariance with those deviations.
    phase : callable
        From forces to their phase lead.
    """

    name = "page"

    def __init__(
        self,
        frame: Callable[[Array], Array],
        covariance: Callable[[Array, Array, Status], Array],
        phase: Callable[[Array], Array],
    ) -> None:
        self._frame, self._covariance, self._phase = frame, covariance, phase
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
            elapsed = float(readings.timestamps[-1]) - self._start
            forces, std, status = readings.forces[-1], readings.std[-1], readings.status[-1]
            reading = Reading.of(
                forces=forces,
                chi2=float(readings.chi2[-1]),
                status=status,
                covariance=self._covariance(forces, std, status),
                phase=partial(self._phase, forces),
            )
            number = readings.first + len(readings) - 1
            self._glimpse = (
                readings,
                Glimpse(number, elapsed, self._frame(readings.lines[-1]), reading),
            )
        return self._glimpse[1]


class Live(ABC):
    """One camera, read in a thread of its own while pages ask.

    A camera that no page asks for rests until one does; a recording is played to its end.

    Parameters
    ----------
    model : SensorModel or PadModel
        The sensor that the camera looks at.
    source : Source
        The camera.
    """

    queue: int | None = None
    """Blocks that wait for the reader, if not as many as for every other reading."""

    def __init__(self, model: Any, source: Source) -> None:
        self.model, self.source = model, source
        self.run = 0
        """Counts how often the camera was started."""
        self.name = self.ended = ""
        self.latest = self._latest()
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
        self.latest, self.statistics, self.ended = self._latest(), None, ""
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._read, name="live", daemon=True)
        self._thread.start()

    @abstractmethod
    def watcher(self) -> Watcher:
        """What one page sees of it."""

    @abstractmethod
    def _latest(self) -> Latest:
        """Room for the newest readings."""

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
            live(reader, camera, sinks, stop=self._stop, report=self._told, queue=self.queue)
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


class Watcher(ABC):
    """What one page sees of a camera.

    Parameters
    ----------
    source : Live
        The camera.
    """

    def __init__(self, source: Live) -> None:
        self._live = source
        self._run = 0
        self._seen: Any = None
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
            self._begin()
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
        reading = glimpse.reading
        header |= {
            "time": glimpse.time,
            "line": glimpse.number,
            "status": reading.status.name,
            "advice": reading.advice,
            "chi2": reading.chi2 if np.isfinite(reading.chi2) else None,
        }
        facts, blocks = self._shown(glimpse, friction)
        return header | facts, {"forces": reading.forces, "std": reading.std, **blocks}

    @abstractmethod
    def _begin(self) -> None:
        """Forget what was seen of an earlier run."""

    @abstractmethod
    def _shown(self, glimpse: Glimpse, friction: float) -> tuple[dict[str, Any], dict[str, Array]]:
        """Facts and arrays that the page shows beside those of every sensor."""


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
