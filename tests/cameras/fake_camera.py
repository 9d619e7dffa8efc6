"""A GigE Vision camera on loopback, in a process of its own, that shows given lines.

Run as ``python fake_camera.py LINES.npy LINES_PER_BLOCK``; it prints "ready" and serves until it
is killed.  The lines are shown again and again, a block in every frame.
"""

import ctypes
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np

from fringeforce.acquisition.cameras.gobject import aravis

ADDRESS = "127.0.0.1"
PACKET_SIZE, JUMBO = 0x0D04, 9000
"""The register for the size of a packet (GigE Vision), and what networks for cameras carry."""
# what the library calls for every frame: buffer, our data, exposure, gain, pixel format
Fill = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32, ctypes.c_uint32
)


class FakeCamera:
    """Starts and kills the camera's process."""

    def __init__(self, lines: np.ndarray, folder: Path, block: int = 64) -> None:
        path = folder / "shown.npy"
        np.save(path, lines)
        self._command = [sys.executable, __file__, str(path), str(block)]
        self.start()

    def start(self) -> None:
        """Switch it on."""
        self._process = subprocess.Popen(self._command, stdout=subprocess.PIPE, text=True)
        assert self._process.stdout
        assert self._process.stdout.readline() == "ready\n"

    def kill(self) -> None:
        """Pull the plug."""
        self._process.kill()
        self._process.communicate()


def main(path: str, block: int) -> None:
    # before the camera is there, for whoever waits for it finds it at once
    lines = np.ascontiguousarray(np.load(path))
    camera = aravis().GvFakeCamera.new(ADDRESS, "FF01")
    library = ctypes.CDLL("libaravis-0.8.so.0")
    library.arv_buffer_get_data.restype = ctypes.c_void_p
    library.arv_buffer_get_data.argtypes = ctypes.c_void_p, ctypes.c_void_p
    library.arv_fake_camera_set_fill_pattern.argtypes = ctypes.c_void_p, Fill, ctypes.c_void_p
    size = block * lines.shape[1] * lines.itemsize
    start, blocks, shown = lines.ctypes.data, lines.nbytes // size, 0

    @Fill
    def fill(buffer: int, *_: object) -> None:
        """Copy the next block into the frame; the buffer itself says that it holds 0 bytes."""
        nonlocal shown
        ctypes.memmove(library.arv_buffer_get_data(buffer, None), start + shown * size, size)
        shown = (shown + 1) % blocks

    # a GObject's hash is its address
    shown_by = ctypes.c_void_p(hash(camera.get_fake_camera()))
    library.arv_fake_camera_write_register(shown_by, PACKET_SIZE, JUMBO)
    library.arv_fake_camera_set_fill_pattern(shown_by, fill, None)
    print("ready", flush=True)
    signal.pause()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
