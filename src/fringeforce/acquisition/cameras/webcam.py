"""Webcams and other video devices through PyAV: FFmpeg's Video4Linux2."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from typing import Any, Self

import numpy as np

from fringeforce.acquisition.cameras.camera import Block, Interruptible, Settings
from fringeforce.base.errors import CameraLost, InputError
from fringeforce.base.optional_libraries import extra
from fringeforce.pictures.files import decoded

CLOCKS = 10.0
"""Times of a driver that differ more from this computer's clock are not of that clock [s]."""


class WebcamCamera(Interruptible):
    """A video device of Linux; it delivers whole pictures, one by one.

    Parameters
    ----------
    device : str
        Number, as 0 for /dev/video0, or path.
    size : (int, int)
        Columns and rows of the pictures.
    settings : Settings, optional
        Rate of pictures; exposure and block stay the device's own.

    Raises
    ------
    InputError
        If PyAV is not installed, the system is not Linux, or exposure or block are set.
    """

    patient = False

    def __init__(
        self, device: str, size: tuple[int, int], settings: Settings | None = None
    ) -> None:
        super().__init__(settings, images=True)
        self._path = f"/dev/video{device or 0}" if device.isdigit() or not device else device
        self.name, self._size = f"webcam {self._path}", size
        self._av: Any = extra("av", "pictures")
        if sys.platform != "linux":
            raise InputError(
                f"{self.name} is read by Video4Linux2, and {sys.platform} has none; record a video "
                "and read it with file:PATH."
            )
        if self.settings.exposure:
            raise InputError(
                f"exposure = {self.settings.exposure:g} s cannot be set here; run  v4l2-ctl -d "
                f"{self._path} -c auto_exposure=1,exposure_time_absolute="
                f"{self.settings.exposure * 1e4:.0f}  first."
            )
        if self.block != 1:
            raise InputError(f"block = {self.block}: {self.name} delivers pictures one by one.")

    def __enter__(self) -> Self:
        super().__enter__()
        columns, rows = self._size
        options = {"video_size": f"{columns}x{rows}", "timestamps": "abs"}
        if self.settings.line_rate:
            options["framerate"] = f"{self.settings.line_rate:g}"
        try:
            self._container = self._av.open(self._path, format="v4l2", options=options)
        except (self._av.error.FFmpegError, OSError) as error:
            raise CameraLost(
                f"{self.name} does not open: {error}. `v4l2-ctl --list-devices` lists those there "
                f"are, `v4l2-ctl -d {self._path} --list-formats-ext` sizes and rates."
            ) from None
        return self

    def __exit__(self, *error: object) -> None:
        super().__exit__(*error)
        self._container.close()

    def __iter__(self) -> Iterator[Block]:
        try:
            for frame in self._container.decode(video=0):
                if self._closed.is_set():
                    return
                now = time.time()
                exposed = now if frame.time is None else frame.time
                stamp = np.array([exposed if abs(now - exposed) < CLOCKS else now])
                self._next += 1
                yield Block(decoded(frame)[None], stamp, 0, self._next - 1)
        except (self._av.error.FFmpegError, ValueError) as error:
            raise CameraLost(f"{self.name} stopped: {error}.") from None
        if not self._closed.is_set():
            raise CameraLost(f"{self.name} sends no more pictures.")
