"""Readings for Foxglove: live, and as an MCAP file; one JSON message for each line."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from fringeforce.errors import FileFormatError, InputError
from fringeforce.extras import extra
from fringeforce.sinks.message import numbers
from fringeforce.sinks.serving import LOOPBACK, address
from fringeforce.sinks.sink import Readings, Sink

PORT = 8765
TOPIC = "/fringeforce/reading"
NUMBERS = {"type": "array", "items": {"type": "number"}}
SCHEMA = {
    "type": "object",
    "title": "fringeforce.Reading",
    "properties": {
        "line": {"type": "integer"},
        "normal": NUMBERS,
        "tangential": NUMBERS,
        "normal_std": NUMBERS,
        "tangential_std": NUMBERS,
        "chi2": {"type": "number"},
        "status": {"type": "string"},
    },
}


class FoxgloveSink(Sink):
    """Shows readings in Foxglove, live on this computer.

    Parameters
    ----------
    url : str
        Where to serve, "foxglove://127.0.0.1:8765" if host and port are left out.
    bind : str
        Host where the URL names none.

    Raises
    ------
    InputError
        If foxglove-sdk is missing or the address cannot be served.
    """

    def __init__(self, url: str = "foxglove:", bind: str = LOOPBACK) -> None:
        foxglove: Any = extra("foxglove", "robots")
        host, port = address(url, PORT, bind, tokens=False)
        # channels end with their context, so it is kept
        self._context = context = foxglove.Context()
        try:
            self._server = foxglove.start_server(
                name="fringeforce", host=host, port=port, context=context
            )
        except (OSError, RuntimeError) as error:
            raise InputError(f"{url} cannot be served: {error}.") from None
        self._channel = foxglove.Channel(TOPIC, schema=SCHEMA, context=context)
        self.port: int = self._server.port
        self.name = f"Foxglove at {host}:{self.port}"

    def write(self, readings: Readings) -> None:
        """Show a block."""
        if self._channel.has_sinks():
            _log(self._channel, readings)

    def close(self) -> None:
        """Stop serving."""
        self._server.stop()


class McapSink(Sink):
    """Writes readings to an MCAP file, which Foxglove opens.

    Parameters
    ----------
    path : path
        Of the file, which is written anew.

    Raises
    ------
    InputError
        If foxglove-sdk is missing.
    FileFormatError
        If the file cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        foxglove: Any = extra("foxglove", "robots")
        self.name = f"MCAP {os.fspath(path)}"
        # channels end with their context, so it is kept
        self._context = context = foxglove.Context()
        try:
            self._writer = foxglove.open_mcap(Path(path), allow_overwrite=True, context=context)
        except (OSError, RuntimeError) as error:
            raise FileFormatError(f"{path} cannot be written: {error}.") from None
        self._channel = foxglove.Channel(TOPIC, schema=SCHEMA, context=context)

    def write(self, readings: Readings) -> None:
        """Append a block."""
        _log(self._channel, readings)
        self._writer.flush()

    def close(self) -> None:
        """Complete the file with its index."""
        self._writer.close()


def _log(channel: Any, readings: Readings) -> None:
    forces, std, chi2 = map(numbers, (readings.forces, readings.std, readings.chi2))
    for i, status in enumerate(readings.status):
        channel.log(
            {
                "line": readings.first + i,
                "normal": forces[i][0],
                "tangential": forces[i][1],
                "normal_std": std[i][0],
                "tangential_std": std[i][1],
                "chi2": chi2[i],
                "status": status.name,
            },
            log_time=round(readings.timestamps[i] * 1e9),
        )
