"""What a live run counts: nothing is lost that is not counted."""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.base.words import counted

EDGES = np.geomspace(1e-5, 1e3, 379)
"""Edges of bins of 5 %, into which latencies fall so that a run of any length fits [s]."""
PERCENTILES = (50, 95, 99)
WINDOW = 2.0
"""Time over which the rate is a mean [s]."""


@dataclass(frozen=True)
class Delivery:
    """How one sink does.

    Attributes
    ----------
    name : str
        Name of the sink.
    written, dropped : int
        Lines it took, and lines it was too slow for or got after it stopped.
    trouble : str
        Why it stopped; empty while it works.
    remark : str
        What it says itself.
    """

    name: str
    written: int
    dropped: int
    trouble: str
    remark: str


@dataclass(frozen=True)
class Statistics:
    """A live run so far; lines are the images of a pad.

    Attributes
    ----------
    seconds : float
        Since the start.
    rate : float
        Lines read per second, over the last two seconds.
    latency : mapping
        Percentiles 50, 95, 99 of the time from a line's exposure to its reading, of the whole
        run, to 5 % [s]; empty before the first reading.
    lines : int
        Lines read.
    dropped_camera, dropped_queue : int
        Lines that the camera lost, and lines that came faster than they were read.
    statuses : mapping
        Lines by the name of their status.
    reconnects : int
        How often the camera came back.
    camera_trouble : str
        Why there is no camera at the moment; empty while there is one.
    deliveries : tuple of Delivery
        The sinks.
    counted : str
        What the numbers are of: lines, or images of a pad.
    """

    seconds: float
    rate: float
    latency: Mapping[int, float]
    lines: int
    dropped_camera: int
    dropped_queue: int
    statuses: Mapping[str, int]
    reconnects: int
    camera_trouble: str
    deliveries: tuple[Delivery, ...] = ()
    counted: str = "lines"

    @property
    def troubles(self) -> tuple[str, ...]:
        """All that a person should know, in sentences."""
        frames, found = self.counted, []
        if self.dropped_camera:
            found.append(f"The camera lost {counted(self.dropped_camera, frames)}.")
        if self.dropped_queue:
            found.append(
                f"{counted(self.dropped_queue, frames)} came faster than they could be read and "
                f"{'was' if self.dropped_queue == 1 else 'were'} dropped."
            )
        if self.camera_trouble:
            found.append(f"{self.camera_trouble} Trying again.")
        for sink in self.deliveries:
            if sink.trouble:
                found.append(
                    f"{sink.name} stopped after {counted(sink.written, frames)}: {sink.trouble}"
                )
            elif sink.dropped:
                found.append(f"{sink.name} was too slow for {counted(sink.dropped, frames)}.")
        return tuple(found)


class RunStatistics:
    """Counts a run; one thread each for the camera's and the reader's numbers.

    Parameters
    ----------
    counted : str
        What is counted: lines, or images.
    """

    def __init__(self, counted: str = "lines") -> None:
        self._counted = counted
        self._lock = threading.Lock()
        self._started = time.monotonic()
        self._counts = Counter(lines=0, dropped_camera=0, dropped_queue=0, reconnects=0)
        self._statuses: Counter[str] = Counter()
        self._latencies = np.zeros(len(EDGES) + 1, dtype=np.int64)
        self._recent: deque[tuple[float, int]] = deque([(self._started, 0)])
        self._camera_trouble = ""

    def read(self, readings: Readings) -> None:
        """Count lines that were read just now."""
        now, moment = time.time(), time.monotonic()
        bins = np.searchsorted(EDGES, now - readings.timestamps)
        with self._lock:
            self._counts["lines"] += len(readings)
            self._statuses.update(status.name for status in readings.status)
            np.add.at(self._latencies, bins, 1)
            self._recent.append((moment, self._counts["lines"]))
            while moment - self._recent[0][0] > WINDOW and len(self._recent) > 2:
                self._recent.popleft()

    def dropped(self, camera: int = 0, queue: int = 0) -> None:
        """Count lines that were lost."""
        with self._lock:
            self._counts.update(dropped_camera=camera, dropped_queue=queue)

    def camera_lost(self, reason: str) -> None:
        """Note that there is no camera at the moment."""
        with self._lock:
            self._camera_trouble = reason

    def camera_back(self) -> None:
        """Note that the camera sends lines again."""
        with self._lock:
            self._counts["reconnects"] += 1
            self._camera_trouble = ""

    def statistics(self, deliveries: tuple[Delivery, ...] = ()) -> Statistics:
        """Everything so far, which does not change any more."""
        with self._lock:
            now = time.monotonic()
            (earlier, before), lines = self._recent[0], self._counts["lines"]
            return Statistics(
                seconds=now - self._started,
                rate=(lines - before) / max(now - earlier, 1e-9),
                latency=self._percentiles(),
                statuses=dict(self._statuses.most_common()),
                camera_trouble=self._camera_trouble,
                deliveries=deliveries,
                counted=self._counted,
                **self._counts,
            )

    def _percentiles(self) -> dict[int, float]:
        lines = self._counts["lines"]
        if not lines:
            return {}
        shares = np.cumsum(self._latencies) / lines
        places = [int(np.searchsorted(shares, q / 100)) for q in PERCENTILES]
        upper = np.append(EDGES, EDGES[-1])
        return {q: float(upper[place]) for q, place in zip(PERCENTILES, places, strict=True)}
