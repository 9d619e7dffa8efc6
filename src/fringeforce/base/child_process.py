"""Processes that end with the one that started them, even if that one is killed."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import threading
import time

from fringeforce.base.garbage import seldom_collected

TRIES, PAUSE = 40, 0.05
"""How often, and after what pause [s], a folder is removed until it is gone."""


def end_with_parent(folder: str | None = None) -> threading.Thread:
    """Let this process end as soon as the one that started it has ended and cannot tell it to.

    It works for the other alone, and looks for garbage as seldom as commands do.

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

    seldom_collected()
    parent = multiprocessing.parent_process()
    waiting = threading.Thread(target=wait_and_end, daemon=True)
    waiting.start()
    return waiting
