"""Readings as JSON over a WebSocket, a message for each block.

With a token, clients add ``?token=...`` to the address or send the header
``Authorization: Bearer ...``.
"""

from __future__ import annotations

import asyncio
import hmac
import re
import threading
from collections import deque
from http import HTTPStatus
from typing import Any
from urllib.parse import parse_qs, urlsplit

from fringeforce.acquisition.sinks.message import message
from fringeforce.acquisition.sinks.serving import LOOPBACK, address
from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.base.errors import InputError
from fringeforce.base.optional_libraries import extra
from fringeforce.base.words import counted

PORT = 8765
# messages that wait for one client; 13 s at 1,000 lines/s in blocks of 64
WAITING = 200
# pages that this computer serves; other sites' pages shall not read along
LOCAL_PAGE = re.compile(r"https?://(localhost|127\.0\.0\.1|\[::1\])(:\d+)?")


class WebSocketSink(Sink):
    """A WebSocket server; a client that is too slow loses its oldest messages, and only its own.

    Parameters
    ----------
    url : str
        Where to serve, "ws://127.0.0.1:8765" if host and port are left out.
    bind : str
        Host where the URL names none.
    token : str, optional
        What clients must show; needed where others can connect.

    Raises
    ------
    InputError
        If the address cannot be served, or needs a token.
    """

    def __init__(self, url: str = "ws:", bind: str = LOOPBACK, token: str | None = None) -> None:
        extra("websockets", "web")
        self._host, self._port = address(url, PORT, bind, token)
        self._token = token
        self._queues: dict[Any, _Waiting] = {}
        self._dropped = 0
        self._loop = asyncio.new_event_loop()
        self._stop = asyncio.Event()
        self._started = threading.Event()
        self._trouble: OSError | None = None
        self._thread = threading.Thread(target=self._run, name="websocket", daemon=True)
        self._thread.start()
        self._started.wait()
        if self._trouble:
            raise InputError(f"{url} cannot be served: {self._trouble.strerror or self._trouble}.")
        self.name = f"ws://{self._host}:{self._port}"

    @property
    def port(self) -> int:
        """The port that is served, also where 0 asked for any."""
        return self._port

    @property
    def remark(self) -> str:
        """How many clients there are and what the slow ones lost."""
        lost = f", {self._dropped} messages lost by slow clients" if self._dropped else ""
        count = len(self._queues)
        return f"{counted(count, 'clients')}{lost}"

    def write(self, readings: Readings) -> None:
        """Send a block to whoever listens; never waits for a client."""
        if self._queues:
            self._loop.call_soon_threadsafe(self._publish, message(readings))

    def close(self) -> None:
        """Say goodbye to all clients."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join(5)

    def _run(self) -> None:
        try:
            self._loop.run_until_complete(self._serve())
        except OSError as error:
            self._trouble = error
            self._started.set()
        finally:
            self._loop.close()

    async def _serve(self) -> None:
        from websockets.asyncio.server import serve

        origins = None if self._token else [None, LOCAL_PAGE]
        async with serve(
            self._attend,
            self._host,
            self._port,
            origins=origins,
            process_request=self._admit,
            # compressing costs more time than a local network takes
            compression=None,
            write_limit=2**16,
            close_timeout=1,
        ) as server:
            self._port = next(iter(server.sockets)).getsockname()[1]
            self._started.set()
            await self._stop.wait()
            await self._drain()

    async def _drain(self) -> None:
        """Let clients that keep up have the last messages."""
        for _ in range(50):
            if not any(waiting.messages for waiting in self._queues.values()):
                return
            await asyncio.sleep(0.02)

    def _admit(self, connection: Any, request: Any) -> Any:
        """Refuse a client without the token, where one is asked for."""
        if self._token is None:
            return None
        shown = parse_qs(urlsplit(request.path).query).get("token", [""])[0]
        shown = shown or request.headers.get("Authorization", "").removeprefix("Bearer ")
        if hmac.compare_digest(shown.encode(), self._token.encode()):
            return None
        return connection.respond(HTTPStatus.UNAUTHORIZED, "Show the token.\n")

    async def _attend(self, connection: Any) -> None:
        from websockets.exceptions import ConnectionClosed

        waiting = self._queues[connection] = _Waiting()
        listener = asyncio.create_task(connection.wait_closed())
        listener.add_done_callback(lambda _: waiting.there.set())
        try:
            while not listener.done():
                await waiting.there.wait()
                waiting.there.clear()
                while waiting.messages:
                    await connection.send(waiting.messages.popleft())
        except ConnectionClosed:
            pass
        finally:
            del self._queues[connection]

    def _publish(self, text: str) -> None:
        for waiting in self._queues.values():
            self._dropped += len(waiting.messages) == WAITING
            waiting.messages.append(text)
            waiting.there.set()


class _Waiting:
    """What one client has not taken yet."""

    def __init__(self) -> None:
        self.messages: deque[str] = deque(maxlen=WAITING)
        self.there = asyncio.Event()
