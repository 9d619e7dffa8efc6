"""Who may talk to the server: the page that it opened itself, on this machine, and nobody else.

Any page in the same browser can reach a server on the loopback interface.  Three things keep it
out: a random token in the address, which it cannot guess; the Origin of a request, which it cannot
forge; and the Host, which under DNS rebinding is a name and never an address.
"""

from __future__ import annotations

import ipaddress
import secrets

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

LOCAL_NAME = "localhost"


def new_token() -> str:
    """A token that nobody guesses."""
    return secrets.token_urlsafe(24)


class Guard:
    """Lets through what carries the token and comes from the page itself; adds safe headers.

    Parameters
    ----------
    app : ASGI application
        What is guarded; it sees paths without the token.
    token : str
        First part of every path.
    """

    def __init__(self, app: ASGIApp, token: str) -> None:
        self.app = app
        self.token = token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request, or refuse it with a status and nothing else."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        refusal = self._refusal(scope, host, headers.get("origin"))
        if refusal is not None:
            await _refuse(refusal, scope, receive, send)
            return

        async def safely(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(safe_headers(host))
            await send(message)

        root = f"/{self.token}"
        path = scope["path"].removeprefix(root)
        await self.app({**scope, "path": path, "raw_path": path.encode()}, receive, safely)

    def _refusal(self, scope: Scope, host: str, origin: str | None) -> int | None:
        if not is_address(host):
            return 421
        first = scope["path"].split("/")[1]
        if not secrets.compare_digest(first.encode(), self.token.encode()):
            return 404
        if scope["type"] == "websocket" and origin is None:
            return 403
        return 403 if origin not in (None, f"http://{host}") else None


def is_address(host: str) -> bool:
    """Whether a Host header names this machine by an address and not by some site's name."""
    name, _, port = (
        (host, "", "0") if host.endswith("]") or ":" not in host else host.rpartition(":")
    )
    if not (port.isascii() and port.isdigit()):
        return False
    if name == LOCAL_NAME:
        return True
    try:
        ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return False
    return True


def safe_headers(host: str) -> dict[str, str]:
    """Headers that keep the page to itself: no foreign source, no frame around it."""
    policy = {
        "default-src": "'none'",
        "script-src": "'self'",
        "style-src": "'self'",
        "img-src": "'self' data: blob:",
        "connect-src": f"'self' ws://{host}",
        "base-uri": "'none'",
        "form-action": "'none'",
        "frame-ancestors": "'none'",
    }
    return {
        "Content-Security-Policy": "; ".join(f"{key} {value}" for key, value in policy.items()),
        "Cross-Origin-Opener-Policy": "same-origin",
        "Cross-Origin-Resource-Policy": "same-origin",
        "Referrer-Policy": "no-referrer",
        "X-Content-Type-Options": "nosniff",
        "Cache-Control": "no-store",
    }


async def _refuse(status: int, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": ""})
        return
    await PlainTextResponse("Not for you.\n", status_code=status)(scope, receive, send)
