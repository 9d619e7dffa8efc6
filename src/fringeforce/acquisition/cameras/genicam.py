"""What GenICam cameras share, whichever library speaks to them.

A picture of the camera is a block of lines, or one image of a pad.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.acquisition.cameras.camera import Block, Interruptible, Settings
from fringeforce.base.errors import InputError

BUFFERS = 64
"""Pictures of the camera that wait in memory: 0.2 s at 20,000 lines/s in blocks of 64."""
POLL = 0.1
"""Time to wait for a picture before asking whether to go on [s]."""


class GenicamCamera(Interruptible):
    """Base of cameras that deliver consecutive lines as the rows of a picture, or images of a pad.

    Parameters
    ----------
    name : str
        What to call it.
    pixels : int or (int, int)
        Pixels of a line, or along x and y of an image, as the design says.
    bits : int
        Bits of a pixel.
    settings : Settings, optional
        Line rate, exposure and block; a block of a pad is one image.
    mosaic : str
        Four letters of a Bayer mosaic such as "RGGB"; anything else is read as grey levels.

    Raises
    ------
    InputError
        If images are asked for by the block.
    """

    patient = False
    line_rate: float
    """What the camera made of the rate that it was told [lines/s] or [images/s]."""

    def __init__(
        self,
        name: str,
        pixels: int | tuple[int, int],
        bits: int,
        settings: Settings | None,
        mosaic: str = "",
    ) -> None:
        super().__init__(settings, images=not isinstance(pixels, int))
        self.name, self._bits = name, bits
        kind = f"Bayer{mosaic[:2].upper()}" if mosaic.isalpha() else "Mono"
        self._format = f"{kind}{bits}"
        """Pixel format of the standard (GenICam SFNC, PixelFormat)."""
        self._frame: tuple[int, ...]
        if isinstance(pixels, int):
            self._width, self._height, self._frame = pixels, self.block, (pixels,)
            self._what = f"blocks of {self.block} lines of {pixels} pixels"
            return
        self._width, self._height = pixels
        self._frame = self._height, self._width
        self._what = f"images of {self._width} x {self._height} pixels"
        if self.block != 1:
            raise InputError(f"block = {self.block}: {name} delivers images one by one.")

    def _block(self, picture: NDArray[Any], arrived: float, missed: int) -> Block:
        """A picture's lines, of which the last one is exposed as it arrives.

        Parameters
        ----------
        picture : ndarray, shape (height, width)
            Grey levels.
        arrived : float
            When the picture came [s since 1970].
        missed : int
            Pictures that were lost just before.
        """
        size = self.block
        lines = picture.reshape(size, *self._frame)
        dropped = missed * size
        first = self._next + dropped
        self._next = first + size
        ages = np.arange(size - 1, -1, -1) / self.line_rate
        return Block(lines, arrived - ages, dropped, first)

    def _refused(self, reason: str) -> InputError:
        """The error of a camera that does not do what it is told."""
        return InputError(
            f"{self.name} cannot deliver {self._what} with {self._bits} bits as set: {reason}. "
            "Change the settings, or the camera in the design."
        )
