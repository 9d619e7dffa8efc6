"""Readings over ZeroMQ: a publisher whose messages are those of the WebSocket."""

from __future__ import annotations

from typing import Any

from fringeforce.acquisition.sinks.message import message
from fringeforce.acquisition.sinks.serving import LOOPBACK, address
from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.base.errors import InputError
from fringeforce.base.optional_libraries import extra

PORT = 5556
WAITING = 200
USER = "fringeforce"


class ZmqSink(Sink):
    """A PUB socket; a subscriber that is too slow loses messages, and only its own.

    With a token, subscribers identify themselves by PLAIN: user "fringeforce", the token as the
    password.

    Parameters
    ----------
    url : str
        Where to bind, "tcp://127.0.0.1:5556" if host and port are left out.
    bind : str
        Host where the URL names none.
    token : str, optional
        What subscribers must show; needed where others can connect.

    Raises
    ------
    InputError
        If pyzmq is missing, or the address cannot be served or needs a token.
    """

    def __init__(self, url: str = "tcp:", bind: str = LOOPBACK, token: str | None = None) -> None:
        zmq: Any = extra("zmq", "robots")
        host, port = address(url, PORT, bind, token)
        self._context = zmq.Context()
        self._guard: Any = None
        if token:
            self._guard = extra("zmq.auth.thread", "robots").ThreadAuthenticator(self._context)
            self._guard.start()
            self._guard.configure_plain(domain="*", passwords={USER: token})
        self._socket = self._context.socket(zmq.PUB)
        self._socket.plain_server = bool(token)
        self._socket.set_hwm(WAITING)
        self._socket.linger = 1000
        try:
            # port 0 asks for any that is free
            self._socket.bind(f"tcp://{host}:{port or '*'}")
        except zmq.ZMQError as error:
            self.close()
            raise InputError(f"tcp://{host}:{port} cannot be served: {error}.") from None
        self.name = self._socket.last_endpoint.decode()

    def write(self, readings: Readings) -> None:
        """Publish a block; never waits for a subscriber."""
        self._socket.send_string(message(readings))

    def close(self) -> None:
        """Send what is left, for a second at most."""
        self._socket.close()
        if self._guard:
            self._guard.stop()
        self._context.term()
