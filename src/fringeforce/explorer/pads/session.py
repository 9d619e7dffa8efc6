"""One page's conversation about a pad."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fringeforce.design import load_sensor, shipped_pads
from fringeforce.explorer.pads.protocol import (
    PAD,
    PadDownloadRequest,
    PadReadRequest,
    PressedRequest,
    PressRequest,
    SlicesRequest,
)
from fringeforce.explorer.protocol import DesignRequest, Request
from fringeforce.explorer.session import ENDINGS, Conversation, Send, StaleDesignError, Start

if TYPE_CHECKING:
    from fringeforce.explorer.pads.workers import PadWorkers, SolvedPad


class PadSession(Conversation):
    """What one page asked for last.

    Parameters
    ----------
    start : Start
        The design that the server was started with.
    workers : PadWorkers
        Who computes.
    send : coroutine function
        Takes one frame to the page.
    """

    understood = PAD

    def __init__(self, start: Start, workers: PadWorkers, send: Send) -> None:
        super().__init__(send)
        self.start, self.workers = start, workers
        self.current: tuple[int, SolvedPad] | None = None

    async def greet(self) -> None:
        """Say which designs there are to start from."""
        await self._say({"type": "hello", "designs": list(shipped_pads())})

    async def _fulfil(self, wish: Request) -> None:
        if isinstance(wish, DesignRequest):
            await self._design(wish)
        elif isinstance(wish, PressRequest):
            seen = self.workers.press(*self._pressed(wish), wish.view, wish.fine, wish.seed)
            facts, blocks = await seen
            header = {"type": "picture", "view": wish.view, "fine": wish.fine, **facts}
            await self._say({**header, "id": wish.id, "design": wish.design}, blocks)
        elif isinstance(wish, SlicesRequest):
            facts, blocks = await self.workers.slices(*self._pressed(wish))
            await self._say(
                {"type": "slices", "id": wish.id, "design": wish.design, **facts}, blocks
            )
        elif isinstance(wish, PadReadRequest):
            facts, blocks = await self.workers.read(*self._pressed(wish), wish.seed)
            header = {"type": "reading", "id": wish.id, "design": wish.design, **facts}
            await self._say(header, blocks)
        elif isinstance(wish, PadDownloadRequest):
            content = await self.workers.file(wish.kind, *self._pressed(wish), wish.seed)
            name = f"{wish.kind}.{ENDINGS[wish.kind]}"
            octets = np.frombuffer(content, np.uint8)
            await self._say({"type": "file", "id": wish.id, "name": name}, {"content": octets})

    async def _design(self, wish: DesignRequest) -> None:
        shipped = wish.start in shipped_pads()
        base = Start(load_sensor(wish.start)) if shipped else self.start
        sensor = base.sensor.replace(**wish.changes)
        model = base.model if sensor == base.sensor else None
        solved = await self.workers.solve(sensor, model)
        self.current = wish.id, solved
        await self._say({"type": "model", "id": wish.id, "slot": wish.slot, **solved.facts})

    def _pressed(self, wish: PressedRequest) -> tuple[SolvedPad, tuple]:
        if self.current is None or self.current[0] != wish.design:
            raise StaleDesignError("This design is no longer the current one; ask again.")
        return self.current[1], tuple(touch.contact for touch in wish.contacts)
