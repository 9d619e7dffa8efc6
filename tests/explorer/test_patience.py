"""A connection that asks for nothing is let go; one that asks is kept."""

import http.client
import socket
import threading
import time
from collections.abc import Iterator

import pytest
import uvicorn
from starlette.responses import PlainTextResponse
from websockets.sync.client import connect

from fringeforce.explorer import patience
from fringeforce.explorer.security import is_address


@pytest.fixture
def port(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """A server that answers everything, and waits for half a second."""
    monkeypatch.setattr(patience, "PATIENCE", 0.5)

    async def answer(scope, receive, send) -> None:
        if scope["type"] == "http":
            await PlainTextResponse("well")(scope, receive, send)
            return
        await receive()
        await send({"type": "websocket.accept"})
        while (said := await receive())["type"] == "websocket.receive":
            await send({"type": "websocket.send", "text": said["text"]})

    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        config = uvicorn.Config(
            answer,
            http=patience.Patience,
            ws="websockets-sansio",
            lifespan="off",
            log_level="error",
        )
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        yield listener.getsockname()[1]
        server.should_exit = True
        thread.join()


@pytest.mark.parametrize("words", [b"", b"GET / HTTP/1.1\r\n", b"GET / HTTP/1.1\r\nHost: a\r\n"])
def test_half_a_request_is_not_waited_for(port: int, words: bytes) -> None:
    with socket.create_connection(("127.0.0.1", port), timeout=10) as one:
        one.sendall(words)
        assert one.recv(100) == b""


def test_who_has_asked_may_stay(port: int) -> None:
    page = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    with connect(f"ws://127.0.0.1:{port}/") as talk:
        for _ in range(3):
            page.request("GET", "/")
            assert page.getresponse().read() == b"well"
            talk.send("still there")
            assert talk.recv(timeout=10) == "still there"
            time.sleep(0.4)
    page.close()


@pytest.mark.parametrize(
    ("host", "ours"),
    [
        ("127.0.0.1:8000", True),
        ("localhost", True),
        ("[::1]:8000", True),
        ("127.0.0.1:8000.evil.example", False),
        ("localhost:evil.example", False),
        ("127.0.0.1:", False),
        ("", False),
    ],
)
def test_a_host_is_an_address_with_a_port(host: str, ours: bool) -> None:
    assert is_address(host) is ours
