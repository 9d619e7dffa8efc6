"""What cameras here share: a count of frames, and an end that any thread may ask for."""

from __future__ import annotations

import threading
from typing import Self

from fringeforce.acquisition.cameras.camera import IMAGES, LINES, Settings


class Interruptible:
    """Base of cameras whose iteration runs until `_closed` is set.

    Parameters
    ----------
    settings : Settings, optional
        How it is run.
    images : bool
        Whether it delivers images and not lines.
    """

    def __init__(self, settings: Settings | None, images: bool = False) -> None:
        self.settings = settings or Settings()
        self.block = self.settings.block or (IMAGES if images else LINES)
        """Lines or images in a block."""
        self._closed = threading.Event()
        self._next = 0
        """Running number of the next line or image; a camera that was left goes on counting."""

    def __enter__(self) -> Self:
        self._closed.clear()
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def close(self) -> None:
        """End the iteration soon; may be called from another thread."""
        self._closed.set()
