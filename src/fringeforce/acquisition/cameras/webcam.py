"""Webcams, and whatever else the operating system shows as a video device."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from typing import Any, Self

import numpy as np

from fringeforce.acquisition.cameras.camera import Block, Interruptible, Settings
from fringeforce.base.errors import CameraLost
from fringeforce.base.optional_libraries import extra
from fringeforce.pictures.files import decoded

SYSTEMS = {
    "linux": ("v4l2", "/dev/video{}"),
    "darwin": ("avfoundation", "{}"),
    "win32": ("dshow", "video={}"),
}
"""FFmpeg's name for the video devices of an operating system, and theirs."""
PATIENCE = 5.0
"""A device that sends nothing for so long is lost [s]: webcams take a second or two to begin."""


class Webcam(Interruptible):
    """Pictures of a video device, decoded by FFmpeg.

    What comes while nobody reads is dropped by the device, which does not say how much.

    Parameters
    ----------
    device : str
        Number or name; the first one if empty.
    size : (int, int)
        Columns and rows of the pictures.
    settings : Settings, optional
        Rate; the device chooses its exposure.

    Raises
    ------
    InputError
        If PyAV is not installed.
    """

    patient = False

    def __init__(
        self, device: str, size: tuple[int, int], settings: Settings | None = None
    ) -> None:
        super().__init__(settings, images=True)
        self.name = f"webcam {device or 0}"
        system, path = SYSTEMS.get(sys.platform, SYSTEMS["linux"])
        self._source = device if device.startswith("/") else path.format(device or 0)
        self._options = {"video_size": "{}x{}".format(*size)}
        if rate := self.settings.line_rate:
            self._options["framerate"] = f"{rate:g}"
        self._av, self._system = extra("av", "pictures"), system
        self._container: Any = None

    def __enter__(self) -> Self:
        super().__enter__()
        try:
            self._container = self._opened()
        except (self._av.error.FFmpegError, OSError, ValueError) as error:
            said = getattr(error, "strerror", None) or error
            raise CameraLost(
                f"{self.name} does not answer ({self._source}, pictures of "
                f"{self._options['video_size']}: {said}). Is it plugged in, used by nobody else, "
                "and has it pictures of that size?"
            ) from None
        return self

    def _opened(self) -> Any:
        return self._av.open(
            self._source, format=self._system, options=self._options, timeout=PATIENCE
        )

    def __exit__(self, *error: object) -> None:
        super().__exit__(*error)
        if self._container is not None:
            self._container.close()
            self._container = None

    def __iter__(self) -> Iterator[Block]:
        try:
            for frame in self._container.decode(video=0):
                if self._closed.is_set():
                    return
                first, self._next = self._next, self._next + 1
                yield Block(decoded(frame)[None], np.array([time.time()]), 0, first)
        except (self._av.error.FFmpegError, OSError) as error:
            raise CameraLost(f"{self.name} was lost: {error}.") from None
        raise CameraLost(f"{self.name} sends no more pictures.")
