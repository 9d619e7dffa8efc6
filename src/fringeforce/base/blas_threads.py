"""One thread for BLAS while small matrices are worked on.

The threads of a BLAS spin until all have done their share, which takes longer than the share where
other programs hold the cores; matrices of some dozens of rows gain nothing from them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from threading import Lock
from typing import Any

from threadpoolctl import ThreadpoolController

class _Limit:
    """What is inside, and how the threads were before.

    Attributes
    ----------
    lock : Lock
        Held while these are changed.
    inside : int
        How many are inside.
    before : context manager
        Puts the number of threads back.
    """

    def __init__(self) -> None:
        self.lock, self.inside = Lock(), 0
        self.before: Any = None

    def enter(self) -> None:
        """Lower the number of threads, unless that was done."""
        with self.lock:
            if not self.inside:
                self.before = _controller().limit(limits=1)
                self.before.__enter__()
            self.inside += 1

    def leave(self) -> None:
        """Put it back, unless others are inside."""
        with self.lock:
            self.inside -= 1
            if not self.inside:
                self.before.__exit__(None, None, None)


_limit = _Limit()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Run what is inside, or the function that is decorated, with one thread of BLAS.

    The number of threads belongs to the process: the first to enter lowers it, the last to leave
    puts it back, in any order and from any threads.  It takes some tens of microseconds.
    """
    _limit.enter()
    try:
        yield
    finally:
        _limit.leave()


@cache
def _controller() -> ThreadpoolController:
    """Every BLAS that is loaded; looking for them takes a hundredth of a second."""
    return ThreadpoolController().select(user_api="blas")
