"""The explorer's server under forged, malformed and endless requests, beside a good page."""

from __future__ import annotations

import re
import resource
import socket
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

import psutil
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from damage.counting import Case
from fringeforce.explorer.protocol import decoded, encoded

COMMAND = "import sys; from fringeforce.cli import main; sys.exit(main())"
SOCKETS = 1000
MOST_GROWTH = 100e6
"""Memory that the server may take more [bytes]."""
SLOWEST = 1.0
"""Seconds within which the good page has its answers while others misbehave, as a median."""


@dataclass
class Explorer:
    """A server in a process of its own, and the good page that it opened."""

    process: psutil.Process
    port: int
    token: str
    page: ClientConnection
    number: int = 1

    @property
    def host(self) -> str:
        """Its address."""
        return f"127.0.0.1:{self.port}"

    def memory(self) -> float:
        """Memory of the server alone [bytes]."""
        return self.process.memory_info().rss

    def ask(self) -> float:
        """Seconds that an answer to the good page takes."""
        begin = time.perf_counter()
        self.number += 1
        self.page.send(encoded({"type": "design", "id": self.number}))
        while _header(self.page.recv(timeout=20)).get("id") != self.number:
            pass
        return time.perf_counter() - begin

    def plain(self) -> socket.socket:
        """A connection of bytes."""
        return socket.create_connection(("127.0.0.1", self.port), timeout=5)

    def get(self, text: str) -> bytes:
        """What the server answers to a request of bytes."""
        with self.plain() as one:
            with suppress(ConnectionError):
                one.sendall(text.encode("latin-1"))
            answer = b""
            with suppress(TimeoutError, ConnectionError):
                while part := one.recv(65536):
                    answer += part
            return answer


def _header(frame: str | bytes) -> dict[str, Any]:
    assert isinstance(frame, bytes), "the server speaks in text"
    return decoded(frame)[0]


def _framed(text: bytes) -> bytes:
    """A header as pages send it, whatever it says."""
    return len(text).to_bytes(4, "little") + text


@contextmanager
def explorer() -> Iterator[Explorer]:
    """Start the command as people do, and open its page."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(4 * SOCKETS, hard), hard))
    command = [sys.executable, "-c", COMMAND, "explore", "--no-browser"]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert run.stdout is not None
        found = re.search(r"http://127\.0\.0\.1:(\d+)/([^/]+)/", run.stdout.readline())
        assert found is not None, "the server did not start"
        port, token = int(found[1]), found[2]
        origin = Origin(f"http://127.0.0.1:{port}")
        address = f"ws://127.0.0.1:{port}/{token}/socket"
        with connect(address, origin=origin, max_size=None) as page:
            page.recv(timeout=20)
            yield Explorer(psutil.Process(run.pid), port, token, page)
    finally:
        run.terminate()
        run.wait(20)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def _request(path: str, host: str, *more: str, method: str = "GET") -> str:
    return "\r\n".join([f"{method} {path} HTTP/1.1", f"Host: {host}", *more, "", ""])


def _forged(one: Explorer) -> dict[str, str]:
    root, host = f"/{one.token}/", one.host
    upgrade = (
        "Connection: Upgrade", "Upgrade: websocket", "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
    )  # fmt: skip
    close = "Connection: close"
    return {
        "no token": _request("/", host, close),
        "wrong token": _request("/" + "x" * len(one.token) + "/", host, close),
        "token in other case": _request(root.swapcase(), host, close),
        "token cut": _request(root[:-2] + "/", host, close),
        "host of a site": _request(root, "evil.example", close),
        "host that begins like ours": _request(root, f"{host}.evil.example", close),
        "no host": f"GET {root} HTTP/1.1\r\nConnection: close\r\n\r\n",
        "two hosts": _request(root, host, "Host: evil.example", close),
        "origin of a site": _request(root, host, "Origin: http://evil.example", close),
        "origin null": _request(root, host, "Origin: null", close),
        "socket without origin": _request(f"{root}socket", host, *upgrade),
        "socket of a site": _request(f"{root}socket", host, *upgrade, "Origin: http://a.example"),
        "socket without token": _request("/socket", host, *upgrade, f"Origin: http://{host}"),
        "a file above": _request(f"{root}../server.py", host, close),
        "a file above, encoded": _request(f"{root}%2e%2e/server.py", host, close),
        "absolute file": _request(f"{root}/etc/passwd", host, close),
        "not UTF-8": _request("/%ff%fe/", host, close),
        "no HTTP": "\x00\x01\x02\x16\x03\x01 hello\r\n\r\n",
        "a huge header": _request(root, host, f"X: {'x' * 10**6}", close),
        "a huge path": _request("/" + "x" * 10**6, host, close),
        "endless headers": _request(root, host, *(f"X{k}: 1" for k in range(10**5)), close),
        "a long body": _request(
            root, host, "Content-Length: 100000000", method="POST"
        ) + "x" * 10**6,
        "another method": _request(root, host, close, method="DELETE"),
    }  # fmt: skip


MESSAGES: dict[str, str | bytes] = {
    "text": "hello",
    "empty": b"",
    "no JSON": b"\xff\xfe\x00",
    "a number": _framed(b"1"),
    "a list": _framed(b"[]"),
    "nothing": _framed(b"{}"),
    "unknown type": _framed(b'{"type": "shutdown", "id": 1}'),
    "nan": _framed(b'{"type": "design", "id": NaN}'),
    "huge number": _framed(b'{"type": "design", "id": 1e400}'),
    "deep": _framed(b"[" * 30000 + b"]" * 30000),
    "changes of no sense": _framed(
        b'{"type": "design", "id": 1, "changes": {"camera.pixels": 1e9}}'
    ),
    "too long": b" " * 70000,
    "huge": b" " * 20_000_000,
}


def servers() -> Iterator[Case]:
    """Each kind of misuse; the good page has its answers meanwhile and afterwards."""
    with explorer() as one:
        for _ in range(3):
            one.ask()
        usual = one.memory()

        def well() -> None:
            took = statistics.median(one.ask() for _ in range(5))
            assert took < SLOWEST, f"the good page waited {took:.2f} s"
            more = one.memory() - usual
            assert more < MOST_GROWTH, f"{more / 1e6:.0f} MB more memory"

        for name, text in _forged(one).items():

            def attempt(text: str = text) -> None:
                answer = one.get(text)
                assert not answer.startswith((b"HTTP/1.1 200", b"HTTP/1.1 101")), answer[:100]
                assert b"500" not in answer[:20], "an error of the server"
                assert b"<html" not in answer
                well()

            yield f"request: {name}", attempt
        for name, message in MESSAGES.items():

            def say(message: str | bytes = message) -> None:
                with (
                    suppress(ConnectionClosed, InvalidHandshake, TimeoutError),
                    connect(
                        f"ws://{one.host}/{one.token}/socket",
                        origin=Origin(f"http://{one.host}"),
                        max_size=None,
                    ) as other,
                ):
                    other.recv(timeout=5)
                    other.send(message)
                    assert _header(other.recv(timeout=5))["type"] == "refused", "taken"
                well()

            yield f"message: {name}", say

        def own() -> None:
            found = []
            for start in ("", "../../../etc/passwd"):
                one.number += 1
                one.page.send(encoded({"type": "design", "id": one.number, "start": start}))
                header = _header(one.page.recv(timeout=20))
                found.append({key: value for key, value in header.items() if key != "id"})
            assert found[0] == found[1], "another design"

        yield "message: a design that is a path outside", own
        for name, misuse in MISUSES.items():

            def crowd(misuse: Callable[[Explorer], list[socket.socket]] = misuse) -> None:
                there = misuse(one)
                try:
                    well()
                    assert one.get(_request(f"/{one.token}/", one.host, "Connection: close"))[
                        :12
                    ].endswith(b"200"), "a new page is not served"
                finally:
                    for each in there:
                        each.close()
                well()

            yield f"{SOCKETS} sockets: {name}", crowd
        yield "a socket that never asks is let go", lambda: _let_go(one)


def _many(one: Explorer, words: bytes) -> list[socket.socket]:
    found = []
    for _ in range(SOCKETS):
        each = one.plain()
        with suppress(ConnectionError):
            each.sendall(words)
        found.append(each)
    return found


def _slow(one: Explorer) -> list[socket.socket]:
    """Headers that never end, a line at a time."""
    found = _many(one, f"GET / HTTP/1.1\r\nHost: {one.host}\r\n".encode())
    for _ in range(3):
        for each in found:
            with suppress(ConnectionError):
                each.sendall(b"X: 1\r\n")
    return found


MISUSES: dict[str, Callable[[Explorer], list[socket.socket]]] = {
    "silent": lambda one: _many(one, b""),
    "slow headers": _slow,
    "half a handshake": lambda one: _many(one, f"GET /{one.token}/socket HTTP/1.1\r\n".encode()),
    "refused": lambda one: _many(one, f"GET / HTTP/1.1\r\nHost: {one.host}\r\n\r\n".encode()),
}


def _let_go(one: Explorer) -> None:
    """A connection that never asks for anything ends by itself."""
    with one.plain() as each:
        each.settimeout(15)
        each.sendall(b"GET / HT")
        try:
            each.recv(100)
        except TimeoutError:
            raise AssertionError("a connection that asks for nothing is kept") from None
