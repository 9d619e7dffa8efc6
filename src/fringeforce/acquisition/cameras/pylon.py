"""Basler cameras through pypylon."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any, Self

import numpy as np

from fringeforce.acquisition.cameras.camera import Block, Settings
from fringeforce.acquisition.cameras.genicam import BUFFERS, POLL, GenicamCamera
from fringeforce.base.errors import CameraLost, InputError
from fringeforce.base.optional_libraries import extra


class PylonCamera(GenicamCamera):
    """A Basler camera; a picture of it is a block of consecutive lines, or an image of a pad.

    Parameters
    ----------
    serial : str
        Serial number of the camera, or nothing for the first one found.
    pixels : int or (int, int)
        Pixels of a line, or along x and y of an image, as the design says.
    bits : int
        Bits of a pixel.
    settings : Settings
        Line rate, exposure and block.
    mosaic : str
        Four letters of a Bayer mosaic such as "RGGB"; anything else is read as grey levels.

    Raises
    ------
    InputError
        If pypylon is not installed.
    """

    def __init__(
        self,
        serial: str,
        pixels: int | tuple[int, int],
        bits: int = 8,
        settings: Settings | None = None,
        mosaic: str = "",
    ) -> None:
        super().__init__(f"Basler camera {serial or 'found first'}", pixels, bits, settings, mosaic)
        self._serial = serial
        self._pylon: Any = extra("pypylon.pylon", "pylon")
        self._error: Any = extra("pypylon.genicam", "pylon").GenericException

    def __enter__(self) -> Self:
        super().__enter__()
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
            raise self._refused(_first_line(error)) from None
        self._missed = 0
        self._camera.MaxNumBuffer.Value = BUFFERS
        self._camera.StartGrabbing(self._pylon.GrabStrategy_OneByOne)
        return self

    def __exit__(self, *error: object) -> None:
        super().__exit__(*error)
        self._camera.Close()

    def __iter__(self) -> Iterator[Block]:
        while not self._closed.is_set():
            if self._camera.IsCameraDeviceRemoved():
                raise CameraLost(f"{self.name} was removed.")
            try:
                grabbed = self._camera.RetrieveResult(
                    int(POLL * 1e3), self._pylon.TimeoutHandling_Return
                )
            except self._error as error:
                raise CameraLost(f"{self.name} stopped: {_first_line(error)}.") from None
            if not grabbed.IsValid():
                continue
            self._missed += grabbed.NumberOfSkippedImages
            if grabbed.GrabSucceeded():
                missed, self._missed = self._missed, 0
                yield self._block(np.array(grabbed.Array), time.time(), missed)
            else:
                self._missed += 1
            grabbed.Release()

    def _configure(self, camera: Any) -> None:
        """Put width, height, pixel format, rate and exposure where the design wants them."""
        camera.PixelFormat.Value = self._format
        camera.Width.Value = self._width
        camera.Height.Value = self._height
        if self.settings.exposure:
            camera.ExposureTime.Value = self.settings.exposure * 1e6
        self.line_rate = self._set_rate(camera)

    def _set_rate(self, camera: Any) -> float:
        """Set the rate, and return what the camera made of it [lines/s or images/s]."""
        rate, size = self.settings.line_rate, self.block
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
                if "Frame" in name and (switch := nodes.GetNode("AcquisitionFrameRateEnable")):
                    switch.Value = True
                node.Value = rate / lines
            return node.Value * lines
        raise InputError(f"{self.name} tells no line rate and no frame rate.")


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0].rstrip(".")
