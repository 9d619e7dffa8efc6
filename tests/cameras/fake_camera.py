"""A GigE Vision camera on loopback, in a process of its own, that shows given lines.

Run as ``python fake_camera.py LINES.npy LINES_PER_BLOCK``; it prints "ready" and serves until it
is killed.  The lines are shown again and again, a block in every frame.
"""

import ctypes
import signal
import sys

import numpy as np

from fringeforce.cameras.gobject import aravis

ADDRESS = "127.0.0.1"
# what the library calls for every frame: buffer, our data, exposure, gain, pixel format
Fill = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32, ctypes.c_uint32
)


def main(path: str, block: int) -> None:
    camera = aravis().GvFakeCamera.new(ADDRESS, "FF01")
    library = ctypes.CDLL("libaravis-0.8.so.0")
    library.arv_buffer_get_data.restype = ctypes.c_void_p
    library.arv_buffer_get_data.argtypes = ctypes.c_void_p, ctypes.c_void_p
    library.arv_fake_camera_set_fill_pattern.argtypes = ctypes.c_void_p, Fill, ctypes.c_void_p
    lines = np.ascontiguousarray(np.load(path))
    size = block * lines.shape[1] * lines.itemsize
    start, blocks, shown = lines.ctypes.data, lines.nbytes // size, 0

    @Fill
    def fill(buffer: int, *_: object) -> None:
        """Copy the next block into the frame; the buffer itself says that it holds 0 bytes."""
        nonlocal shown
        ctypes.memmove(library.arv_buffer_get_data(buffer, None), start + shown * size, size)
        shown = (shown + 1) % blocks

    # a GObject's hash is its address
    library.arv_fake_camera_set_fill_pattern(hash(camera.get_fake_camera()), fill, None)
    print("ready", flush=True)
    signal.pause()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
