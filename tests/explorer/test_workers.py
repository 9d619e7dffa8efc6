"""A process that computes ends and begins again whatever it is doing."""

import asyncio
import os
import signal
import time
from pathlib import Path

import pytest

from fringeforce.explorer.workers import Worker


def large(size: int) -> bytes:
    return bytes(size)


def slow_to_write(folder: str) -> "SlowToWrite":
    return SlowToWrite(folder)


class SlowToWrite:
    """A result of which a pipe takes a part, before it says that its sender may be ended."""

    def __init__(self, folder: str) -> None:
        self.folder = folder

    def __reduce__(self) -> tuple[object, ...]:
        Path(self.folder, "writing").touch()
        return bytes, (bytes(1 << 27),)


def ended() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def failing() -> None:
    raise ValueError("told so")


def once(folder: str) -> int:
    """The number of this process, the second time; the first one dies of it."""
    path = Path(folder, "begun")
    if not path.exists():
        path.touch()
        ended()
    return os.getpid()


def test_results_and_errors_come_back_in_turn() -> None:
    async def asked() -> None:
        worker = Worker()
        results = await asyncio.gather(*(worker.run(large, n) for n in (3, 1 << 20, 0)))
        assert [len(one) for one in results] == [3, 1 << 20, 0]
        with pytest.raises(ValueError, match="told so"):
            await worker.run(failing)
        assert await worker.run(pow, 2, 3) == 8
        worker.close()

    asyncio.run(asked())


def test_a_process_that_dies_is_started_again_once(tmp_path: Path) -> None:
    async def asked() -> None:
        worker = Worker()
        assert await worker.run(once, str(tmp_path)) != os.getpid()
        with pytest.raises(RuntimeError, match="has ended"):
            await worker.run(ended)
        assert await worker.run(len, "three") == 5
        worker.close()

    asyncio.run(asked())


def test_who_gives_up_does_not_get_in_the_way_of_the_next() -> None:
    async def asked() -> None:
        worker = Worker()
        assert await worker.run(len, "") == 0
        first = asyncio.ensure_future(worker.run(time.sleep, 0.3))
        await asyncio.sleep(0.1)
        first.cancel()
        assert await worker.run(len, "three") == 5
        assert first.cancelled()
        worker.close()

    asyncio.run(asked())


@pytest.mark.parametrize("pause", [0.0, 0.01, 0.05])
def test_it_ends_while_a_result_is_on_its_way(tmp_path: Path, pause: float) -> None:
    async def asked() -> None:
        worker = Worker()
        asking = asyncio.ensure_future(worker.run(slow_to_write, str(tmp_path)))
        while not (tmp_path / "writing").exists():
            await asyncio.sleep(0.001)
        await asyncio.sleep(pause)
        worker.close()
        (result,) = await asyncio.gather(asking, return_exceptions=True)
        # a result that was complete by then is as good
        assert isinstance(result, RuntimeError | bytes)

    asyncio.run(asyncio.wait_for(asked(), 60))
