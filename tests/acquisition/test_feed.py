"""The queue between a camera and a reader."""

import threading
from collections.abc import Iterator
from functools import partial
from typing import Self

import numpy as np

from fringeforce.acquisition.camera_thread import CameraThread
from fringeforce.acquisition.cameras.camera import Block
from fringeforce.acquisition.run_statistics import RunStatistics


class Ready:
    """A camera whose blocks are all there at once."""

    name, patient = "ready", False

    def __init__(self, blocks: list[Block]) -> None:
        self.blocks, self.over = blocks, threading.Event()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        self.over.set()

    def __iter__(self) -> Iterator[Block]:
        yield from self.blocks

    def close(self) -> None:
        pass


def block(first: int, size: int, dropped: int = 0) -> Block:
    numbers = np.arange(first, first + size)
    return Block(np.repeat(numbers[:, None], 3, axis=1), numbers / 10, dropped, first)


def handed_over(blocks: list[Block], together: int) -> list[Block]:
    """What a feed hands over when all blocks of a camera wait."""
    camera = Ready(blocks)
    camera_thread = CameraThread(camera, 64, RunStatistics())
    camera_thread.start()
    assert camera.over.wait(20)
    found = list(iter(partial(_next, camera_thread, together), None))
    camera_thread.stop()
    return found


def _next(camera_thread: CameraThread, together: int) -> Block | None:
    try:
        return camera_thread.next(1.0, together)
    except StopIteration:
        return None


def test_blocks_that_wait_are_handed_over_together() -> None:
    found = handed_over([block(4 * k, 4) for k in range(7)], together=12)
    assert [len(one) for one in found] == [12, 12, 4]
    assert [one.first for one in found] == [0, 12, 24]
    np.testing.assert_array_equal(np.concatenate([one.lines[:, 0] for one in found]), range(28))
    np.testing.assert_array_equal(
        np.concatenate([one.timestamps for one in found]), np.arange(28) / 10
    )


def test_one_that_is_larger_comes_whole_and_alone() -> None:
    found = handed_over([block(0, 20), block(20, 4), block(24, 4)], together=10)
    assert [len(one) for one in found] == [20, 8]


def test_nothing_is_joined_across_lines_that_were_lost() -> None:
    found = handed_over([block(0, 4), block(4, 4), block(10, 4, dropped=2)], together=100)
    assert [(one.first, len(one), one.dropped) for one in found] == [(0, 8, 0), (10, 4, 2)]
