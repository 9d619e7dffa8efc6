"""Processes that end with the one that started them, however that one ends."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection


class Lifeline:
    """A pipe on which nothing is ever said, and whose one end nobody but this process has.

    The system closes that end when this process ends, even if it is killed; `close` does so before.
    Whoever was given `held` and calls `hold` on it ends then.
    """

    def __init__(self) -> None:
        self.held, self._own = multiprocessing.Pipe(duplex=False)

    def close(self) -> None:
        """Let go of all who hold on."""
        self._own.close()
        self.held.close()


def hold(held: Connection, last: Callable[[], object] = bool) -> None:
    """Let this process end as soon as the other end of a lifeline is let go of.

    Parameters
    ----------
    held : Connection
        Of the lifeline.
    last : callable
        What to do before.
    """
    threading.Thread(target=_wait_and_end, args=(held, last), daemon=True).start()


def _wait_and_end(held: Connection, last: Callable[[], object]) -> None:
    with suppress(EOFError, OSError):
        held.recv_bytes()
    last()
    # other threads may be busy for long, and nobody waits for what they find
    os._exit(1)
