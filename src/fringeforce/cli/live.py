"""The command that reads a camera live."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fringeforce.cli.arguments import (
    Exposure,
    Friction,
    Mask,
    ModelOrDesign,
    Rate,
    RegionFile,
    Tolerance,
    in_kelvin,
    sensor_and_model,
    stated_mask,
    stated_tolerances,
    writable,
)

if TYPE_CHECKING:
    from fringeforce.acquisition.loop import Report
    from fringeforce.acquisition.run_statistics import Statistics
    from fringeforce.acquisition.sinks.sink import Readings, Sink
    from fringeforce.models.pad import PadModel
    from fringeforce.models.strip import SensorModel
    from fringeforce.reading.reader import Reader
    from fringeforce.reading.reading import Status


def live(
    model: ModelOrDesign,
    camera: Annotated[
        str,
        typer.Option(
            metavar="<camera>",
            help="sim (simulated), file:PATH, webcam:0, aravis:ID or pylon:SERIAL.",
        ),
    ] = "sim",
    to: Annotated[
        list[str] | None,
        typer.Option(
            metavar="<sink>",
            help="Where readings go, and again for more: csv:PATH, h5:PATH, ws://HOST:PORT, "
            "mcap:PATH, foxglove://HOST:PORT, rosbag:PATH, ros:NODE, zmq:tcp://HOST:PORT, "
            "lsl:NAME.",
        ),
    ] = None,
    record: Annotated[
        Path | None,
        typer.Option(
            metavar="<file>", help="HDF5 file for frames and readings, to read them again."
        ),
    ] = None,
    line_rate: Rate = None,
    exposure: Exposure = None,
    block: Annotated[
        int | None,
        typer.Option(
            metavar="<count>",
            help="How many lines or images come at once; one image, or lines of 0.1 s, if not "
            "given.",
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(
            "--for", metavar="<seconds>", help="How long to read; until Ctrl-C if not given."
        ),
    ] = None,
    bind: Annotated[
        str, typer.Option(metavar="<address>", help="Host of servers where --to names none.")
    ] = "127.0.0.1",
    token: Annotated[
        str | None,
        typer.Option(
            envvar="FRINGEFORCE_TOKEN",
            metavar="<secret>",
            help="What clients of servers must show; needed where other machines can reach them.",
        ),
    ] = None,
    friction: Friction = None,
    tolerance: Tolerance = None,
    mask: Mask = None,
    region: RegionFile = None,
    temperature: Annotated[
        float | None,
        typer.Option(metavar="<degC>", help="Temperature of the clear layer in degrees Celsius."),
    ] = None,
) -> None:
    """Read a camera live, show the forces, and send them on.

    Ends with status 1 if nothing that came can be used.
    """
    from fringeforce.acquisition.cameras.camera import Settings
    from fringeforce.acquisition.cameras.choice import check_camera, open_camera
    from fringeforce.acquisition.loop import live as run
    from fringeforce.acquisition.sinks.choice import check_sink
    from fringeforce.base.errors import InputError
    from fringeforce.cli.display import busy, display, summary
    from fringeforce.cli.progress import compiling
    from fringeforce.pictures.region import Region
    from fringeforce.reading.frame_reader import check_friction
    from fringeforce.reading.reader import Reader
    from fringeforce.reading.reading import Status

    settings = Settings(line_rate, exposure, block)
    check_camera(camera)
    targets = [*(to or ()), *([f"record:{record}"] if record else [])]
    for target in targets:
        check_sink(target)
    writable(record, "frames", model, camera.removeprefix("file:"))
    if seconds is not None and not seconds > 0:
        raise InputError(f"--for {seconds:g}: must be more than 0 seconds; leave it out to go on.")
    seen = None if region is None else Region.load(region)
    sensor, solved = sensor_and_model(model, stated_tolerances(tolerance))
    check_friction(sensor, friction)
    masked = stated_mask(mask, sensor)
    found = solved()
    reader = Reader(found, friction)
    slow = camera == "sim" and found.sensor.dimensions > 1
    with compiling():  # all of it, before a camera delivers what would wait and be dropped
        with busy("Exposing a simulated touch ...") if slow else nullcontext():
            source = open_camera(camera, found, settings, seen)
        sinks = _opened(targets, found, bind, token)
        reader.prepare()
    refused = _Refused()
    warm = None if temperature is None else in_kelvin(temperature, "--temperature")
    with _interruptible() as stop, display(found.sensor, source.name) as report:
        told = refused.beside(report)
        statistics = run(
            reader,
            source,
            sinks,
            seconds=seconds,
            stop=stop,
            report=told,
            mask=masked,
            temperature=warm,
        )
    reasons = refused.reasons(reader, masked, statistics.statuses)
    print("\n".join([*summary(statistics), *reasons]))
    if seconds is not None and not statistics.statuses:
        print(f"Nothing came from {source.name}. Look whether it runs, or give a longer --for.")
        raise typer.Exit(1)
    if statistics.statuses and not any(Status[name].usable for name in statistics.statuses):
        print(f"None of the {statistics.counted} can be used.")
        raise typer.Exit(1)


class _Refused:
    """The last frame of every verdict but OK, to say at the end what it means."""

    def __init__(self) -> None:
        self._frames: dict[Status, Any] = {}

    def beside(self, report: Report) -> Report:
        """A report that also looks for refused frames."""

        def told(statistics: Statistics, readings: Readings | None) -> None:
            for place, status in enumerate(readings.status if readings is not None else ()):
                if status.name != "OK" and readings is not None:
                    self._frames[status] = readings.lines[place]
            report(statistics, readings)

        return told

    def reasons(self, reader: Reader, mask: Any, statuses: Iterable[str]) -> list[str]:
        """What is said of each verdict, once."""
        from fringeforce.cli.frames import reason
        from fringeforce.reading.reading import Status

        said = list[str]()
        for status in (Status[name] for name in statuses if name != "OK"):
            if status.usable or status not in self._frames:
                said.append(f"  {status.name}: {status.advice}")
            else:
                reading = reader.search(self._frames[status], mask)
                said += [f"  {words}" for words in (reason(reading), *reading.findings)]
        return said


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
