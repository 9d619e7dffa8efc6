"""Processes that compute while the server listens: one for elements, one for readings."""

from __future__ import annotations

import asyncio
import multiprocessing
import os
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from fringeforce.design import Sensor
from fringeforce.explorer import tasks

REMEMBERED = 6
"""Designs whose solutions are kept: undo and comparisons come at once."""


class Worker:
    """One process that is started when needed and again if it dies.

    Parameters
    ----------
    patient : bool
        Whether it leaves the processor to others who want it.
    """

    def __init__(self, patient: bool = False) -> None:
        self._start = _step_back if patient else None
        self._pool: ProcessPoolExecutor | None = None

    async def run(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """The function's result, computed in the process; once more if the process dies."""
        try:
            return await self._submitted(function, *arguments)
        except BrokenProcessPool:
            self.close()
            return await self._submitted(function, *arguments)

    def close(self) -> None:
        """End the process once it is idle."""
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
            self._pool = None

    async def _submitted(self, function: Callable[..., Any], *arguments: Any) -> Any:
        if self._pool is None:
            # a fresh interpreter, because the server's own has threads that must not be forked
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(1, context, self._start)
        return await asyncio.wrap_future(self._pool.submit(function, *arguments))


def _step_back() -> None:
    # not every system knows the word
    if hasattr(os, "nice"):
        os.nice(10)


class Workers:
    """Both processes, and what they found for the designs asked last."""

    def __init__(self) -> None:
        self._elements, self._readings = Worker(), Worker()
        self._known: OrderedDict[str, tasks.Solved] = OrderedDict()

    async def solve(self, sensor: Sensor, model: bytes | None) -> tasks.Solved:
        """Solution of a design, remembered or new.

        Parameters
        ----------
        sensor : Sensor
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
            self._known[key] = await self._elements.run(tasks.solve, sensor, model)
        self._known.move_to_end(key)
        while len(self._known) > REMEMBERED:
            self._known.popitem(last=False)
        return self._known[key]

    async def shoot(self, model: bytes, forces: tasks.Loads, seed: int) -> tasks.Answer:
        """One camera line and its reading."""
        return await self._readings.run(tasks.shoot, model, forces, seed)

    async def file(self, kind: str, model: bytes, forces: tasks.Loads, seed: int) -> bytes:
        """Contents of a file to download."""
        return await self._readings.run(tasks.file, kind, model, forces, seed)

    async def warm(self, sensor: Sensor, model: bytes | None) -> None:
        """Let the reading worker load its libraries before anybody waits for it."""
        solved = await self.solve(sensor, model)
        await self.shoot(solved.model, [[0.0] * sensor.tactels.count] * 2, 0)

    def close(self) -> None:
        """End both processes."""
        self._elements.close()
        self._readings.close()
