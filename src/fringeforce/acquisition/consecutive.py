"""What blocks of frames and of readings have in common: they are pieces of one long run."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar

import numpy as np
from numpy.typing import NDArray


class Consecutive:
    """Base of dataclasses that hold consecutive lines, or images of a pad.

    Attributes
    ----------
    first : int
        Running number of the first line.
    timestamps : ndarray, shape (k,)
        When every line was exposed [s since 1970].
    """

    COLUMNS: ClassVar[tuple[str, ...]]
    """Attributes that hold an entry for every line, or None."""

    if TYPE_CHECKING:  # fields of frozen dataclasses, which a property would be a default of

        @property
        def first(self) -> int:
            """Running number of the first line."""
            ...

        @property
        def timestamps(self) -> NDArray[Any]:
            """When every line was exposed."""
            ...

    def __len__(self) -> int:
        return len(self.timestamps)

    def precede(self, other: Self) -> bool:
        """Whether another piece follows without a gap."""
        return self.first + len(self) == other.first

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Pieces of which each precedes the next, as one."""
        if len(parts) == 1:
            return parts[0]
        columns = {
            name: np.concatenate([getattr(part, name) for part in parts])
            for name in cls.COLUMNS
            if getattr(parts[0], name) is not None
        }
        return cls(**{**vars(parts[0]), **columns})


Piece = TypeVar("Piece", bound=Consecutive)


def taken(waiting: deque[Piece], most: float) -> list[Piece]:
    """Take the first piece out, and those that follow it without a gap up to so many lines."""
    found = [waiting.popleft()]
    room = most - len(found[0])
    while waiting and found[-1].precede(waiting[0]) and len(waiting[0]) <= room:
        found.append(waiting.popleft())
        room -= len(found[-1])
    return found
