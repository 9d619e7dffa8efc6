"""Live reading: camera, reader and sinks, each at its own pace."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.acquisition.camera_thread import CameraThread
from fringeforce.acquisition.cameras.camera import Block, Camera
from fringeforce.acquisition.run_statistics import Delivery, RunStatistics, Statistics
from fringeforce.acquisition.sink_thread import SinkThread
from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.reading.reader import Reader

POLL = 0.1
"""Time to wait for a block before asking whether to go on [s]."""
QUEUE, IMAGE_QUEUE = 32, 1
"""Blocks that wait for a reader, if nothing else is asked for.

Lines are followed best without gaps. An image that waits while another is read is late, and the
next one takes its place."""
TOGETHER, SLOW = 256, 0.05
"""Lines up to which blocks that wait are read as one, which takes less time; and time that the last
ones took, beyond which each has to be searched and a block of its own is long enough [s]."""
Report = Callable[[Statistics, Readings | None], None]


def live(
    reader: Reader,
    camera: Camera,
    sinks: Sequence[Sink] = (),
    *,
    seconds: float | None = None,
    stop: threading.Event | None = None,
    report: Report | None = None,
    every: float = 0.1,
    queue: int | None = None,
    mask: ArrayLike | None = None,
    temperature: float | Callable[[], float] | None = None,
) -> Statistics:
    """Read a camera's lines, or images, until it ends, the time is over, or someone stops it.

    The camera fills a bounded queue; when the reader is slower and it is full, the blocks in it are
    dropped and counted, so that what is read comes in long runs.  A camera that vanishes is looked
    for again, at growing intervals.  Every sink has a bounded queue of its own, so that a slow,
    dead or full one stops no other part.  A camera that waits, such as a file at full speed, is
    read whole, and waits for the sinks too.

    Parameters
    ----------
    reader : Reader
        Reader of the sensor; it goes on from what it read last.
    camera : Camera
        Not yet connected.
    sinks : sequence of Sink
        Are closed at the end, whatever happens.
    seconds : float, optional
        How long to read.
    stop : threading.Event, optional
        Ends the reading soon after it is set.
    report : callable, optional
        Is told of the statistics and the last readings, in the thread of the caller.
    every : float
        Time between reports [s].
    queue : int, optional
        Blocks that wait for the reader, and for every sink; 32 if not given.  Of a
        pad's images only the newest waits for the reader then.
    mask : array_like of bool, shape of a frame, optional
        Pixels to leave out of all frames, where true.
    temperature : float or callable, optional
        Of the photoelastic layer [K], or what tells it, as of a thermometer; asked before each
        block, in the thread of the caller.

    Returns
    -------
    Statistics
        Statistics of the whole run.  Every line or image that the camera numbered was read or is
        counted as dropped.

    Raises
    ------
    CameraLost
        If there is no camera to begin with.
    FringeforceError
        If the camera cannot be set as asked, if the mask does not fit the sensor, or a pad's
        images cannot be read without an earlier state.

    Examples
    --------
    >>> model = ff.characterize(ff.load_sensor("saad"))
    >>> np.save("frames.npy", model.expose([ff.polar(1.0, angle=10, n=11)] * 8, rng=0))
    >>> camera = ff.open_camera("file:frames.npy", model)
    >>> ff.live(ff.Reader(model), camera, [ff.open_sink("csv:touch.csv", model)]).lines
    8
    """
    images = reader.model.sensor.dimensions > 1
    stopping = stop or threading.Event()
    with ExitStack() as finishing:
        sink_threads: list[SinkThread] = []
        for sink in sinks:
            sink_threads.append(SinkThread(sink, queue or QUEUE, camera.patient))
            finishing.callback(sink_threads[-1].finish)
        reader.prepare()
        counts = RunStatistics("images" if images else "lines")
        camera_thread = CameraThread(camera, queue or (IMAGE_QUEUE if images else QUEUE), counts)
        finishing.callback(camera_thread.stop)
        camera_thread.start()
        deadline = time.monotonic() + (float("inf") if seconds is None else seconds)
        told, last, together = -np.inf, None, 1
        while not stopping.is_set() and time.monotonic() < deadline:
            try:
                block = camera_thread.next(POLL, together)
            except StopIteration:
                break
            if block is not None:
                began = time.monotonic()
                warm = temperature() if callable(temperature) else temperature
                last = read_block(reader, block, warm, mask)
                together = 1 if images or time.monotonic() - began > SLOW else TOGETHER
                counts.read(last)
                for sink_thread in sink_threads:
                    sink_thread.put(last)
            if report and time.monotonic() - told > every:
                told = time.monotonic()
                report(counts.statistics(_deliveries(sink_threads)), last)
    statistics = counts.statistics(_deliveries(sink_threads))
    if report:
        report(statistics, last)
    return statistics


def read_block(
    reader: Reader,
    block: Block,
    temperature: float | None = None,
    mask: ArrayLike | None = None,
) -> Readings:
    """Read all lines or images of a block, as those that follow what the reader read last."""
    found = reader.read_on(block.lines, mask=mask, times=block.timestamps, temperatures=temperature)
    return Readings(
        first=block.first,
        timestamps=block.timestamps,
        forces=found.forces,
        std=found.std,
        chi2=found.chi2,
        status=tuple(found.status),
        lines=block.lines,
        resultants=found.resultants,
    )


def _deliveries(sink_threads: Sequence[SinkThread]) -> tuple[Delivery, ...]:
    return tuple(sink_thread.delivery for sink_thread in sink_threads)
