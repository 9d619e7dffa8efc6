"""A sink's thread: whatever happens to a sink, reading goes on."""

from __future__ import annotations

import errno
import threading
import time
from collections import deque
from math import inf

from fringeforce.acquisition.consecutive import taken
from fringeforce.acquisition.run_statistics import Delivery
from fringeforce.acquisition.sinks.sink import Readings, Sink

FAREWELL = 10.0
"""Time that a sink has to finish [s]."""
FULL = {errno.ENOSPC: "The disk is full.", errno.EDQUOT: "The disk quota is used up."}


class SinkThread:
    """Readings to one sink through a bounded queue; the oldest go when it is full.

    What a sink gathers is written together: small pieces cost it more than their size.

    Parameters
    ----------
    sink : Sink
        Is closed at the end.
    depth : int
        Blocks in the queue, as long as the first; of longer ones there is room for fewer.
    patient : bool
        Let the reader wait instead of dropping, as is right where the camera waits too.
    """

    def __init__(self, sink: Sink, depth: int, patient: bool) -> None:
        self._sink, self._depth, self._patient = sink, depth, patient
        self._blocks: deque[Readings] = deque()
        self._change = threading.Condition()
        self._ending = False
        self._written = self._dropped = self._room = 0
        self._trouble = ""
        self._taken = 0.0
        self._thread = threading.Thread(target=self._run, name=sink.name, daemon=True)
        self._thread.start()

    def put(self, readings: Readings) -> None:
        """Hand over a block."""
        with self._change:
            self._room = self._room or self._depth * len(readings)
            if self._patient:
                self._change.wait_for(lambda: self._fits(readings) or self._trouble)
            if self._trouble:
                self._dropped += len(readings)
                return
            while not self._fits(readings):
                self._dropped += len(self._blocks.popleft())
            self._blocks.append(readings)
            self._change.notify_all()

    def _fits(self, readings: Readings) -> bool:
        return not self._blocks or self._waiting() + len(readings) <= self._room

    def _waiting(self) -> int:
        return sum(len(block) for block in self._blocks)

    def finish(self) -> None:
        """Write what is left and close the sink; one that hangs is left behind after 10 s."""
        with self._change:
            self._ending = True
            self._change.notify_all()
        self._thread.join(FAREWELL)
        if self._thread.is_alive():
            self._trouble = self._trouble or "It does not finish and was left behind."

    @property
    def delivery(self) -> Delivery:
        """How the sink does."""
        sink = self._sink
        return Delivery(sink.name, self._written, self._dropped, self._trouble, sink.remark)

    def _run(self) -> None:
        while (block := self._next()) is not None:
            try:
                self._sink.write(block)
            except Exception as error:  # a sink may fail in any way; reading goes on
                self._stop(_words(error), len(block))
                break
            self._written += len(block)
        try:
            self._sink.close()
        except Exception as error:
            self._stop(_words(error))

    def _next(self) -> Readings | None:
        """What is to be written next: a block, or all that came since the last one was taken."""
        with self._change:
            self._change.wait_for(lambda: self._blocks or self._ending)
            if not self._blocks:
                return None
            if (interval := self._sink.interval) > 0:
                self._change.wait_for(
                    lambda: self._waiting() >= self._room // 2 or self._ending,
                    self._taken + interval - time.monotonic(),
                )
            found = taken(self._blocks, inf if interval > 0 else 0)
            self._taken = time.monotonic()
            self._change.notify_all()
        return Readings.joined(found)

    def _stop(self, trouble: str, unwritten: int = 0) -> None:
        with self._change:
            self._trouble = self._trouble or trouble
            self._dropped += unwritten + sum(len(block) for block in self._blocks)
            self._blocks.clear()
            self._change.notify_all()


def _words(error: Exception) -> str:
    if isinstance(error, OSError) and error.errno in FULL:
        return f"{FULL[error.errno]} What was written before is kept."
    return str(error) or type(error).__name__
