"""Basler cameras through pypylon."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from types import TracebackType
from typing import Any, Self

import numpy as np

from fringeforce.cameras.camera import Block, Settings
from fringeforce.errors import CameraLost, InputError
from fringeforce.extras import extra

POLL_MS = 100
BUFFERS = 64


class PylonCamera:
    """A Basler camera; a frame of it is a block of consecutive lines.

    Parameters
    ----------
    serial : str
        Its serial number, or nothing for the first one found.
    pixels, bits : int
        Of a line, as the design says.
    settings : Settings
        Line rate, exposure and block.

    Raises
    ------
    InputError
        If pypylon is not installed.
    """

    patient = False

    def __init__(
        self, serial: str, pixels: int, bits: int = 8, settings: Settings | None = None
    ) -> None:
        self.settings = settings or Settings()
        self.name = f"Basler camera {serial or 'found first'}"
        self._serial, self._pixels, self._bits = serial, pixels, bits
        self._pylon: Any = extra("pypylon.pylon", "pylon")
        self._error: Any = extra("pypylon.genicam", "pylon").GenericException
        self._closed = threading.Event()
        self._next = 0

    def __enter__(self) -> Self:
        self._closed.clear()
        wanted = self._pylon.DeviceInfo()
        if self._serial:
            wanted.SetSerialNumber(self._serial)
        try:
            device = self._pylon.TlFactory.GetInstance().CreateFirstDevice(wanted)
            self._camera: Any = self._pylon.InstantCamera(device)
            self._camera.Open()
        except self._error as error:
            raise CameraLost(f"{self.name} does not answer: {_first_line(error)}.") from None
        try:
            self._configure(self._camera)
        except self._error as error:
            self._camera.Close()
            raise InputError(
                f"{self.name} cannot deliver blocks of {self.settings.block} lines of "
                f"{self._pixels} pixels with {self._bits} bits as set ({_first_line(error)}); "
                "change the settings, or the camera in the design."
            ) from None
        self._missed = 0
        self._camera.MaxNumBuffer.Value = BUFFERS
        self._camera.StartGrabbing(self._pylon.GrabStrategy_OneByOne)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
        self._camera.Close()

    def close(self) -> None:
        """End the iteration soon; may be called from another thread."""
        self._closed.set()

    def __iter__(self) -> Iterator[Block]:
        while not self._closed.is_set():
            if self._camera.IsCameraDeviceRemoved():
                raise CameraLost(f"{self.name} was removed.")
            try:
                grabbed = self._camera.RetrieveResult(POLL_MS, self._pylon.TimeoutHandling_Return)
            except self._error as error:
                raise CameraLost(f"{self.name} stopped: {_first_line(error)}.") from None
            if not grabbed.IsValid():
                continue
            self._missed += grabbed.NumberOfSkippedImages
            if grabbed.GrabSucceeded():
                yield self._block(grabbed)
            else:
                self._missed += 1
            grabbed.Release()

    def _block(self, grabbed: Any) -> Block:
        size, dropped = self.settings.block, self._missed * self.settings.block
        first = self._next + dropped
        self._next, self._missed = first + size, 0
        ages = np.arange(size - 1, -1, -1) / self.line_rate
        return Block(np.array(grabbed.Array), time.time() - ages, dropped, first)

    def _configure(self, camera: Any) -> None:
        """Put width, height, pixel format, rate and exposure where the design wants them."""
        camera.PixelFormat.Value = f"Mono{self._bits}"
        camera.Width.Value = self._pixels
        camera.Height.Value = self.settings.block
        if self.settings.exposure:
            camera.ExposureTime.Value = self.settings.exposure * 1e6
        self.line_rate = self._set_rate(camera)

    def _set_rate(self, camera: Any) -> float:
        """Set the line rate, and return what the camera made of it [lines/s]."""
        rate, size = self.settings.line_rate, self.settings.block
        nodes = camera.GetNodeMap()
        genicam: Any = extra("pypylon.genicam", "pylon")
        for name, lines in (
            ("AcquisitionLineRate", 1),
            ("AcquisitionLineRateAbs", 1),
            ("AcquisitionFrameRate", size),
            ("AcquisitionFrameRateAbs", size),
        ):
            node = nodes.GetNode(name)
            if not genicam.IsAvailable(node):
                continue
            if rate:
                if (switch := nodes.GetNode("AcquisitionFrameRateEnable")) and lines > 1:
                    switch.Value = True
                node.Value = rate / lines
            return node.Value * lines
        raise InputError(f"{self.name} tells no line rate and no frame rate.")


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0].rstrip(".")
