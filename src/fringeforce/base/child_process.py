"""Processes that end with the one that started them, even if that one is killed."""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable


def end_with_parent(last: Callable[[], object] = bool) -> threading.Thread:
    """Let this process end as soon as the one that started it has ended and cannot tell it to.

    Parameters
    ----------
    last : callable
        What to do before.

    Returns
    -------
    Thread
        That waits for it.
    """

    def wait_and_end() -> None:
        if parent is not None:
            parent.join()
            last()
            # other threads may be busy for long, and nobody waits for what they find
            os._exit(1)

    parent = multiprocessing.parent_process()
    thread = threading.Thread(target=wait_and_end, daemon=True)
    thread.start()
    return thread
