"""A file in place of a camera."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from fringeforce.acquisition.cameras.camera import Block, Interruptible, Settings
from fringeforce.base.arrays import Array
from fringeforce.io.frames import load_frames, load_times


class ReplayCamera(Interruptible):
    """Plays the frames of a file, at the speed they were recorded with or as fast as they are read.

    Parameters
    ----------
    path : path
        .h5, .npy, .png or .tiff; a row each, or an image each for a pad.
    settings : Settings
        With a line rate, frames come at that rate.  Without, they come when they did in a recording
        that holds times, and as fast as they are read from other files.
    full_speed : bool
        As fast as they are read, whatever the file says.
    dimensions : int
        `dimensions` of the sensor: 1 for lines of a strip, 2 for images of a pad.

    found : pair of ndarray and ndarray or None, optional
        Frames and times [s] that were taken from pictures, in the place of those of the file.

    Raises
    ------
    FileFormatError
        If the file is missing, damaged, or of a kind that is not read.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        settings: Settings | None = None,
        full_speed: bool = False,
        dimensions: int = 1,
        found: tuple[NDArray[Any], Array | None] | None = None,
    ) -> None:
        super().__init__(settings, dimensions > 1)
        self.name = Path(path).name
        rate = self.settings.line_rate
        self.lines, times = found or (load_frames(path, dimensions), load_times(path))
        times = np.arange(len(self.lines)) / rate if rate else times
        self._offsets = None if times is None or full_speed else times - times[:1]

    @property
    def patient(self) -> bool:
        """True at full speed: the file waits for whoever reads."""
        return self._offsets is None

    def __enter__(self) -> Self:
        super().__enter__()
        played = 0.0 if self._offsets is None else float(self._offsets[self._next :][:1].sum())
        self._start = time.time() - played
        return self

    def __iter__(self) -> Iterator[Block]:
        while self._next < len(self.lines) and not self._closed.is_set():
            first = self._next
            lines = self.lines[first : first + self.block]
            if self._offsets is None:
                timestamps = np.full(len(lines), time.time())
            else:
                timestamps = self._start + self._offsets[first : first + len(lines)]
                if self._closed.wait(timestamps[-1] - time.time()):
                    return
            self._next = first + len(lines)
            yield Block(lines, timestamps, 0, first)
