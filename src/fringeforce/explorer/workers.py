"""Processes that compute while the server listens, and what they found for the last designs."""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import shutil
import signal
import tempfile
import weakref
from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from fringeforce.base.child_process import end_with_parent
from fringeforce.explorer import tasks


class Worker:
    """One process that is started when needed, and again if it dies; it ends with this one.

    Parameters
    ----------
    patient : bool
        Whether it leaves the processor to others who want it.
    folder : str, optional
        What it removes if this process ends and cannot do so itself.
    """

    def __init__(self, patient: bool = False, folder: str | None = None) -> None:
        self._manner = patient, folder
        self._running: tuple[BaseProcess, Connection] | None = None
        self._line = ThreadPoolExecutor(1)
        """In which questions stand, and wait for their answers."""
        self._closed = False

    async def run(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """The function's result, computed in the process; once more if the process dies."""
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._line, self._asked, function, arguments)

    def close(self) -> None:
        """End the process, whatever it is doing."""
        self._closed = True
        if self._running is not None:
            self._running[0].kill()
        self._line.shutdown(cancel_futures=True)
        if self._running is not None:
            self._ended(*self._running)

    def _asked(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        for _ in range(2):
            if self._closed:
                break
            process, connection = self._running or self._started()
            try:
                connection.send((function, arguments))
                found, error = connection.recv()
            except (EOFError, OSError):
                self._ended(process, connection)
                continue
            if error is not None:
                raise error
            return found
        raise RuntimeError("the process that should have done it has ended")

    def _started(self) -> tuple[BaseProcess, Connection]:
        # a fresh interpreter, because the server's own has threads that must not be forked
        context = multiprocessing.get_context("spawn")
        connection, theirs = context.Pipe()
        process = context.Process(target=_work, args=(theirs, *self._manner), daemon=True)
        process.start()
        # with the only other end in the process, this one tells when it has died
        theirs.close()
        self._running = process, connection
        return self._running

    def _ended(self, process: BaseProcess, connection: Connection) -> None:
        connection.close()
        process.join()
        self._running = None


def _work(connection: Connection, patient: bool, folder: str | None) -> None:
    """Answer one question after another."""
    leave = partial(shutil.rmtree, folder, ignore_errors=True) if folder else bool
    server = end_with_parent(leave)
    # Ctrl+C in a terminal reaches every process; the server decides when this one ends
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # not every system knows the word
    if patient and hasattr(os, "nice"):
        os.nice(10)
    with suppress(EOFError, OSError):
        while True:
            function, arguments = connection.recv()
            try:
                answer = function(*arguments), None
            except Exception as error:
                answer = None, error
            connection.send(answer)
    server.join()


class Workers(ABC):
    """Processes for designs and for readings, and the files between them.

    Parameters
    ----------
    task : callable
        What characterises a design, `tasks.solve` or that of pads.
    remembered : int
        Number of designs whose solutions are kept: undo and comparisons come at once.
    patient : bool
        Whether readings leave the processor to others who want it.
    """

    def __init__(
        self, task: Callable[..., tasks.Solved], remembered: int, patient: bool = False
    ) -> None:
        self._task, self._remembered = task, remembered
        self._folder = tempfile.TemporaryDirectory(prefix="fringeforce-")
        self._designs, self._readings = Worker(folder=self._folder.name), Worker(patient)
        self._workers = [self._designs, self._readings]
        self._known: OrderedDict[str, tasks.Solved] = OrderedDict()

    async def solve(self, sensor: Any, model: bytes | None) -> tasks.Solved:
        """Solution of a design, remembered or new.

        Parameters
        ----------
        sensor : Sensor or Pad
            The design.
        model : bytes, optional
            Its pickled model, where there is one already.

        Raises
        ------
        InputError
            If the design cannot be explored.
        """
        key = f"{sensor.model_dump_json()} {model is not None}"
        if key not in self._known:
            solved = await self._designs.run(self._task, sensor, model, self._folder.name)
            # a page may still use a design that is no longer remembered
            weakref.finalize(solved, Path(solved.model).unlink, missing_ok=True)
            self._known[key] = solved
        self._known.move_to_end(key)
        while len(self._known) > self._remembered:
            self._known.popitem(last=False)
        return self._known[key]

    async def begin(self, sensor: Any, model: bytes | None) -> tasks.Solved:
        """Solution of the first design, after which a picture of it can be had at once."""
        return await self.solve(sensor, model)

    @abstractmethod
    async def warm(self, solved: tasks.Solved) -> None:
        """Let all workers load their libraries before anybody waits for them."""

    def close(self) -> None:
        """End the processes and remove their files."""
        for worker in self._workers:
            worker.close()
        self._folder.cleanup()


class StripWorkers(Workers):
    """One process for elements, one for readings."""

    def __init__(self) -> None:
        super().__init__(tasks.solve, remembered=6)
        self._insides: weakref.WeakKeyDictionary[tasks.Solved, tasks.Answer] = (
            weakref.WeakKeyDictionary()
        )

    async def inside(self, solved: tasks.Solved) -> tasks.Answer:
        """Figures of a design, and what is inside it."""
        if solved not in self._insides:
            self._insides[solved] = await self._designs.run(tasks.inside, solved.model)
        return self._insides[solved]

    async def shoot(self, solved: tasks.Solved, forces: tasks.Loads, seed: int) -> tasks.Answer:
        """One camera line and its reading."""
        return await self._readings.run(tasks.shoot, solved.model, forces, seed)

    async def file(self, kind: str, solved: tasks.Solved, forces: tasks.Loads, seed: int) -> bytes:
        """Contents of a file to download."""
        return await self._readings.run(tasks.file, kind, solved.model, forces, seed)

    async def warm(self, solved: tasks.Solved) -> None:
        """Let all workers load their libraries before anybody waits for them."""
        nothing = [[0.0, 0.0]] * len(solved.blocks["tactels"])
        await asyncio.gather(self.inside(solved), self.shoot(solved, nothing, 0))
