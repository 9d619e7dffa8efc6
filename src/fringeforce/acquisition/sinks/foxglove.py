"""Readings for Foxglove: live, and as an MCAP file; one JSON message for each line or image."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from fringeforce.acquisition.sinks.contact_rows import contact_objects, is_skin, wrenches_of
from fringeforce.acquisition.sinks.message import numbers
from fringeforce.acquisition.sinks.serving import LOOPBACK, address
from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.base.errors import FileFormatError, InputError
from fringeforce.base.optional_libraries import extra
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor

PORT = 8765
TOPIC = "/fringeforce/reading"
NUMBERS = {"type": "array", "items": {"type": "number"}}


class _Messages(Sink):
    """Base of sinks that log messages to a channel of their own."""

    def __init__(self, sensor: Sensor | Pad) -> None:
        self._foxglove: Any = extra("foxglove", "robots")
        self._sensor = sensor
        # channels end with their context, so it is kept
        self._context = self._foxglove.Context()
        self._channel = self._foxglove.Channel(TOPIC, schema=_schema(sensor), context=self._context)


class FoxgloveSink(_Messages):
    """Shows readings in Foxglove, live on this computer.

    Parameters
    ----------
    sensor : Sensor or Pad
        Design of the sensor.
    url : str
        Where to serve, "foxglove://127.0.0.1:8765" if host and port are left out.
    bind : str
        Host where the URL names none.

    Raises
    ------
    InputError
        If foxglove-sdk is missing or the address cannot be served.
    """

    def __init__(self, sensor: Sensor | Pad, url: str = "foxglove:", bind: str = LOOPBACK) -> None:
        super().__init__(sensor)
        host, port = address(url, PORT, bind, tokens=False)
        try:
            self._server = self._foxglove.start_server(
                name="fringeforce", host=host, port=port, context=self._context
            )
        except (OSError, RuntimeError) as error:
            raise InputError(f"{url} cannot be served: {error}.") from None
        self.port: int = self._server.port
        self.name = f"Foxglove at {host}:{self.port}"

    def write(self, readings: Readings) -> None:
        """Show a block."""
        if self._channel.has_sinks():
            _log(self._channel, readings, self._sensor)

    def close(self) -> None:
        """Stop serving."""
        self._server.stop()


class McapSink(_Messages):
    """Writes readings to an MCAP file, which Foxglove opens.

    Parameters
    ----------
    path : path
        Path of the file, which is written anew.
    sensor : Sensor or Pad
        Design of the sensor.

    Raises
    ------
    InputError
        If foxglove-sdk is missing.
    FileFormatError
        If the file cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str], sensor: Sensor | Pad) -> None:
        super().__init__(sensor)
        self.name = f"MCAP {os.fspath(path)}"
        try:
            self._writer = self._foxglove.open_mcap(
                Path(path), allow_overwrite=True, context=self._context
            )
        except (OSError, RuntimeError) as error:
            raise FileFormatError(f"{path} cannot be written: {error}.") from None

    def write(self, readings: Readings) -> None:
        """Append a block."""
        _log(self._channel, readings, self._sensor)
        self._writer.flush()

    def close(self) -> None:
        """Complete the file with its index."""
        self._writer.close()


def _schema(sensor: Sensor | Pad) -> dict[str, Any]:
    names = *sensor.components, *(f"{name}_std" for name in sensor.components)
    properties = {"line": {"type": "integer"}, **dict.fromkeys(names, NUMBERS)}
    properties |= {"force": NUMBERS, "torque": NUMBERS}
    if is_skin(sensor):
        properties["contacts"] = {"type": "array", "items": {"type": "object"}}
    properties |= {"chi2": {"type": "number"}, "status": {"type": "string"}}
    return {"type": "object", "title": "fringeforce.Reading", "properties": properties}


def _log(channel: Any, readings: Readings, sensor: Sensor | Pad) -> None:
    forces, std = (numbers(values.swapaxes(1, 2)) for values in (readings.forces, readings.std))
    force, torque = map(numbers, wrenches_of(readings, sensor))
    chi2 = numbers(readings.chi2)
    contacts = None if readings.resultants is None else contact_objects(readings)
    for i, status in enumerate(readings.status):
        columns = dict(zip(sensor.components, forces[i], strict=True))
        spread = zip(sensor.components, std[i], strict=True)
        columns |= {f"{name}_std": values for name, values in spread}
        columns |= {"force": force[i], "torque": torque[i]}
        if contacts is not None:
            columns["contacts"] = contacts[i]
        channel.log(
            {"line": readings.first + i, **columns, "chi2": chi2[i], "status": status.name},
            log_time=round(readings.timestamps[i] * 1e9),
        )
