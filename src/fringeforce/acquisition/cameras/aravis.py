"""GenICam cameras (GigE Vision and USB3 Vision) through Aravis."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from importlib import import_module
from typing import Any, Self

import numpy as np

from fringeforce.acquisition.cameras.camera import Block, Settings
from fringeforce.acquisition.cameras.genicam import BUFFERS, POLL, GenicamCamera
from fringeforce.acquisition.cameras.gobject import aravis
from fringeforce.base.errors import CameraLost, FringeforceError

# GigE Vision counts frames from 1 to 65535 and starts again at 1
FRAME_IDS = 65535


class AravisCamera(GenicamCamera):
    """A GenICam camera; a picture of it is a block of consecutive lines, or an image of a pad.

    Parameters
    ----------
    identity : str
        Name that `arv-tool-0.8` lists, address, or nothing for the first camera found.
    pixels : int or (int, int)
        Pixels of a line, or along x and y of an image, as the design says.
    bits : int
        Bits of a pixel.
    settings : Settings
        Line rate, exposure and block.
    silence : float
        A camera that sends nothing for so long is lost [s]; never less than ten blocks.
    mosaic : str
        Four letters of a Bayer mosaic such as "RGGB"; anything else is read as grey levels.

    Raises
    ------
    InputError
        If Aravis is not installed.
    """

    def __init__(
        self,
        identity: str,
        pixels: int | tuple[int, int],
        bits: int = 8,
        settings: Settings | None = None,
        silence: float = 1.0,
        mosaic: str = "",
    ) -> None:
        super().__init__(f"camera {identity or 'found first'}", pixels, bits, settings, mosaic)
        self._identity, self._silence = identity or None, silence
        self._aravis: Any = aravis()
        self._error: Any = import_module("gi.repository.GLib").Error
        self._camera: Any = None
        self._stream: Any = None

    def __enter__(self) -> Self:
        super().__enter__()
        self._last_id: int | None = None
        try:
            self._aravis.update_device_list()
            self._camera = self._aravis.Camera.new(self._identity)
            self._configure(self._camera)
            self._stream = self._camera.create_stream(None, None)
            if self._stream is None:
                raise CameraLost(f"{self.name} opens no stream.")
            payload = self._camera.get_payload()
            for _ in range(BUFFERS):
                self._stream.push_buffer(self._aravis.Buffer.new_allocate(payload))
            self._camera.start_acquisition()
        except self._error as error:
            self._release(lost=True)
            raise CameraLost(f"{self.name} does not answer: {error.message}.") from None
        except FringeforceError:
            self._release(lost=False)
            raise
        return self

    def __exit__(self, *error: object) -> None:
        super().__exit__(*error)
        lost = any(isinstance(one, CameraLost) for one in error)
        if not lost:
            with suppress(self._error):
                self._camera.stop_acquisition()
        self._release(lost)

    def __iter__(self) -> Iterator[Block]:
        heard = time.monotonic()
        patience = max(self._silence, 10 * self.block / self.line_rate)
        while not self._closed.is_set():
            buffer = self._stream.timeout_pop_buffer(int(POLL * 1e6))
            if buffer is None:
                if time.monotonic() - heard > patience:
                    raise CameraLost(f"{self.name} has sent nothing for {patience:.3g} s.")
                continue
            heard = time.monotonic()
            block = self._received(buffer)
            self._stream.push_buffer(buffer)
            if block is not None:
                yield block

    def _received(self, buffer: Any) -> Block | None:
        """A complete picture; incomplete ones are left out and counted with the next."""
        if buffer.get_status() != self._aravis.BufferStatus.SUCCESS:
            return None
        number = buffer.get_frame_id()
        missed = 0 if self._last_id is None else (number - self._last_id - 1) % FRAME_IDS
        self._last_id = number
        dtype = np.uint8 if self._bits <= 8 else np.uint16
        picture = np.frombuffer(buffer.get_data(), dtype).reshape(self._height, self._width)
        arrived = buffer.get_system_timestamp() / 1e9 or time.time()
        return self._block(picture, arrived, missed)

    def _configure(self, camera: Any) -> None:
        """Put width, height, pixel format, rate and exposure where the design wants them."""
        library, wanted = self._aravis, (self._width, self._height)
        camera.set_range_check_policy(library.RangeCheckPolicy.ENABLE)
        try:
            camera.set_pixel_format_from_string(self._format)
            camera.set_region(0, 0, *wanted)
            if self.settings.exposure:
                camera.set_exposure_time(self.settings.exposure * 1e6)
            self.line_rate = self._set_rate(camera)
            _, _, width, height = camera.get_region()
        except self._error as error:
            if error.matches(library.device_error_quark(), library.DeviceError.TIMEOUT):
                raise
            raise self._refused(error.message) from None
        if (width, height) != wanted:
            raise self._refused(f"it delivers {height} of {width}")

    def _set_rate(self, camera: Any) -> float:
        """Set the rate, and return what the camera made of it [lines/s or images/s]."""
        rate, feature = self.settings.line_rate, "AcquisitionLineRate"
        if camera.is_feature_available(feature):
            if rate:
                camera.set_float(feature, rate)
            return camera.get_float(feature)
        if rate:
            camera.set_frame_rate(rate / self.block)
        return camera.get_frame_rate() * self.block

    def _release(self, lost: bool) -> None:
        """Let go of the library's objects, which disconnect when their last reference is gone."""
        held = [self._stream, self._camera]
        self._stream = self._camera = None
        if lost:
            # a camera that does not answer is told goodbye for ten seconds; nobody waits for that
            threading.Thread(target=held.clear, daemon=True).start()
