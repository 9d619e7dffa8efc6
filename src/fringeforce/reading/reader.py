"""Frames as they come to readings as they come: followed from one to the next, or searched."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.contacts.friction_cone import admissible
from fringeforce.estimation.track_status import SILENT, UNSETTLED
from fringeforce.models.strip import SensorModel
from fringeforce.reading.batch import Batch
from fringeforce.reading.reading import Reading
from fringeforce.reading.recording import prepared, read_batch, read_on
from fringeforce.reading.single_frame import SingleFrameReader
from fringeforce.reading.tracker import STATUSES, Track, Tracker

Array = NDArray[np.float64]


class Reader:
    """Reads the frames of one sensor in the order in which they were taken.

    A frame starts from the loads of the last one, which takes tens of microseconds; the first
    frame, and every one that this does not explain beyond doubt, is searched as by
    `search`, which takes milliseconds.  What several loads explain equally well the way there
    decides: a followed reading is OK where the frame alone would be AMBIGUOUS.  The way is trusted
    while it is short against the way to any mirror image; after a jump the search decides again.
    Where forces are so weak that it is not short, the word of a search holds for some frames; then
    followed frames are AMBIGUOUS, with the loads that the way makes likeliest, until the next one.
    That one searches the mean of the last frames, if there are enough and they show one touch that
    hardly moves: it tells mirror images apart that no single frame can.

    The loops take about a minute to compile on the first use on a machine, and half a second to
    load in each process; `prepare` does it before the first frame comes.

    Parameters
    ----------
    model : SensorModel
        The characterised sensor.
    friction : float, optional
        If given, forces are limited to N >= 0 and |T| <= friction N.
    model_error : float
        Relative size of smooth errors in the shape of the influence matrix, such as 0.03 for a
        sensor that was characterised from its drawing and never calibrated; it widens the
        deviations.  Without it a frame that shows such errors reads MODEL_MISMATCH; for followed
        frames this is looked at where their residuals are not plainly noise.

    Examples
    --------
    >>> model = ff.characterize(ff.load_sensor("saad"))
    >>> frames = model.expose([ff.polar(1.0, angle=10, n=11)] * 3, rng=0)
    >>> reader = ff.Reader(model)
    >>> [reading.tracked for reading in reader.stream(frames)]
    [False, True, True]
    """

    def __init__(
        self, model: SensorModel, friction: float | None = None, model_error: float = 0.0
    ) -> None:
        self._single = SingleFrameReader(model, friction, model_error)
        self._tracker = Tracker(self._single)
        self._track = Track.of(1, self._single.influence.shape[1], covariances=False)

    @property
    def model(self) -> SensorModel:
        """The sensor that is read."""
        return self._single.model

    def reset(self) -> None:
        """Forget the last reading: the next frame is searched."""
        self._tracker.release()

    def prepare(self) -> None:
        """Compile or load the compiled loops, which the first frame would wait for otherwise."""
        n = self.model.sensor.tactels.count
        frame = self.model.expose(np.tile([1.0, 0.0], (n, 1)), rng=0)
        trial = Reader(self.model)
        for _ in range(2):
            trial.read(frame).std  # noqa: B018, for the deviations are computed when asked for

    def read(self, frame: ArrayLike, mask: ArrayLike | None = None) -> Reading:
        """Read the next frame.

        Parameters
        ----------
        frame : array_like, shape (n_pixels,) or (n_channels, n_pixels)
            Grey levels.
        mask : array_like of bool, shape of a frame, optional
            Pixels to leave out, where true.

        Returns
        -------
        Reading
            Never an error for a bad frame: its status says what to do, and the next frame is read
            as if the bad one had not come.

        Raises
        ------
        InputError
            If the mask does not fit the sensor.
        """
        used = self._single.usable(mask)
        levels = self._single.checked(frame, used)
        if isinstance(levels, Reading):
            return levels
        tracker = self._tracker
        packed = tracker.packed(levels[None], used) if tracker.holds(used) else levels
        while tracker.holds(used):
            if tracker.advance(packed, self._track, 0):
                return self._followed(levels)
        return tracker.search(levels, used)

    def search(self, frame: ArrayLike, mask: ArrayLike | None = None) -> Reading:
        """Read one frame without any earlier state; the next one is followed from earlier ones.

        Parameters
        ----------
        frame, mask
            As of `read`.
        """
        return self._single.read(frame, mask)

    def stream(self, frames: Iterable[ArrayLike]) -> Iterator[Reading]:
        """Read frames one after the other, as they come."""
        for frame in frames:
            yield self.read(frame)

    def read_on(
        self, frames: ArrayLike, covariance: bool = False, mask: ArrayLike | None = None
    ) -> Batch:
        """Read the next frames at once, much faster than one by one.

        Parameters
        ----------
        frames : array_like, shape (k, n_pixels) or (k, n_channels, n_pixels)
            Grey levels of the frames that follow the last one.
        covariance, mask
            As of `read_batch`.
        """
        levels, batch = prepared(self._single, frames, covariance)
        read_on(self._tracker, levels, self._single.usable(mask), batch)
        return batch

    def read_batch(
        self,
        frames: ArrayLike,
        covariance: bool = True,
        mask: ArrayLike | None = None,
        workers: int | None = None,
        progress: Callable[[int], None] | None = None,
    ) -> Batch:
        """Read a recording on all processor cores; independent of what was read before.

        The recording is cut into as many parts as there are workers, each of which begins with a
        search and is followed from there.

        Parameters
        ----------
        frames : array_like, shape (k, n_pixels) or (k, n_channels, n_pixels)
            Grey levels of consecutive frames.
        covariance : bool
            Whether to keep the covariance of every frame, from all of its pixels; otherwise the
            batch holds deviations only, right within 5 %, and reading takes half the time.
        mask : array_like of bool, shape of a frame, optional
            Pixels to leave out of all frames, where true.
        workers : int, optional
            Parts that are read at the same time; one for each core if not given.
        progress : callable, optional
            Called with numbers of frames as they are done, from any thread.
        """
        return read_batch(self._single, frames, covariance, mask, workers, progress)

    def _followed(self, levels: NDArray[Any]) -> Reading:
        single, tracker = self._single, self._tracker
        loads, verdict = self._track.loads[0].copy(), self._track.verdicts[0]
        spread: Callable[[], Array]
        if verdict == SILENT:
            spread = partial(getattr, single, "silent_covariance")
        else:
            spread = tracker.noise(loads, verdict)
            if tracker.widens:
                spread = partial(_widened, tracker, spread, loads, levels.copy())
        limited = np.zeros(len(loads) // 2, dtype=bool)
        rivals = tracker.rivals if verdict == UNSETTLED else tracker.rivals[:0]
        known: dict[str, Any] = {
            "chi2": float(tracker.chi2(self._track.reports[0])),
            "status": STATUSES[verdict],
            "detail": "",
            "alternatives": rivals.reshape(-1, len(loads) // 2, 2),
            "tracked": True,
        }
        if single.friction is not None:
            covariance = spread()
            loads, limited = admissible(loads, covariance, single.friction)
            spread = partial(np.asarray, covariance)
        known |= {"forces": loads.reshape(-1, 2), "limited": limited}
        phase = partial(self.model.phase, known["forces"])
        return Reading.deferred(known, {"covariance": spread, "phase": phase})


def _widened(
    tracker: Tracker, noise: Callable[[], Array], loads: Array, levels: NDArray[Any]
) -> Array:
    return tracker.widened(noise(), loads, levels)
