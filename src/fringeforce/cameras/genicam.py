"""What GenICam cameras share, whichever library speaks to them: a frame is a block of lines."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.cameras.camera import Block, Settings
from fringeforce.cameras.interruptible import Interruptible
from fringeforce.errors import InputError

BUFFERS = 64
"""Frames of the camera that wait in memory: 0.2 s at 20,000 lines/s in blocks of 64."""
POLL = 0.1
"""Time to wait for a frame before asking whether to go on [s]."""


class GenicamCamera(Interruptible):
    """Base of cameras that deliver consecutive lines as the rows of a frame.

    Parameters
    ----------
    name : str
        What to call it.
    pixels, bits : int
        Of a line, as the design says.
    settings : Settings, optional
        Line rate, exposure and block.
    """

    patient = False
    line_rate: float
    """What the camera made of the rate that it was told [lines/s]."""

    def __init__(self, name: str, pixels: int, bits: int, settings: Settings | None) -> None:
        super().__init__(settings)
        self.name = name
        self._pixels, self._bits = pixels, bits

    def _block(self, lines: NDArray[Any], arrived: float, missed: int) -> Block:
        """A frame's lines, of which the last one is exposed as it arrives.

        Parameters
        ----------
        lines : ndarray, shape (k, P)
            Grey levels.
        arrived : float
            When the frame came [s since 1970].
        missed : int
            Frames that were lost just before.
        """
        size = self.settings.block
        dropped = missed * size
        first = self._next + dropped
        self._next = first + size
        ages = np.arange(size - 1, -1, -1) / self.line_rate
        return Block(lines, arrived - ages, dropped, first)

    def _refused(self, reason: str) -> InputError:
        """The error of a camera that does not do what it is told."""
        return InputError(
            f"{self.name} cannot deliver blocks of {self.settings.block} lines of {self._pixels} "
            f"pixels with {self._bits} bits as set: {reason}. Change the settings, or the camera "
            "in the design."
        )
