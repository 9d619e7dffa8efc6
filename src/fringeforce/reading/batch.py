"""A recording, read on all processor cores."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.errors import InputError
from fringeforce.force.admissible import admissible
from fringeforce.force.certainty import HELD, SILENT, UNSETTLED
from fringeforce.reading.reading import Reading, Status
from fringeforce.reading.single_frame import SingleFrameReader
from fringeforce.reading.tracker import STATUSES, Track, Tracker

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BLOCK = 256
"""Frames that are handed to the compiled loop at a time."""
SHORTEST = 512
"""Frames below which a part is not worth a worker of its own."""


@dataclass(frozen=True, eq=False)
class Batch:
    """Readings of k frames, as arrays.

    Attributes
    ----------
    forces : ndarray, shape (k, 2, n)
        Normal and tangential forces [N]; not a number for bad frames.
    std : ndarray, shape (k, 2, n)
        Their standard deviations [N].
    chi2 : ndarray, shape (k,)
        Reduced chi-square.
    status : ndarray of Status, shape (k,)
        The verdicts.
    tracked : ndarray of bool, shape (k,)
        Whether a frame was followed from the last one rather than searched.
    covariance : ndarray, shape (k, 2n, 2n), or None
        Of the forces, normal ones first [N^2], if it was asked for.

    Examples
    --------
    >>> model = ff.characterize(ff.load_sensor("saad"))
    >>> frames = model.expose([ff.polar(1.0, angle=10, n=11)] * 3, rng=0)
    >>> batch = ff.Reader(model).read_batch(frames)
    >>> len(batch), batch.forces.shape, batch.covariance.shape
    (3, (3, 2, 11), (3, 22, 22))
    """

    forces: Array
    std: Array
    chi2: Array
    status: NDArray[np.object_]
    tracked: Mask
    covariance: Array | None

    @classmethod
    def of(cls, frames: int, tactels: int, covariance: bool) -> Batch:
        """Room for so many frames."""
        forces, std = np.full((2, frames, 2, tactels), np.nan)
        whole = np.full((frames, 2 * tactels, 2 * tactels), np.nan) if covariance else None
        status = np.full(frames, Status.BAD_FRAME, dtype=object)
        return cls(forces, std, np.full(frames, np.nan), status, np.zeros(frames, bool), whole)

    def __len__(self) -> int:
        return len(self.status)

    def __getitem__(self, rows: slice) -> Batch:
        """Some of the frames; its arrays are views."""
        whole = None if self.covariance is None else self.covariance[rows]
        arrays = (self.forces, self.std, self.chi2, self.status, self.tracked)
        return Batch(*(array[rows] for array in arrays), whole)  # type: ignore[arg-type]


def read_batch(
    single: SingleFrameReader,
    frames: ArrayLike,
    covariance: bool,
    mask: ArrayLike | None,
    workers: int | None,
    progress: Callable[[int], None] | None,
) -> Batch:
    """Read a recording; see `fringeforce.Reader.read_batch`."""
    levels, used = checked_recording(single, frames), single.usable(mask)
    batch = Batch.of(len(levels), single.influence.shape[1] // 2, covariance)
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


def checked_recording(single: SingleFrameReader, frames: ArrayLike) -> NDArray[Any]:
    """Frames as an array with a row for each.

    Raises
    ------
    InputError
        If they are none of this sensor.
    """
    levels, shape = np.asarray(frames), single.model.frame_shape
    if levels.shape[1:] != shape or levels.dtype.kind not in "uif":
        raise InputError(
            f"A recording of shape {levels.shape} and type {levels.dtype} does not fit; this "
            f"sensor's are numbers of shape (frames, {', '.join(map(str, shape))})."
        )
    return levels.reshape(len(levels), -1)


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
            if done < len(block):
                _store(result, done, _searched(tracker, block[done], used))
                done += 1
        if progress is not None:
            progress(len(block))


def _bad(single: SingleFrameReader, levels: NDArray[Any], used: Mask) -> Mask:
    """Which frames cannot be used."""
    seen = levels if used.all() else levels[:, used]
    low, high = seen.min(axis=1), seen.max(axis=1)
    return ~((low >= 0) & (high <= single.model.sensor.camera.full_scale) & (low < high))


def _searched(tracker: Tracker, frame: NDArray[Any], used: Mask) -> Reading:
    levels = tracker.single.checked(frame.reshape(tracker.single.model.frame_shape), used)
    return levels if isinstance(levels, Reading) else tracker.search(levels, used)


def _store(batch: Batch, row: int, reading: Reading) -> None:
    batch.forces[row], batch.std[row] = reading.forces, reading.std
    batch.chi2[row], batch.status[row] = reading.chi2, reading.status
    if batch.covariance is not None:
        batch.covariance[row] = reading.covariance


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
    for verdict, status in STATUSES.items():
        batch.status[rows][verdicts == verdict] = status
    if batch.covariance is not None:
        batch.covariance[rows] = covariance
