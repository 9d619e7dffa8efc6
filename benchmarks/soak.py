"""A GigE Vision camera on loopback for a long time: rate, losses, return after a kill, memory.

    python benchmarks/soak.py [--seconds 60] [--line-rate 40000] [--read] [--queue 32]

The camera is Aravis' own, in a process of its own, with the pictures of a simulated touch in blocks
of 64 lines.  Without ``--read`` lines are checked and counted but not read, which shows what
acquisition alone carries; with it the whole of `fringeforce live` runs, with a CSV file and an HDF5
recording.  After the time the camera is killed and started again.  The camera pauses between blocks
and stays below the rate that is asked for.
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import fringeforce as ff
from fringeforce.acquisition import loop
from fringeforce.acquisition.cameras.camera import Block, Settings
from fringeforce.acquisition.cameras.gobject import aravis
from fringeforce.acquisition.run_statistics import Statistics
from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.contacts.fingertip import PERIODS, fingertip_forces
from fringeforce.reading.reading import Status

sys.path.append(str(Path(__file__).parents[1] / "tests" / "cameras"))
from fake_camera import ADDRESS, FakeCamera  # pyrefly: ignore[missing-import]

BLOCK = 64
LOOP = 65536  # a touch of some 3 s at 20,000 lines per second, again and again


@dataclass
class Watch:
    """Kills the camera when its time is over, restarts it, and notes memory on the way."""

    fake: FakeCamera
    seconds: float
    stop: threading.Event = field(default_factory=threading.Event)
    memory: list[float] = field(default_factory=list)
    before: Statistics | None = None
    killed: float = 0.0
    away: float = 0.0

    def __call__(self, statistics: Statistics, _: Readings | None) -> None:
        """Take note of a report."""
        self.memory.append(_resident())
        if self.before is None and statistics.seconds > self.seconds:
            self.before, self.killed = statistics, time.monotonic()
            self.fake.kill()
            threading.Timer(2.0, self.fake.start).start()
        if statistics.reconnects and not self.away:
            self.away = time.monotonic() - self.killed
            threading.Timer(2.0, self.stop.set).start()
        if self.killed and time.monotonic() - self.killed > 60:
            self.stop.set()


def checked(reader: ff.Reader, block: Block, *_: object, **__: object) -> Readings:
    """A block whose pictures are those that were shown, unread."""
    number = int(block.lines[0, 0]) + 256 * int(block.lines[0, 1])
    # other readers warm up on lines of their own
    if reader is READER and not np.array_equal(
        block.lines[:, :8], SHOWN[number : number + BLOCK, :8]
    ):
        raise SystemExit(f"block {block.first} is not what the camera showed")
    k = len(block.lines)
    forces = np.zeros((k, TACTELS, 2))
    status = (Status.OK,) * k
    return Readings(block.first, block.timestamps, forces, forces, np.ones(k), status, block.lines)


def _resident() -> float:
    """Memory of this process now [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 1e6


def _shown(model: ff.SensorModel) -> np.ndarray:
    """Lines of one touch at the rate that is asked for, exposed in parts."""
    times = np.arange(LOOP) * (PERIODS[1] / LOOP)
    forces = fingertip_forces(times, model.sensor.tactels.positions)
    return np.concatenate(
        [model.expose(part, rng=k) for k, part in enumerate(np.split(forces, 32))]
    )


def _number(lines: np.ndarray) -> None:
    """Write its number into every line's first pixels, which a reader would take for dead ones."""
    lines[:, 0], lines[:, 1] = np.arange(LOOP) % 256, np.arange(LOOP) // 256


def main() -> None:
    """Run, and print what was measured."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--line-rate", type=float, default=40000.0)
    parser.add_argument("--read", action="store_true", help="read the lines, and record them")
    parser.add_argument(
        "--queue", type=int, help="blocks that wait for the reader, 32 if not given"
    )
    options = parser.parse_args()
    try:
        aravis()
    except ff.FringeforceError as missing:
        Console().print(f"Not run: {missing}")
        return
    if not options.read:
        _number(SHOWN)
    with tempfile.TemporaryDirectory() as folder:
        fake = FakeCamera(SHOWN, Path(folder), BLOCK)
        watch = Watch(fake, options.seconds)
        targets = [f"csv:{folder}/r.csv", f"record:{folder}/r.h5"] if options.read else []
        sinks: list[Sink] = [ff.open_sink(target, MODEL) for target in targets]
        if not options.read:
            loop.read_block = checked
        camera = ff.open_camera(
            f"aravis:{ADDRESS}", MODEL, Settings(line_rate=options.line_rate, block=BLOCK)
        )
        try:
            found = ff.live(
                READER, camera, sinks, stop=watch.stop, report=watch, every=1.0, queue=options.queue
            )
        finally:
            fake.kill()
    Console().print(_table(watch, found))


def _table(watch: Watch, found: Statistics) -> Table:
    before = watch.before or found
    table = Table("measured", "value", title="A camera on loopback")
    seen = before.lines + before.dropped_camera + before.dropped_queue
    half = len(watch.memory) // 2
    spans = slice(10, 20), slice(half - 5, half + 5), slice(-20, -10)
    memory = ", ".join(f"{np.median(watch.memory[span]):.1f}" for span in spans)
    for name, value in (
        ("seconds before the kill", f"{before.seconds:.1f}"),
        ("lines from the camera", f"{seen}, {seen / before.seconds:.0f} per second"),
        ("lines taken", f"{before.lines}, {before.lines / before.seconds:.0f} per second"),
        ("lost by the camera, counted", str(before.dropped_camera)),
        ("dropped before reading, counted", str(before.dropped_queue)),
        ("latency", ", ".join(f"{1e3 * t:.3g} ms ({q} %)" for q, t in before.latency.items())),
        ("kill to first line again", f"{watch.away:.1f} s, 2 s of them off"),
        ("lines taken after its return", str(found.lines - before.lines)),
        ("memory after 10 to 20 s, half way, at the end", f"{memory} MB"),
        *((sink.name.split()[0], f"{sink.written} written, {sink.dropped} dropped")
          for sink in found.deliveries),
    ):  # fmt: skip
        table.add_row(name, value)
    return table


if __name__ == "__main__":
    MODEL = ff.characterize(ff.load_sensor("saad"))
    READER = ff.Reader(MODEL)
    TACTELS = MODEL.sensor.tactels.count
    SHOWN = _shown(MODEL)
    main()
