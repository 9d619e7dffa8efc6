"""Frames of a strip as they come: followed from one to the next, searched where in doubt."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.contacts.friction_cone import within_friction_cone
from fringeforce.estimation.track_status import HELD, SILENT, UNSETTLED
from fringeforce.reading.batch import Batch, Progress
from fringeforce.reading.frame_reader import Follower
from fringeforce.reading.reading import Reading
from fringeforce.reading.single_frame import SingleFrameReader
from fringeforce.reading.tracker import STATUSES, Track, Tracker

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BLOCK = 256
"""Frames that are handed to the compiled loop at a time."""


class StripFollower(Follower):
    """Reads the frames of one strip in the order in which they were taken.

    Parameters
    ----------
    single : SingleFrameReader
        What searches.
    """

    def __init__(self, single: SingleFrameReader) -> None:
        self._single, self._tracker = single, Tracker(single)
        self._track = Track.of(1, single.influence.shape[1], covariances=False)

    def reset(self) -> None:
        """Forget the last reading: the next frame is searched."""
        self._tracker.release()

    def read(self, levels: NDArray[Any], used: Mask) -> Reading:
        """Read the next frame, which was checked, shape (P,)."""
        tracker = self._tracker
        packed = tracker.packed(levels[None], used) if tracker.holds(used) else levels
        while tracker.holds(used):
            if tracker.advance(packed, self._track, 0):
                return self._followed()
        return tracker.search(levels, used)

    def read_on(
        self, levels: NDArray[Any], used: Mask, batch: Batch, progress: Progress | None = None
    ) -> None:
        """Fill in the readings of the next frames, shape (k, P), which were not checked."""
        single, tracker = self._single, self._tracker
        if not tracker.holds(used):
            tracker.release()
        track = Track.of(min(BLOCK, len(levels)), single.influence.shape[1], covariances=True)
        whole = batch.covariance is not None
        for first in range(0, len(levels), BLOCK):
            block, result = levels[first : first + BLOCK], batch[first : first + BLOCK]
            packed, bad = tracker.packed(block, used), single.suspicious(block, used)
            done = 0
            while done < len(block):
                ahead = bad[done:].argmax() if bad[done:].any() else len(block) - done
                followed = tracker.advance(packed[done : done + ahead], track, done, whole)
                if followed:
                    rows = slice(done, done + followed)
                    _store_track(tracker, track, rows, result)
                done += followed
                if done < len(block) and (bad[done] or not tracker.holds(used)):
                    frame = block[done].reshape(single.model.frame_shape)
                    checked = single.checked(frame, used)
                    if not isinstance(checked, Reading):
                        checked = tracker.search(checked, used)
                    result.store(done, checked)
                    done += 1
            if progress is not None:
                progress(len(block))

    def _followed(self) -> Reading:
        single, tracker = self._single, self._tracker
        loads, verdict = self._track.loads[0].copy(), self._track.verdicts[0]
        spread: Callable[[], Array]
        if verdict == SILENT:
            spread = partial(getattr, single, "silent_covariance")
        else:
            spread = tracker.noise(loads, verdict)
            if tracker.widens:
                spread = partial(_widened, tracker, spread, loads)
        limited = np.zeros(len(loads) // 2, dtype=bool)
        rivals = tracker.rivals if verdict == UNSETTLED else tracker.rivals[:0]
        if single.friction is not None:
            covariance = spread()
            loads, limited = within_friction_cone(loads, covariance, single.friction)
            spread = partial(np.asarray, covariance)
        forces = loads.reshape(-1, 2)
        return Reading.of(
            forces=forces,
            chi2=float(tracker.chi2(self._track.reports[0])),
            status=STATUSES[verdict],
            covariance=spread,
            phase=partial(single.model.phase, forces),
            alternatives=rivals.reshape(-1, *forces.shape),
            limited=limited,
            tracked=True,
        )


def _store_track(tracker: Tracker, track: Track, rows: slice, batch: Batch) -> None:
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
            covariance[i] = tracker.widened(covariance[i], loads[i])
    if (friction := tracker.single.friction) is not None:
        for i in range(len(loads)):
            loads[i], _ = within_friction_cone(loads[i], covariance[i], friction)
    shape = batch.forces[rows].shape
    batch.forces[rows] = loads.reshape(shape)
    batch.std[rows] = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).reshape(shape)
    batch.chi2[rows], batch.tracked[rows] = tracker.chi2(track.reports[rows]), True
    batch.status[rows] = STATUSES[verdicts]
    if batch.covariance is not None:
        batch.covariance[rows] = covariance


def _widened(tracker: Tracker, noise: Callable[[], Array], loads: Array) -> Array:
    return tracker.widened(noise(), loads)
