"""What every camera is: a context manager that yields blocks of consecutive frames.

Frames are lines of a strip, or images of a pad.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Protocol, Self

from numpy.typing import NDArray

from fringeforce.acquisition.consecutive import Consecutive
from fringeforce.base.errors import InputError

LINES, IMAGES = 64, 1
"""Most lines, and images, in a block where nothing else is asked for.

A block of images would be late by the time that they take."""
PATIENCE = 0.1
"""Longest time that such a block of lines takes at a stated rate [s]: a hand does not notice it."""


@dataclass(frozen=True, eq=False)
class Block(Consecutive):
    """Consecutive lines of a camera, or images of a pad.

    Attributes
    ----------
    lines : ndarray, shape (k, *frame_shape)
        Grey levels; frames have the shape (P,) or (rows, columns), with the number of pictures
        before it if there are several.
    timestamps : ndarray, shape (k,)
        When every line was exposed, on this computer's clock [s since 1970].
    dropped : int
        Lines that the camera lost just before this block.
    first : int
        Running number of the first line; it counts lost lines too.
    """

    COLUMNS = ("lines", "timestamps")
    lines: NDArray[Any]
    timestamps: NDArray[Any]
    dropped: int
    first: int


@dataclass(frozen=True)
class Settings:
    """How a camera is run.

    Attributes
    ----------
    line_rate : float or None
        Lines, or images of a pad, per second; the camera's own if not given.
    exposure : float or None
        Exposure of each [s]; the camera's own if not given.
    block : int or None
        How many come at once; if not given one image, or 64 lines, of a stated rate as many as
        come in 0.1 s.
    """

    line_rate: float | None = None
    exposure: float | None = None
    block: int | None = None

    def __post_init__(self) -> None:
        for name, unit in (("line_rate", "lines or images per second"), ("exposure", "seconds")):
            value = getattr(self, name)
            if value is not None and not 0 < value < float("inf"):
                raise InputError(f"{name} = {value:g}: must be a number of {unit} above 0.")
        if self.block is not None and not 1 <= self.block <= 4096:
            raise InputError(f"block = {self.block}: must be from 1 to 4096 lines.")
        if self.exposure and self.line_rate and self.exposure * self.line_rate > 1:
            raise InputError(
                f"exposure = {self.exposure:g} s leaves no time for {self.line_rate:g} lines per "
                f"second; expose at most {1 / self.line_rate:.3g} s."
            )

    def block_of(self, images: bool) -> int:
        """How many lines, or images, come at once."""
        if self.block or images:
            return self.block or IMAGES
        return (
            LINES if self.line_rate is None else max(min(int(PATIENCE * self.line_rate), LINES), 1)
        )


class Camera(Protocol):
    """A source of lines, or of images.

    Entering connects and iterating yields `Block` until the source ends.  A camera that was left
    can be entered again and goes on counting lines, which is how a lost one comes back.
    """

    @property
    def name(self) -> str:
        """What to call it."""
        ...

    @property
    def patient(self) -> bool:
        """True if it waits for whoever reads, as a file does; a real camera never waits."""
        ...

    def __enter__(self) -> Self:
        """Connect; raises `CameraLost` if nobody answers."""
        ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
        /,
    ) -> None:
        """Disconnect."""
        ...

    def __iter__(self) -> Iterator[Block]:
        """Blocks in order; raises `CameraLost` when the camera vanishes."""
        ...

    def close(self) -> None:
        """End the iteration soon; may be called from another thread."""
        ...


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
        self.block = self.settings.block_of(images)
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
