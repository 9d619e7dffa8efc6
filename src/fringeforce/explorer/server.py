"""The server: a page, one WebSocket, and nothing for anybody else."""

from __future__ import annotations

import asyncio
import errno
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, closing, suppress
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import FileResponse
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

from fringeforce.base.errors import InputError
from fringeforce.explorer.page import page_of
from fringeforce.explorer.patience import Patience
from fringeforce.explorer.protocol import MAX_REQUEST
from fringeforce.explorer.security import Guard
from fringeforce.explorer.session import FirstDesign, Session
from fringeforce.explorer.tasks import model_of
from fringeforce.explorer.workers import Workers

if TYPE_CHECKING:
    from fringeforce.explorer.live import Live, Source

STATIC = Path(__file__).parent / "static"
MOST_PAGES = 8
"""Pages that may be open at a time."""
HEARD_WITHIN = 0.1
"""Seconds within which the server hears that it is to end, before the first picture is there."""


def application(
    start: FirstDesign,
    token: str,
    ready: Callable[[], object] = bool,
    camera: Source | None = None,
    ended: Callable[[], bool] = bool,
) -> Guard:
    """The explorer as an ASGI application.

    Parameters
    ----------
    start : FirstDesign
        What pages show first.
    token : str
        First part of every path; whoever does not know it gets nothing.
    ready : callable
        Called once the first picture can be had at once.
    camera : Source, optional
        Pages can watch it; it is started when the first one does.
    ended : callable
        Whether the server is to end, which is asked while the first picture is computed.
    """
    page = page_of(start.sensor)
    if camera is not None and start.sensor.skin is not None:
        raise InputError(
            "The page of a skin shows no camera yet; watch one with `fringeforce live`."
        )
    workers = Workers(page)
    sessions: set[Session] = set()
    live: Live | None = None

    @asynccontextmanager
    async def lifespan(_: Starlette) -> AsyncIterator[None]:
        nonlocal live
        with closing(workers):
            beginning = asyncio.ensure_future(workers.begin(start.sensor, start.model))
            while not (await asyncio.wait([beginning], timeout=HEARD_WITHIN))[0]:
                if ended():
                    workers.close()
                    await asyncio.gather(beginning, return_exceptions=True)
                    yield
                    return
            solved = beginning.result()
            if camera is not None:
                # only a camera brings a reader's libraries into this process
                from fringeforce.explorer.live import Live

                display = resolve_name(page.display)(model_of(solved.model))
                live = Live(display, camera)
            warming = asyncio.ensure_future(workers.warm(solved))
            ready()
            yield
            warming.cancel()
            if live is not None:
                await asyncio.to_thread(live.close)

    async def converse(websocket: WebSocket) -> None:
        if len(sessions) >= MOST_PAGES:
            await websocket.close(1013, "Too many pages are open.")
            return
        await websocket.accept()

        async def send(frame: bytes) -> None:
            # a page that has gone meanwhile needs no answer
            with suppress(WebSocketDisconnect, RuntimeError):
                await websocket.send_bytes(frame)

        session = Session(page, start, workers, send, live)
        sessions.add(session)
        try:
            await session.greet()
            while True:
                frame = await websocket.receive_bytes()
                if len(frame) > MAX_REQUEST:
                    await websocket.close(1009, "The message is too long.")
                    return
                await session.receive(frame)
        except WebSocketDisconnect:
            return
        except KeyError:  # no page of ours speaks in text
            await websocket.close(1003, "Only binary messages are understood.")
        finally:
            sessions.discard(session)
            session.close()

    async def first(_: Request) -> FileResponse:
        return FileResponse(STATIC / page.file)

    files = Mount("/", StaticFiles(directory=STATIC))
    routes = [WebSocketRoute("/socket", converse), Route("/", first), files]
    return Guard(Starlette(routes=routes, lifespan=lifespan), token)


def serve(
    start: FirstDesign,
    token: str,
    bind: str,
    port: int,
    ready: Callable[[str], object],
    camera: Source | None = None,
) -> None:
    """Run the server until it is interrupted.

    Parameters
    ----------
    start : FirstDesign
        What pages show first.
    token : str
        First part of every path.
    bind : str
        Address to listen on.
    port : int
        Port, or 0 for a free one.
    ready : callable
        Is told the page's address once the first picture can be had at once.
    camera : Source, optional
        Pages can watch it.

    Raises
    ------
    InputError
        If the address or port cannot be had.
    """
    family = socket.AF_INET6 if ":" in bind else socket.AF_INET
    with socket.socket(family) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((bind, port))
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or "ports go from 0 to 65535"
            elsewhere = isinstance(error, socket.gaierror) or (
                isinstance(error, OSError) and error.errno == errno.EADDRNOTAVAIL
            )
            remedy = (
                "Give --bind an address of this machine, such as 127.0.0.1."
                if elsewhere
                else "Choose another --port, or leave it out for a free one."
            )
            raise InputError(
                f"The explorer cannot listen on {bind}, port {port}: {reason}. {remedy}"
            ) from None
        listener.listen()
        host = f"[{bind}]" if family == socket.AF_INET6 else bind
        address = f"http://{host}:{listener.getsockname()[1]}/{token}/"
        config = uvicorn.Config(
            application(start, token, lambda: ready(address), camera, lambda: server.should_exit),
            log_level="warning",
            http=Patience,
            ws="websockets-sansio",
            ws_max_size=MAX_REQUEST,
            ws_per_message_deflate=False,
        )
        server = uvicorn.Server(config)
        # the server has ended in good order before it passes the interruption on
        with suppress(KeyboardInterrupt):
            server.run(sockets=[listener])
