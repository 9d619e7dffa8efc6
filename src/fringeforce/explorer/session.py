"""One page's conversation with the server: the latest wish of each topic wins."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from fringeforce.base.errors import FringeforceError, InputError
from fringeforce.design.files import load_sensor
from fringeforce.design.materials import by_strain
from fringeforce.explorer.page import Page
from fringeforce.explorer.protocol import (
    AboutDesign,
    DesignRequest,
    LiveRequest,
    Request,
    encoded,
    request,
)
from fringeforce.explorer.tasks import Solved
from fringeforce.explorer.workers import Workers

if TYPE_CHECKING:
    from fringeforce.explorer.live import Live

Send = Callable[[bytes], Awaitable[None]]


class StaleDesignError(InputError):
    """A question about a design that another one has replaced meanwhile."""


@dataclass(frozen=True)
class FirstDesign:
    """Where a page begins: a Sensor or a Pad, and its pickled model where one was given."""

    sensor: Any
    model: bytes | None = None


@dataclass
class LatestWins:
    """Runs one wish of a topic at a time; of those that arrive meanwhile only the last is kept."""

    answer: Callable[[Request], Awaitable[None]]
    waiting: dict[str, Request] = field(default_factory=dict)
    running: dict[str, asyncio.Task[None]] = field(default_factory=dict)

    def put(self, wish: Request) -> None:
        """Take a wish in."""
        self.waiting[wish.topic] = wish
        if wish.topic not in self.running:
            self.running[wish.topic] = asyncio.ensure_future(self._run(wish.topic))

    def close(self) -> None:
        """Forget everything."""
        for task in self.running.values():
            task.cancel()

    async def _run(self, topic: str) -> None:
        try:
            while topic in self.waiting:
                await self.answer(self.waiting.pop(topic))
        finally:
            del self.running[topic]


class Session:
    """One page's conversation: what it asked for last.

    Parameters
    ----------
    page : Page
        What kind of page it is.
    start : FirstDesign
        The design that the server was started with.
    workers : Workers
        Who computes.
    send : coroutine function
        Takes one frame to the page.
    live : Live, optional
        The camera, if there is one.
    """

    def __init__(
        self, page: Page, start: FirstDesign, workers: Workers, send: Send, live: Live | None = None
    ) -> None:
        self.page, self.start, self.workers = page, start, workers
        self.watcher = None if live is None else live.watcher()
        self._send = send
        self.wishes = LatestWins(self._answer)
        self.designs: dict[str, tuple[int, Solved]] = {}
        """The last one of each slot, by the number of its wish."""

    async def greet(self) -> None:
        """Say what there is, and whether there is a camera."""
        there = self.watcher is not None
        await self._say({"type": "hello", "designs": list(self.page.shipped()), "camera": there})

    async def receive(self, frame: bytes) -> None:
        """Take in one message of the page."""
        try:
            wish = request(frame, self.page.understood)
        except InputError as error:
            await self._refuse(None, error)
            return
        self.wishes.put(wish)

    def close(self) -> None:
        """The page has gone."""
        self.wishes.close()

    async def _design(self, wish: DesignRequest) -> None:
        shipped = wish.start in self.page.shipped()
        base = FirstDesign(by_strain(load_sensor(wish.start))) if shipped else self.start
        sensor = base.sensor.replace(**wish.changes)
        model = base.model if sensor == base.sensor else None
        solved = await self.workers.solve(sensor, model)
        self.designs[wish.slot] = wish.id, solved
        header = {"type": "model", "id": wish.id, "slot": wish.slot, **solved.facts}
        header["as_drawn"] = base.model is not None and model is None
        await self._say(header, solved.blocks)

    def _solved(self, design: int) -> Solved:
        """A design that the page still shows, by the number of its wish."""
        for number, solved in self.designs.values():
            if number == design:
                return solved
        raise StaleDesignError("This design is no longer the current one; ask again.")

    async def _answer(self, wish: Request) -> None:
        try:
            if isinstance(wish, DesignRequest):
                await self._design(wish)
            elif isinstance(wish, LiveRequest):
                await self._look(wish)
            elif isinstance(wish, AboutDesign):
                await self._tell(wish)
        except FringeforceError as error:
            await self._refuse(wish, error)
        except (ArithmeticError, ValueError, RuntimeError, MemoryError) as error:
            # numbers that a drawing may hold but arithmetic cannot: the page must hear of it
            await self._refuse(wish, InputError(f"This cannot be computed: {error}."))

    async def _look(self, wish: LiveRequest) -> None:
        if self.watcher is None:
            raise InputError("There is no camera; start the explorer with --camera.")
        facts, blocks = await self.watcher.next(wish.friction, wish.again)
        await self._say({"type": "live", "id": wish.id, **facts}, blocks)

    async def _refuse(self, wish: Request | None, error: Exception) -> None:
        stale = isinstance(error, StaleDesignError)
        header: dict[str, Any] = {"type": "refused", "text": str(error), "stale": stale}
        if wish is not None:
            header |= {"id": wish.id, "of": wish.type}
        if isinstance(wish, DesignRequest):
            header["slot"] = wish.slot
        await self._say(header)

    async def _tell(self, wish: AboutDesign) -> None:
        """Answer a question about a design."""
        facts, blocks = await self.workers.ask(self._solved(wish.design), wish)
        kind = self.page.questions[type(wish)].answer
        await self._say({"type": kind, "id": wish.id, "design": wish.design, **facts}, blocks)

    async def _say(
        self, header: Mapping[str, Any], blocks: Mapping[str, NDArray[Any]] | None = None
    ) -> None:
        await self._send(encoded(header, blocks))
