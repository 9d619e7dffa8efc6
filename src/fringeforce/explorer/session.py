"""One page's conversation with the server: the latest wish of each kind wins."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from fringeforce.design import load_strip, shipped_designs
from fringeforce.errors import FringeforceError, InputError
from fringeforce.explorer.protocol import (
    STRIP,
    DesignRequest,
    DownloadRequest,
    LiveRequest,
    ReadRequest,
    Request,
    encoded,
    request,
)
from fringeforce.explorer.tasks import Solved
from fringeforce.explorer.workers import Workers

if TYPE_CHECKING:
    from fringeforce.explorer.live import Live

Send = Callable[[bytes], Awaitable[None]]
ENDINGS = {"design": "toml", "model": "h5", "forces": "csv", "reading": "csv"}


class StaleDesignError(InputError):
    """A question about a design that another one has replaced meanwhile."""


@dataclass(frozen=True)
class Start:
    """Where a page begins: a Sensor or a Pad, and its pickled model where one was given."""

    sensor: Any
    model: bytes | None = None


@dataclass
class LatestWins:
    """Runs one wish of a kind at a time; of those that arrive meanwhile only the last is kept."""

    answer: Callable[[Request], Awaitable[None]]
    waiting: dict[str, Request] = field(default_factory=dict)
    running: dict[str, asyncio.Task[None]] = field(default_factory=dict)

    def put(self, kind: str, wish: Request) -> None:
        """Take a wish in."""
        self.waiting[kind] = wish
        if kind not in self.running:
            self.running[kind] = asyncio.ensure_future(self._run(kind))

    def close(self) -> None:
        """Forget everything."""
        for task in self.running.values():
            task.cancel()

    async def _run(self, kind: str) -> None:
        try:
            while kind in self.waiting:
                await self.answer(self.waiting.pop(kind))
        finally:
            del self.running[kind]


class Conversation(ABC):
    """What all pages' conversations have in common.

    Parameters
    ----------
    send : coroutine function
        Takes one frame to the page.
    """

    understood: ClassVar[TypeAdapter[Request]] = STRIP
    """What the page may ask."""

    def __init__(self, send: Send) -> None:
        self.send = send
        self.wishes = LatestWins(self._answer)

    @abstractmethod
    async def greet(self) -> None:
        """Say what there is."""

    async def receive(self, frame: bytes) -> None:
        """Take in one message of the page."""
        try:
            wish = request(frame, self.understood)
        except InputError as error:
            await self._refuse(None, error)
            return
        self.wishes.put(wish.slot if isinstance(wish, DesignRequest) else wish.type, wish)

    def close(self) -> None:
        """The page has gone."""
        self.wishes.close()

    @abstractmethod
    async def _fulfil(self, wish: Request) -> None:
        """Answer a request."""

    async def _answer(self, wish: Request) -> None:
        try:
            await self._fulfil(wish)
        except FringeforceError as error:
            await self._refuse(wish, error)
        except (ArithmeticError, ValueError, RuntimeError, MemoryError) as error:
            # numbers that a drawing may hold but arithmetic cannot: the page must hear of it
            await self._refuse(wish, InputError(f"This cannot be computed: {error}."))

    async def _refuse(self, wish: Request | None, error: Exception) -> None:
        stale = isinstance(error, StaleDesignError)
        header: dict[str, Any] = {"type": "refused", "text": str(error), "stale": stale}
        if wish is not None:
            header |= {"id": wish.id, "of": wish.type}
        if isinstance(wish, DesignRequest):
            header["slot"] = wish.slot
        await self._say(header)

    async def _say(
        self, header: Mapping[str, Any], blocks: Mapping[str, NDArray[Any]] | None = None
    ) -> None:
        await self.send(encoded(header, blocks))


class Session(Conversation):
    """What one page of a strip asked for last.

    Parameters
    ----------
    start : Start
        The design that the server was started with.
    workers : Workers
        Who computes.
    send : coroutine function
        Takes one frame to the page.
    live : Live, optional
        The camera, if there is one.
    """

    def __init__(
        self, start: Start, workers: Workers, send: Send, live: Live | None = None
    ) -> None:
        super().__init__(send)
        self.start, self.workers = start, workers
        self.current: tuple[int, Solved] | None = None
        self.watcher = None if live is None else live.watcher()

    async def greet(self) -> None:
        """Say which designs there are to start from, and whether there is a camera."""
        camera = self.watcher is not None
        await self._say({"type": "hello", "designs": list(shipped_designs()), "camera": camera})

    async def _fulfil(self, wish: Request) -> None:
        if isinstance(wish, DesignRequest):
            await self._design(wish)
        elif isinstance(wish, ReadRequest):
            await self._read(wish)
        elif isinstance(wish, LiveRequest):
            await self._look(wish)
        elif isinstance(wish, DownloadRequest):
            await self._download(wish)

    async def _design(self, wish: DesignRequest) -> None:
        base = Start(load_strip(wish.start)) if wish.start in shipped_designs() else self.start
        sensor = base.sensor.replace(**wish.changes)
        model = base.model if sensor == base.sensor else None
        solved = await self.workers.solve(sensor, model)
        if wish.slot == "main":
            self.current = wish.id, solved
        header = {"type": "model", "id": wish.id, "slot": wish.slot, **solved.facts}
        header["as_drawn"] = base.model is not None and model is None
        await self._say(header, solved.blocks)

    async def _read(self, wish: ReadRequest) -> None:
        model = self._model(wish)
        facts, blocks = await self.workers.shoot(model, wish.forces, wish.seed)
        await self._say({"type": "reading", "id": wish.id, "design": wish.design, **facts}, blocks)

    async def _look(self, wish: LiveRequest) -> None:
        if self.watcher is None:
            raise InputError("There is no camera; start the explorer with --camera.")
        facts, blocks = await self.watcher.next(wish.friction, wish.again)
        await self._say({"type": "live", "id": wish.id, **facts}, blocks)

    async def _download(self, wish: DownloadRequest) -> None:
        model = self._model(wish)
        content = await self.workers.file(wish.kind, model, wish.forces, wish.seed)
        name = f"{wish.kind}.{ENDINGS[wish.kind]}"
        octets = np.frombuffer(content, np.uint8)
        await self._say({"type": "file", "id": wish.id, "name": name}, {"content": octets})

    def _model(self, wish: ReadRequest | DownloadRequest) -> bytes:
        if self.current is None or self.current[0] != wish.design:
            raise StaleDesignError("This design is no longer the current one; ask again.")
        return self.current[1].model
