"""What cameras here share: a count of lines, and an end that any thread may ask for."""

from __future__ import annotations

import threading
from types import TracebackType
from typing import Self

from fringeforce.cameras.camera import Settings


class Interruptible:
    """Base of cameras whose iteration runs until `_closed` is set.

    Parameters
    ----------
    settings : Settings, optional
        How it is run.
    """

    def __init__(self, settings: Settings | None) -> None:
        self.settings = settings or Settings()
        self._closed = threading.Event()
        self._next = 0
        """Running number of the next line; a camera that was left goes on counting."""

    def __enter__(self) -> Self:
        self._closed.clear()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the iteration soon; may be called from another thread."""
        self._closed.set()
