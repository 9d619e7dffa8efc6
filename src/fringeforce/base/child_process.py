"""Processes that begin without what another has, and end with it even if it is killed."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import sys
import threading
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # Windows has no ForkServerContext
    from multiprocessing.context import ForkServerContext, SpawnContext

TRIES, PAUSE = 40, 0.05
"""How often, and after what pause [s], a folder is removed until it is gone."""


def fresh_processes(modules: Sequence[str]) -> SpawnContext | ForkServerContext:
    """How to start processes that have nothing of this one, such as its threads.

    On Linux they are copies of a process that imports the modules once; elsewhere each is a new
    interpreter, which imports for a second or two.

    Parameters
    ----------
    modules : sequence of str
        What they need.  Who asks first in a process decides what is imported beforehand.
    """
    if sys.platform != "linux":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(modules))
    return context


def end_with_parent(folder: str | None = None) -> threading.Thread:
    """Let this process end as soon as the one that started it has ended and cannot tell it to.

    Parameters
    ----------
    folder : str, optional
        What is removed then, for the other may have been unable to do so.

    Returns
    -------
    threading.Thread
        What waits for that, and ends this process.
    """

    def wait_and_end() -> None:
        if parent is not None:
            parent.join()
            # what this process is writing at this moment may come after what was removed
            for _ in range(TRIES):
                if not folder or not os.path.exists(folder):
                    break
                shutil.rmtree(folder, ignore_errors=True)
                time.sleep(PAUSE)
            # other threads may be busy for long, and nobody waits for what they find
            os._exit(1)

    parent = multiprocessing.parent_process()
    waiting = threading.Thread(target=wait_and_end, daemon=True)
    waiting.start()
    return waiting
