"""Connections that ask for nothing are let go, so that they cannot keep others out."""

from __future__ import annotations

import asyncio
from typing import cast

from uvicorn.protocols.http.h11_impl import H11Protocol

PATIENCE = 10.0
"""Seconds within which a connection has to send the first line and all headers of a request."""


class Patience(H11Protocol):
    """HTTP/1.1 whose first request has to come within a time."""

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Begin to wait."""
        super().connection_made(transport)
        self._waiting = self.loop.call_later(PATIENCE, self._let_go)

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no longer."""
        self._waiting.cancel()
        super().connection_lost(exc)

    def _let_go(self) -> None:
        # uvicorn makes the scope of a request once its headers are complete
        if cast(object, self.scope) is None:
            self.transport.close()
