"""What a person sees of a live run: a picture where there is a screen, lines of text elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from fringeforce.acquisition.run_statistics import Delivery, Statistics
from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.base.words import counted
from fringeforce.cli.pad_display import pad_picture, pad_skin_picture
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.io.tables import contact_cells

Report = Callable[[Statistics, Readings | None], None]
BAR = 20
FULL_SCALES = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
EIGHTHS = " ▏▎▍▌▋▊▉█"
NORMAL, TANGENTIAL, DIM, WARNING = "cyan", "magenta", "dim", "yellow"


@contextmanager
def display(sensor: Sensor | Pad, camera: str) -> Iterator[Report]:
    """A report for `live`: a calm picture on a terminal, one line a second elsewhere.

    Parameters
    ----------
    sensor : Sensor or Pad
        The design.
    camera : str
        What to call it.
    """
    console = Console(stderr=True)
    if not console.is_terminal:
        yield _once_a_second()
        return
    scale = [FULL_SCALES[0]]
    with Live(console=console, auto_refresh=False, transient=True) as screen:
        screen.update(Text("Preparing to read ..."), refresh=True)

        def report(statistics: Statistics, readings: Readings | None) -> None:
            # the scale only grows, so that bars do not jump
            scale[0] = max(scale[0], full_scale(readings))
            shown = picture(sensor, camera, statistics, readings, scale[0])
            screen.update(shown, refresh=True)

        yield report


@contextmanager
def busy(words: str) -> Iterator[None]:
    """Say what takes long: for as long as it takes on a terminal, in a line elsewhere."""
    console = Console(stderr=True)
    if not console.is_terminal:
        print(words, file=sys.stderr)
        yield
        return
    with console.status(words):
        yield


def picture(
    sensor: Sensor | Pad,
    camera: str,
    statistics: Statistics,
    readings: Readings | None,
    scale: float,
) -> RenderableType:
    """The whole screen; bars and shades end at `scale` newtons."""
    head = Text.assemble((sensor.name, "bold"), (f"\n{camera}, {statistics.seconds:.0f} s", DIM))
    parts: list[RenderableType] = [head, Text()]
    if readings is None:
        parts.append(Text(f"Waiting for {statistics.counted} ...", style=DIM))
    else:
        kind = sensor.kind if readings.resultants is None else f"{sensor.kind} skin"
        parts.append(_PICTURES[kind](sensor, readings, scale))
        status = readings.status[-1]
        calm = status.trusted
        words = "" if calm else f": {status.advice}"
        parts += [Text(), Text(f"{status.name}{words}", style=DIM if calm else WARNING)]
    parts += [Text(), Text(_rates(statistics)), Text(_counts(statistics), style=DIM)]
    parts += [
        Text(_sink(sink, statistics.counted), style=DIM)
        for sink in statistics.deliveries
        if not sink.trouble
    ]
    parts += [Text(trouble, style=WARNING) for trouble in statistics.troubles]
    return Group(*parts)


def full_scale(readings: Readings | None) -> float:
    """A round force that no bar of the last reading exceeds [N]."""
    forces = [] if readings is None else [abs(value) for value in _forces(readings)]
    largest = max((value for value in forces if value == value), default=0.0)
    return next((scale for scale in FULL_SCALES if scale >= largest), FULL_SCALES[-1])


def summary(statistics: Statistics) -> list[str]:
    """The whole run in a few lines."""
    counts = ", ".join(f"{count} {name}" for name, count in statistics.statuses.items())
    frames = statistics.counted
    mean = statistics.lines / max(statistics.seconds, 1e-9)
    lines = [
        f"{counted(statistics.lines, frames)} in {statistics.seconds:.1f} s, {mean:.4g} {frames}/s"
    ]
    lines += [f"  {counts}"] if counts else []
    if statistics.latency:
        lines.append(f"  latency, from exposure to reading: {_latency(statistics)}")
    lines += [f"  camera came back {counted(statistics.reconnects, 'times')}"] * bool(
        statistics.reconnects
    )
    lines += [f"  {_sink(sink, frames)}" for sink in statistics.deliveries]
    return [*lines, *(f"  {trouble}" for trouble in statistics.troubles)]


def _once_a_second() -> Report:
    told = float("-inf")

    def report(statistics: Statistics, _: Readings | None) -> None:
        nonlocal told
        if time.monotonic() - told >= 1:
            told = time.monotonic()
            print(f"{_rates(statistics)}; {_counts(statistics)}", file=sys.stderr)

    return report


def _strip_picture(_: Sensor, readings: Readings, scale: float) -> Table:
    table = Table.grid(padding=(0, 2))
    for justify in ("right", "left", "right", "center", "right"):
        table.add_column(justify=justify)
    heads = "tactel", f"normal, to {scale:g} N", "N", f"tangential, to {scale:g} N", "N"
    table.add_row(*(Text(head, style=DIM) for head in heads))
    forces, std = readings.forces[-1], readings.std[-1]
    for tactel, ((normal, tangential), spread) in enumerate(zip(forces, std, strict=True), 1):
        table.add_row(
            Text(str(tactel), style=DIM),
            Text(_bar(normal, scale, BAR), style=NORMAL),
            _value(normal, spread[0]),
            Text(_both_ways(tangential, scale), style=TANGENTIAL),
            _value(tangential, spread[1]),
        )
    return table


def _skin_picture(_: Sensor, readings: Readings, scale: float) -> Table:
    table = Table.grid(padding=(0, 2))
    for justify in ("right", "right", "right", "left", "right", "center", "right"):
        table.add_column(justify=justify)
    forces = f"normal, to {scale:g} N", "N", f"tangential, to {scale:g} N", "N"
    heads = "contact", "x / mm", "width / mm", *forces
    table.add_row(*(Text(head, style=DIM) for head in heads))
    assert readings.resultants is not None
    for number, one in enumerate(readings.resultants[-1]):
        x, width, normal, tangential, x_std, width_std, *std = contact_cells(one)
        table.add_row(
            Text(str(number) if number else "all", style=DIM),
            _value(x, x_std),
            _value(width, width_std),
            Text(_bar(normal, scale, BAR), style=NORMAL),
            _value(normal, std[0]),
            Text(_both_ways(tangential, scale), style=TANGENTIAL),
            _value(tangential, std[1]),
        )
    return table


_PICTURES: Mapping[str, Any] = {
    "strip": _strip_picture,
    "strip skin": _skin_picture,
    "pad": pad_picture,
    "pad skin": pad_skin_picture,
}


def _forces(readings: Readings) -> Any:
    """Forces of the last line, of tactels or of contacts."""
    if readings.resultants is None:
        return readings.forces[-1].flat
    return [value for one in readings.resultants[-1] for value in one.force]


def _value(value: float, std: float) -> Text:
    return Text.assemble(f"{value:+.3f} ", (f"± {std:.3f}", DIM))


def _bar(value: float, scale: float, width: int) -> str:
    """From the left, to an eighth of a letter; empty below zero and for what is no number."""
    eighths = round(8 * width * min(value / scale, 1)) if value > 0 else 0
    return ("█" * (eighths // 8) + EIGHTHS[eighths % 8].strip()).ljust(width)


def _both_ways(value: float, scale: float) -> str:
    """From the middle, to the left for negative values."""
    half = BAR // 2
    length = round(half * min(abs(value) / scale, 1)) if value == value else 0
    left, right = ("█" * length, "") if value < 0 else ("", "█" * length)
    return f"{left:>{half}}│{right:<{half}}"


def _rates(statistics: Statistics) -> str:
    rate = f"{statistics.rate:.0f}" if statistics.rate >= 100 else f"{statistics.rate:.3g}"
    latency = f"; latency: {_latency(statistics)}" if statistics.latency else ""
    return f"{rate} {statistics.counted}/s{latency}"


def _latency(statistics: Statistics) -> str:
    """Within which times which shares of frames were read."""
    shares = ("half" if q == 50 else f"{q} %" for q in statistics.latency)
    times = zip(shares, statistics.latency.values(), strict=True)
    return ", ".join(f"{share} within {_time(value)}" for share, value in times)


def _time(seconds: float) -> str:
    if seconds < 1e-3:
        return f"{seconds * 1e6:.0f} µs"
    return f"{seconds * 1e3:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def _counts(statistics: Statistics) -> str:
    lost = f"{statistics.dropped_camera} lost by the camera, {statistics.dropped_queue} dropped"
    statuses = "".join(f", {count} {name}" for name, count in statistics.statuses.items())
    return f"{counted(statistics.lines, statistics.counted)} read, {lost}{statuses}"


def _sink(sink: Delivery, frames: str) -> str:
    remark = f", {sink.remark}" if sink.remark else ""
    return f"{sink.name}: {counted(sink.written, frames)}{remark}"
