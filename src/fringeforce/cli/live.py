"""The command that reads a camera live."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fringeforce.cli.arguments import Exposure, Friction, Model, Rate, Tolerance, with_tolerances

if TYPE_CHECKING:
    from fringeforce.acquisition.sinks.sink import Sink
    from fringeforce.models.pad import PadModel
    from fringeforce.models.strip import SensorModel


def live(
    model: Model,
    camera: Annotated[str, typer.Option(help="sim, file:PATH, aravis:ID or pylon:SERIAL.")] = "sim",
    to: Annotated[
        list[str] | None,
        typer.Option(
            help="Where readings go, repeatable: csv:PATH, h5:PATH, ws://HOST:PORT, mcap:PATH, "
            "foxglove://HOST:PORT, rosbag:PATH, ros:NODE, zmq:tcp://HOST:PORT, lsl:NAME."
        ),
    ] = None,
    record: Annotated[
        Path | None, typer.Option(help="HDF5 file for frames and readings, to read them again.")
    ] = None,
    line_rate: Rate = None,
    exposure: Exposure = None,
    block: Annotated[
        int | None,
        typer.Option(help="How many come at once; 64 lines or one image if not given."),
    ] = None,
    seconds: Annotated[
        float | None, typer.Option("--for", help="Seconds to read; until Ctrl-C if not given.")
    ] = None,
    bind: Annotated[
        str, typer.Option(help="Host that servers use where --to names none.")
    ] = "127.0.0.1",
    token: Annotated[
        str | None,
        typer.Option(
            envvar="FRINGEFORCE_TOKEN",
            help="What clients must show; needed beyond this computer.",
        ),
    ] = None,
    friction: Friction = None,
    tolerance: Tolerance = None,
) -> None:
    """Read a camera live, show the forces, and send them where they are wanted."""
    from fringeforce.acquisition.cameras.camera import Settings
    from fringeforce.acquisition.cameras.choice import open_camera
    from fringeforce.acquisition.loop import live as run
    from fringeforce.cli.display import busy, display, summary
    from fringeforce.models.files import load_model
    from fringeforce.reading.reader import Reader

    found, settings = load_model(model), Settings(line_rate, exposure, block)
    found = with_tolerances(found, tolerance)
    reader = Reader(found, friction)
    slow = camera == "sim" and found.sensor.dimensions > 1
    with busy("Exposing a simulated touch ...") if slow else nullcontext():
        source = open_camera(camera, found, settings)
    targets = [*(to or ()), *([f"record:{record}"] if record else [])]
    sinks = _opened(targets, found, bind, token)
    with busy("Loading the reader, which is compiled for about a minute the first time ..."):
        reader.prepare()
    with _interruptible() as stop, display(found.sensor, source.name) as report:
        statistics = run(reader, source, sinks, seconds=seconds, stop=stop, report=report)
    print("\n".join(summary(statistics)))


def _opened(
    targets: Sequence[str], model: SensorModel | PadModel, bind: str, token: str | None
) -> list[Sink]:
    """All sinks, or none of them left open."""
    from fringeforce.acquisition.sinks.choice import open_sink

    with ExitStack() as opened:
        sinks = []
        for target in targets:
            sinks.append(open_sink(target, model, bind, token))
            opened.callback(sinks[-1].close)
        opened.pop_all()
    return sinks


@contextmanager
def _interruptible() -> Iterator[threading.Event]:
    """An event that Ctrl-C and a polite kill set; a second Ctrl-C interrupts."""
    stop = threading.Event()

    def ask(number: int, _: object) -> None:
        signal.signal(number, before[signal.Signals(number)])
        stop.set()

    before = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
