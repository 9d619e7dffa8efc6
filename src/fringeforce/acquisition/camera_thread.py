"""The camera's thread: it never waits for the reader, and finds a lost camera again."""

from __future__ import annotations

import threading
from collections import deque

from fringeforce.acquisition.cameras.camera import Block, Camera
from fringeforce.acquisition.consecutive import taken
from fringeforce.acquisition.run_statistics import RunStatistics
from fringeforce.base.errors import CameraLost

PAUSE, LONGEST_PAUSE = 0.25, 8.0
"""Time before a lost camera is looked for again, at first and at most [s]."""


class CameraThread:
    """Blocks of a camera through a bounded queue.

    When the queue is full, a camera that waits for nobody loses all that is in it, which is
    counted; a patient one, such as a file, waits.  Whoever follows the lines from one to the next
    then stumbles over one gap and has a whole queue to recover, instead of a gap at every block.

    Parameters
    ----------
    camera : Camera
        Not yet connected.
    depth : int
        Blocks in the queue.
    counts : RunStatistics
        Counts what is lost.
    """

    def __init__(self, camera: Camera, depth: int, counts: RunStatistics) -> None:
        self._camera, self._depth, self._counts = camera, depth, counts
        self._blocks: deque[Block] = deque()
        self._change = threading.Condition()
        self._stopping = threading.Event()
        self._ended = False
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="camera", daemon=True)

    def start(self) -> None:
        """Connect and begin."""
        self._thread.start()

    def next(self, timeout: float, together: int = 1) -> Block | None:
        """The next block, or None if there is none yet.

        Parameters
        ----------
        timeout : float
            How long to wait for it [s].
        together : int
            Frames up to which blocks that wait are handed over as one, an eighth of the queue at
            most.

        Raises
        ------
        StopIteration
            If the camera has ended and everything was taken.
        FringeforceError
            What ended the camera.
        """
        with self._change:
            self._change.wait_for(lambda: self._blocks or self._ended, timeout)
            if self._blocks:
                most = min(together, self._depth // 8 * len(self._blocks[0]))
                found = taken(self._blocks, most)
                self._change.notify_all()
                return Block.joined(found)
            if self._error:
                raise self._error
            if self._ended:
                raise StopIteration
            return None

    def stop(self) -> None:
        """End the camera; what was not taken counts as dropped."""
        self._stopping.set()
        self._camera.close()
        with self._change:
            self._change.notify_all()
        self._thread.join(5)
        with self._change:
            self._counts.dropped(queue=sum(len(block) for block in self._blocks))
            self._blocks.clear()

    def _run(self) -> None:
        try:
            self._acquire()
        except BaseException as error:  # handed over to whoever takes the next block
            self._error = error
        with self._change:
            self._ended = True
            self._change.notify_all()

    def _acquire(self) -> None:
        seen, lost, pause = False, False, PAUSE
        while not self._stopping.is_set():
            try:
                with self._camera as camera:
                    for block in camera:
                        if lost:
                            self._counts.camera_back()
                        seen, lost, pause = True, False, PAUSE
                        self._put(block)
                        if self._stopping.is_set():
                            return
                return
            except CameraLost as reason:
                if not seen:
                    raise  # it was never there: better to say so than to wait for ever
                lost = True
                self._counts.camera_lost(str(reason))
            self._stopping.wait(pause)
            pause = min(2 * pause, LONGEST_PAUSE)

    def _put(self, block: Block) -> None:
        self._counts.dropped(camera=block.dropped)
        with self._change:
            if self._camera.patient:
                self._change.wait_for(
                    lambda: len(self._blocks) < self._depth or self._stopping.is_set()
                )
            elif len(self._blocks) >= self._depth:
                self._counts.dropped(queue=sum(len(old) for old in self._blocks))
                self._blocks.clear()
            self._blocks.append(block)
            self._change.notify_all()
