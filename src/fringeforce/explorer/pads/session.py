"""One page's conversation about a pad."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fringeforce.design.files import shipped_pads
from fringeforce.explorer.pads.protocol import (
    PAD,
    PadDownloadRequest,
    PadReadRequest,
    PressedRequest,
    PressRequest,
    SlicesRequest,
)
from fringeforce.explorer.protocol import Request
from fringeforce.explorer.session import Conversation, Send, Start

if TYPE_CHECKING:
    from fringeforce.explorer.live import Live
    from fringeforce.explorer.pads.tasks import Contacts
    from fringeforce.explorer.pads.workers import PadWorkers
    from fringeforce.explorer.tasks import Solved


class PadSession(Conversation):
    """What one page of a pad asked for last.

    Parameters
    ----------
    start, workers, send, live
        As for every conversation.
    """

    understood = PAD

    def __init__(
        self, start: Start, workers: PadWorkers, send: Send, live: Live | None = None
    ) -> None:
        super().__init__(start, workers, send, shipped_pads(), live)
        self.workers = workers

    async def _fulfil(self, wish: Request) -> None:
        workers = self.workers
        if isinstance(wish, PressRequest):
            seen = await workers.press(*self._pressed(wish), wish.view, wish.fine, wish.seed)
            await self._tell("picture", wish, seen)
        elif isinstance(wish, SlicesRequest):
            await self._tell("slices", wish, await workers.slices(*self._pressed(wish)))
        elif isinstance(wish, PadReadRequest):
            read = await workers.read(*self._pressed(wish), wish.seed)
            await self._tell("reading", wish, read)
        elif isinstance(wish, PadDownloadRequest):
            content = await workers.file(wish.kind, *self._pressed(wish), wish.seed)
            await self._hand(wish.kind, wish, content)

    def _pressed(self, wish: PressedRequest) -> tuple[Solved, Contacts]:
        return self._solved(wish.design), tuple(touch.contact for touch in wish.contacts)
