"""A sink by its name, as a person writes it on the command line."""

from __future__ import annotations

from pathlib import Path
from pkgutil import resolve_name

from fringeforce.acquisition.sinks.serving import LOOPBACK
from fringeforce.acquisition.sinks.sink import Sink
from fringeforce.base.errors import InputError
from fringeforce.models.pad import PadModel
from fringeforce.models.strip import SensorModel

KINDS = (
    "csv:PATH, h5:PATH, record:PATH, ws://HOST:PORT, mcap:PATH, foxglove://HOST:PORT, "
    "rosbag:PATH, ros:NODE, zmq:tcp://HOST:PORT or lsl:NAME"
)
SERVERS = ("ws", "foxglove", "zmq")
"""Kinds whose place may be left out."""
FILES = ("csv", "h5", "record", "mcap", "rosbag")
"""Kinds that need a path to write to."""
OF_SENSORS = {
    "csv": "csv_file:CsvSink",
    "mcap": "foxglove:McapSink",
    "rosbag": "rosbag:RosbagSink",
    "ros": "ros:RosSink",
    "lsl": "lsl:LslSink",
}
"""Modules and classes of the kinds that need a name or path, and the design of the sensor."""


def open_sink(
    target: str,
    model: SensorModel | PadModel,
    bind: str = LOOPBACK,
    token: str | None = None,
) -> Sink:
    """A sink for the readings of a sensor.

    Parameters
    ----------
    target : str
        "csv:PATH"; "h5:PATH" for readings, "record:PATH" for readings with their frames;
        "ws://HOST:PORT"; "mcap:PATH", "foxglove://HOST:PORT"; "rosbag:PATH", "ros:NODE";
        "zmq:tcp://HOST:PORT"; "lsl:NAME".
    model : SensorModel or PadModel
        The sensor.
    bind : str
        Host for servers whose target names none, as in "ws:".
    token : str, optional
        What clients must show; needed to serve beyond this computer.

    Raises
    ------
    InputError
        If there is no such kind of sink, or it needs something that is not installed.
    FileFormatError
        If a file cannot be written.

    Examples
    --------
    >>> model = ff.characterize(ff.load_sensor("saad"))
    >>> sink = ff.open_sink("csv:touch.csv", model)
    >>> sink.name
    'CSV touch.csv'
    >>> sink.close()
    """
    check_sink(target)
    kind, _, rest = target.partition(":")
    if kind in ("h5", "record"):
        from fringeforce.acquisition.sinks.hdf5 import Hdf5Sink

        return Hdf5Sink(rest, model, frames=kind == "record")
    if kind == "ws":
        from fringeforce.acquisition.sinks.websocket import WebSocketSink

        return WebSocketSink(target, bind, token)
    if kind == "zmq":
        from fringeforce.acquisition.sinks.zeromq import ZmqSink

        return ZmqSink(target.removeprefix("zmq:") or "tcp:", bind, token)
    if kind == "foxglove":
        from fringeforce.acquisition.sinks.foxglove import FoxgloveSink

        return FoxgloveSink(model.sensor, target, bind)
    return resolve_name(f"fringeforce.acquisition.sinks.{OF_SENSORS[kind]}")(rest, model.sensor)


def check_sink(target: str) -> None:
    """Refuse the name of a sink that cannot be one, before there is a model.

    Parameters
    ----------
    target : str
        As of `open_sink`.

    Raises
    ------
    InputError
        If there is no such kind of sink, its path or name is missing, or there is no folder for it.
    """
    kind, _, rest = target.partition(":")
    if kind not in (*OF_SENSORS, *FILES, *SERVERS) or (kind not in SERVERS and not rest):
        raise InputError(f"There is no place {target!r} for readings; use {KINDS}.")
    if kind in FILES and not Path(rest).parent.is_dir():
        raise InputError(f"{rest} cannot be written: there is no folder {Path(rest).parent}.")
