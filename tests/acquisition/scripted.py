"""A camera that does what a list says, and sinks that fail in one way each."""

import errno
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from types import TracebackType
from typing import Self

import numpy as np

from fringeforce.acquisition.cameras.camera import Block
from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.base.errors import CameraLost


@dataclass
class Scripted:
    """A camera that does what a list says: deliver lines, or vanish."""

    script: list[int | CameraLost]
    patient: bool = False
    name: str = "scripted"
    entered: list[float] = field(default_factory=list)
    sent: int = 0

    def __enter__(self) -> Self:
        self.entered.append(time.monotonic())
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        pass

    def __iter__(self) -> Iterator[Block]:
        while self.script:
            count = self.script.pop(0)
            if isinstance(count, CameraLost):
                raise count
            first, self.sent = self.sent, self.sent + count
            lines = np.zeros((count, 2048), dtype=np.uint8)
            yield Block(lines, np.full(count, time.time()), 0, first)

    def close(self) -> None:
        self.script.clear()


class Notes(Sink):
    """Remembers which lines it was given."""

    name = "notes"

    def __init__(self) -> None:
        self.lines: list[int] = []
        self.closed = 0

    def write(self, readings: Readings) -> None:
        self.lines += range(readings.first, readings.first + len(readings))

    def close(self) -> None:
        self.closed += 1


class Stuck(Notes):
    """Takes its first block and returns when it is let go."""

    name = "stuck"

    def __init__(self) -> None:
        super().__init__()
        self.go = threading.Event()

    def write(self, readings: Readings) -> None:
        self.go.wait(20)
        super().write(readings)


class Full(Notes):
    """A disk that is full after the first block."""

    name = "full"

    def write(self, readings: Readings) -> None:
        if self.lines:
            raise OSError(errno.ENOSPC, "No space left on device")
        super().write(readings)


class Silent(Notes):
    """Keeps nothing."""

    name = "silent"

    def write(self, readings: Readings) -> None:
        pass

    def close(self) -> None:
        pass
