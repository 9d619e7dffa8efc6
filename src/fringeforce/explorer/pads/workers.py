"""Processes for the page of a pad: one for designs, one for pictures, one for readings."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from fringeforce.explorer.pads import tasks
from fringeforce.explorer.tasks import Solved
from fringeforce.explorer.workers import Worker, Workers

if TYPE_CHECKING:
    from fringeforce.design.pad import Pad


class PadWorkers(Workers):
    """One more process, for pictures."""

    def __init__(self) -> None:
        super().__init__(tasks.solve, remembered=4, patient=True)
        self._pictures = Worker()
        self._workers.append(self._pictures)

    async def press(
        self, solved: Solved, contacts: tasks.Contacts, view: str, fine: bool, seed: int
    ) -> tasks.Answer:
        """Forces of the tactels and a picture."""
        return await self._pictures.run(tasks.press, solved.model, contacts, view, fine, seed)

    async def slices(self, solved: Solved, contacts: tasks.Contacts) -> tasks.Answer:
        """Retardance of every slice."""
        return await self._pictures.run(tasks.slices, solved.model, contacts)

    async def read(self, solved: Solved, contacts: tasks.Contacts, seed: int) -> tasks.Answer:
        """One noisy frame's reading."""
        return await self._readings.run(tasks.read, solved.model, contacts, seed)

    async def file(self, kind: str, solved: Solved, contacts: tasks.Contacts, seed: int) -> bytes:
        """Contents of a file to download."""
        return await self._readings.run(tasks.file, kind, solved.model, contacts, seed)

    async def begin(self, sensor: Pad, model: bytes | None) -> Solved:
        """Solution of the first design, after which a picture of it can be had at once."""
        solving = asyncio.ensure_future(super().begin(sensor, model))
        await self._pictures.run(tasks.prepare)
        solved = await solving
        await self.press(solved, (), "white", False, 0)
        return solved

    async def warm(self, solved: Solved) -> None:
        """Let the reader load its libraries before anybody waits for it."""
        await self.read(solved, (), 0)
