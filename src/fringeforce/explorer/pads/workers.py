"""Processes for the page of a pad: one for designs, one for pictures, one for readings."""

from __future__ import annotations

import tempfile
import weakref
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fringeforce.explorer.pads import tasks
from fringeforce.explorer.workers import Worker

if TYPE_CHECKING:
    from fringeforce.pads.design import Pad

REMEMBERED = 4
"""Designs whose models are kept: undo comes at once."""


@dataclass(frozen=True, eq=False)
class SolvedPad:
    """A design that was characterised.

    Attributes
    ----------
    path : str
        File of its model, which lasts as long as this.
    facts : mapping
        JSON values for the page.
    """

    path: str
    facts: Mapping[str, Any]


class PadWorkers:
    """The processes, the files between them, and what they found for the designs asked last."""

    def __init__(self) -> None:
        self._designs, self._pictures = Worker(), Worker()
        self._readings = Worker(patient=True)
        self._folder = tempfile.TemporaryDirectory(prefix="fringeforce-")
        self._known: OrderedDict[str, SolvedPad] = OrderedDict()

    async def solve(self, sensor: Pad, model: bytes | None) -> SolvedPad:
        """Model of a design, remembered or new.

        Parameters
        ----------
        sensor : Pad
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
            facts, path = await self._designs.run(tasks.solve, sensor, model, self._folder.name)
            self._known[key] = SolvedPad(path, facts)
            # a page may still press on a design that is no longer remembered
            weakref.finalize(self._known[key], Path(path).unlink, missing_ok=True)
        self._known.move_to_end(key)
        while len(self._known) > REMEMBERED:
            self._known.popitem(last=False)
        return self._known[key]

    async def press(
        self, model: SolvedPad, contacts: tasks.Contacts, view: str, fine: bool, seed: int
    ) -> tasks.Answer:
        """Forces of the tactels and a picture."""
        return await self._pictures.run(tasks.press, model.path, contacts, view, fine, seed)

    async def slices(self, model: SolvedPad, contacts: tasks.Contacts) -> tasks.Answer:
        """Retardance of every slice."""
        return await self._pictures.run(tasks.slices, model.path, contacts)

    async def read(self, model: SolvedPad, contacts: tasks.Contacts, seed: int) -> tasks.Answer:
        """One noisy frame's reading."""
        return await self._readings.run(tasks.read, model.path, contacts, seed)

    async def file(self, kind: str, model: SolvedPad, contacts: tasks.Contacts, seed: int) -> bytes:
        """Contents of a file to download."""
        return await self._readings.run(tasks.file, kind, model.path, contacts, seed)

    async def warm(self, sensor: Pad, model: bytes | None) -> None:
        """Let pictures and readings load their libraries before anybody waits for them."""
        solved = await self.solve(sensor, model)
        for fine in (False, True):
            await self.press(solved, (), "white", fine, 0)
        await self.read(solved, (), 0)

    def close(self) -> None:
        """End the processes and remove their files."""
        for worker in (self._designs, self._pictures, self._readings):
            worker.close()
        self._folder.cleanup()
