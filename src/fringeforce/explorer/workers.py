"""Processes that compute while the server listens, and what they found for the last designs."""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import signal
import tempfile
import traceback
import warnings
import weakref
from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any

from fringeforce.base.child_process import end_with_parent
from fringeforce.base.errors import LargeStrainWarning
from fringeforce.explorer.page import Page, Process
from fringeforce.explorer.protocol import AboutDesign
from fringeforce.explorer.tasks import Answer, Solved, solve

NICENESS = 5
"""By how much a process that may take long steps back: beside processes that are busy all the time
it still gets a third of what each of these gets, where 10 would leave a tenth."""


class Worker:
    """One process that is started when needed, and again if it dies; it ends with this one.

    Results come through a pipe whose other end the process alone holds, so that its end is noticed
    whatever it was doing.  A process pool waits for ever for a result of which it has a part.

    Parameters
    ----------
    patient : bool
        Whether it leaves the processor to others who want it.
    folder : str, optional
        What it removes when it ends with this process, which may be unable to do so itself.
    """

    def __init__(self, patient: bool = False, folder: str | None = None) -> None:
        self._manner = patient, folder
        self._running: tuple[SpawnProcess, Connection] | None = None
        self._closed, self._turn = False, asyncio.Lock()

    async def run(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """The function's result, computed in the process; once more if the process dies."""
        async with self._turn:
            asked = asyncio.ensure_future(self._answered(function, arguments))
            try:
                return await asyncio.shield(asked)
            except asyncio.CancelledError:
                # or its answer would be taken for the next one's
                await asyncio.gather(asked, return_exceptions=True)
                raise

    async def _answered(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        for _ in range(2):
            if self._closed:
                break
            process, pipe = self._running = self._running or self._started()
            try:
                done, result = await asyncio.to_thread(_exchanged, pipe, (function, arguments))
            except (EOFError, OSError):
                self._running = None
                _ended(process, pipe)
                continue
            if not done:
                raise result
            return result
        raise RuntimeError("the process that should have done it has ended")

    def close(self) -> None:
        """End the process, whatever it is doing."""
        self._closed = True
        if self._running is not None:
            self._running[0].kill()
            self._running[0].join()

    def _started(self) -> tuple[SpawnProcess, Connection]:
        # a fresh interpreter, because the server's own has threads that must not be forked
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=_serve, args=(theirs, *self._manner), daemon=True)
        process.start()
        theirs.close()
        return process, ours


def _exchanged(pipe: Connection, task: Any) -> Any:
    pipe.send(task)
    return pipe.recv()


def _ended(process: SpawnProcess, pipe: Connection) -> None:
    process.kill()
    process.join()
    pipe.close()


def _serve(pipe: Connection, patient: bool, folder: str | None) -> None:
    """Do what comes through a pipe, as long as the process at its other end lives."""
    ending = end_with_parent(folder)
    # Ctrl+C in a terminal reaches every process; the server decides when this one ends
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # not every system knows the word
    if patient and hasattr(os, "nice"):
        os.nice(NICENESS)
    # pages say from which force on strain is large
    warnings.simplefilter("ignore", LargeStrainWarning)
    with suppress(EOFError, OSError):
        while True:
            function, arguments = pipe.recv()
            pipe.send(_done(function, arguments))
    # the pipe closes when the other process ends, and what was in its folder is still to go
    ending.join()


def _done(function: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[bool, Any]:
    """Whether a function returned, and what; or the error that it raised."""
    try:
        return True, function(*arguments)
    except Exception as error:
        error.add_note(traceback.format_exc())
        return False, error


class Workers:
    """Processes of the pages of one kind of sensor, and the files between them.

    Parameters
    ----------
    page : Page
        What pages of that kind ask.
    """

    def __init__(self, page: Page) -> None:
        self._page = page
        self._folder = tempfile.TemporaryDirectory(prefix="fringeforce-")
        self._workers = {
            Process.DESIGNS: Worker(folder=self._folder.name),
            Process.ANSWERS: Worker(),
            Process.SLOW: Worker(patient=True),
        }
        self._known: OrderedDict[str, Solved] = OrderedDict()

    async def solve(self, sensor: Any, model: bytes | None) -> Solved:
        """Solution of a design, remembered or new.

        Parameters
        ----------
        sensor : Sensor or Pad
            The design.
        model : bytes, optional
            Pickled model of the design, where there is one already.

        Raises
        ------
        InputError
            If the design cannot be explored.
        """
        key = f"{sensor.model_dump_json()} {model is not None}"
        if key not in self._known:
            designs = self._workers[Process.DESIGNS]
            task = self._page.solution, sensor, model, self._folder.name
            solved = await designs.run(solve, *task)
            # a page may still ask about a design that is no longer remembered
            weakref.finalize(solved, Path(solved.model).unlink, missing_ok=True)
            self._known[key] = solved
        self._known.move_to_end(key)
        while len(self._known) > self._page.remembered:
            self._known.popitem(last=False)
        return self._known[key]

    async def ask(self, solved: Solved, wish: AboutDesign) -> Answer:
        """Answer to a question about a design that was solved."""
        question = self._page.questions[type(wish)]
        return await self._workers[question.process].run(question.task, solved.model, wish)

    async def begin(self, sensor: Any, model: bytes | None) -> Solved:
        """Solution of the first design, after which a picture of it can be had at once."""
        prepare, answers = self._page.prepare, self._workers[Process.ANSWERS]
        preparing = [] if prepare is None else [answers.run(prepare)]
        solved, *_ = await asyncio.gather(self.solve(sensor, model), *preparing)
        for wish in self._page.first:
            await self.ask(solved, wish)
        return solved

    async def warm(self, solved: Solved) -> None:
        """Let all workers load their libraries before anybody waits for them."""
        await asyncio.gather(*(self.ask(solved, wish) for wish in self._page.warm(solved)))

    def close(self) -> None:
        """End the processes and remove their files."""
        for worker in self._workers.values():
            worker.close()
        self._folder.cleanup()
