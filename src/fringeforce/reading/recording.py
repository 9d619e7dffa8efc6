"""A recording of a strip, read on all processor cores."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.contacts.friction_cone import admissible
from fringeforce.estimation.track_status import HELD, SILENT, UNSETTLED
from fringeforce.reading.batch import Batch, checked_recording
from fringeforce.reading.reading import Reading
from fringeforce.reading.single_frame import SingleFrameReader
from fringeforce.reading.tracker import STATUSES, Track, Tracker

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BLOCK = 256
"""Frames that are handed to the compiled loop at a time."""
SHORTEST = 512
"""Frames below which a part is not worth a worker of its own."""


def read_batch(
    single: SingleFrameReader,
    frames: ArrayLike,
    covariance: bool,
    mask: ArrayLike | None,
    workers: int | None,
    progress: Callable[[int], None] | None,
) -> Batch:
    """Read a recording; see `fringeforce.Reader.read_batch`."""
    levels, batch = prepared(single, frames, covariance)
    used = single.usable(mask)
    count = max(1, min(workers or os.cpu_count() or 1, len(levels) // SHORTEST))
    ends = np.linspace(0, len(levels), count + 1).astype(int)
    parts = [slice(*ends[i : i + 2]) for i in range(count)]
    with ThreadPoolExecutor(count) as pool:
        jobs = [
            pool.submit(read_on, Tracker(single), levels[rows], used, batch[rows], progress)
            for rows in parts
        ]
        for job in jobs:
            job.result()
    return batch


def prepared(
    single: SingleFrameReader, frames: ArrayLike, covariance: bool
) -> tuple[NDArray[Any], Batch]:
    """Grey levels of a recording with a row for each frame, and room for their readings.

    Raises
    ------
    InputError
        If the frames are none of this sensor.
    """
    levels = checked_recording(frames, single.model.frame_shape)
    shape = single.model.sensor.tactels.count, 2
    return levels.reshape(len(levels), -1), Batch.of(len(levels), shape, covariance)


def read_on(
    tracker: Tracker,
    levels: NDArray[Any],
    used: Mask,
    batch: Batch,
    progress: Callable[[int], None] | None = None,
) -> None:
    """Fill in the readings of consecutive frames, from where a tracker stands."""
    single = tracker.single
    if not tracker.holds(used):
        tracker.release()
    track = Track.of(min(BLOCK, len(levels)), single.influence.shape[1], covariances=True)
    whole = batch.covariance is not None
    for first in range(0, len(levels), BLOCK):
        block, result = levels[first : first + BLOCK], batch[first : first + BLOCK]
        packed, bad = tracker.packed(block, used), _bad(single, block, used)
        done = 0
        while done < len(block):
            ahead = bad[done:].argmax() if bad[done:].any() else len(block) - done
            followed = tracker.advance(packed[done : done + ahead], track, done, whole)
            if followed:
                rows = slice(done, done + followed)
                _store_track(tracker, track, rows, block, result)
            done += followed
            if done < len(block) and (bad[done] or not tracker.holds(used)):
                result.store(done, _searched(tracker, block[done], used))
                done += 1
        if progress is not None:
            progress(len(block))


def _bad(single: SingleFrameReader, levels: NDArray[Any], used: Mask) -> Mask:
    """Which frames cannot be used."""
    bad = np.zeros(len(levels), dtype=bool)
    seen = levels if single.complete(used) else levels[:, used]
    doubtful = np.arange(len(levels))
    if single.always_in_range(levels):
        doubtful = np.flatnonzero(seen[:, 0] == seen[:, -1])
    if len(doubtful):
        low, high = seen[doubtful].min(axis=1), seen[doubtful].max(axis=1)
        full_scale = single.model.sensor.camera.full_scale
        bad[doubtful] = ~((low >= 0) & (high <= full_scale) & (low < high))
    return bad


def _searched(tracker: Tracker, frame: NDArray[Any], used: Mask) -> Reading:
    levels = tracker.single.checked(frame.reshape(tracker.single.model.frame_shape), used)
    return levels if isinstance(levels, Reading) else tracker.search(levels, used)


def _store_track(
    tracker: Tracker, track: Track, rows: slice, levels: NDArray[Any], batch: Batch
) -> None:
    """Fill in frames that were followed."""
    loads, covariance = track.loads[rows], track.covariances[rows]
    verdicts = track.verdicts[rows]
    touched = verdicts != SILENT
    if not touched.all():
        covariance[~touched] = tracker.single.silent_covariance
    for verdict in (HELD, UNSETTLED):
        if (unsure := verdicts == verdict).any():
            covariance[unsure] += tracker.excess(verdict)
    if tracker.widens:
        for i in np.flatnonzero(touched):
            covariance[i] = tracker.widened(covariance[i], loads[i], levels[rows][i])
    if (friction := tracker.single.friction) is not None:
        for i in range(len(loads)):
            loads[i], _ = admissible(loads[i], covariance[i], friction)
    shape = batch.forces[rows].shape
    batch.forces[rows] = loads.reshape(shape)
    batch.std[rows] = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).reshape(shape)
    batch.chi2[rows], batch.tracked[rows] = tracker.chi2(track.reports[rows]), True
    batch.status[rows] = STATUSES[verdicts]
    if batch.covariance is not None:
        batch.covariance[rows] = covariance
