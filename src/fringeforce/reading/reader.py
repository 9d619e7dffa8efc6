"""Frames of any sensor to readings: followed from one to the next, or searched."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, ThreadPoolExecutor, as_completed
from dataclasses import replace
from functools import cached_property
from itertools import repeat
from weakref import WeakSet

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import InputError
from fringeforce.estimation.hypotheses import CONFIDENCE
from fringeforce.models.creep import checked_times
from fringeforce.models.pad import PadModel
from fringeforce.models.strip import SensorModel
from fringeforce.reading.batch import Batch, checked_recording
from fringeforce.reading.diagnosis import Diagnosis
from fringeforce.reading.findings import UNEXPLAINED
from fringeforce.reading.frame_order import (
    encoding_otherwise,
    fitting_order,
    fitting_response,
    turned,
    with_other_channels,
)
from fringeforce.reading.frame_reader import Follower, FrameReader
from fringeforce.reading.pads.diagnosis import PadSkinDiagnosis, PadSquaresDiagnosis
from fringeforce.reading.pads.following import PadFollower
from fringeforce.reading.pads.single_frame import PadFrameReader
from fringeforce.reading.pads.skin_reader import PadSkinFollower, PadSkinReader
from fringeforce.reading.reading import Reading, Status
from fringeforce.reading.skin_creep import following
from fringeforce.reading.skin_diagnosis import SkinDiagnosis
from fringeforce.reading.skin_following import SkinFollower
from fringeforce.reading.skin_reader import SkinReader
from fringeforce.reading.strip_following import StripFollower
from fringeforce.reading.strip_reader import StripFrameReader
from fringeforce.reading.temperature import checked_scales, scale_batch

Array = NDArray[np.float64]
Findings = Callable[[NDArray, NDArray[np.bool_]], tuple[str, ...]]
"""Sentences about a frame from its grey levels and the pixels that count."""

TRIALS = 1.0, 1.0, 0.02, 0.0, 0.0
"""Shares of the trial loads in frames that are read to compile all loops: found, followed, hardly
seen, and gone for two frames; one of mere noise, which no load explains, comes after them."""
SHORTEST_PART = 512
"""Frames below which a part of a recording is not worth a worker of its own."""
_READERS: WeakSet[Reader] = WeakSet()
"""All of this process, for the processes that are forked from it."""


def _of_strip(single: FrameReader) -> Findings:
    assert isinstance(single, StripFrameReader)
    diagnosis = Diagnosis(single)
    return lambda levels, used: diagnosis.findings(np.where(used, levels.astype(float), np.nan))


def _of_skin(single: FrameReader) -> Findings:
    assert isinstance(single, SkinReader)
    return SkinDiagnosis(single).findings


def _of_pad(single: FrameReader) -> Findings:
    assert isinstance(single, PadFrameReader)
    return PadSquaresDiagnosis(single).findings


def _of_pad_skin(single: FrameReader) -> Findings:
    assert isinstance(single, PadSkinReader)
    return PadSkinDiagnosis(single).findings


def _following_skin(single: FrameReader) -> Follower:
    assert isinstance(single, SkinReader)
    return following(SkinFollower(single))


def _following_pad_skin(single: FrameReader) -> Follower:
    assert isinstance(single, PadSkinReader)
    return following(PadSkinFollower(single))


_KINDS: dict[
    str, tuple[type[FrameReader], Callable[..., Follower], Callable[[FrameReader], Findings]]
] = {
    "strip": (StripFrameReader, StripFollower, _of_strip),
    "skin": (SkinReader, _following_skin, _of_skin),
    "pad": (PadFrameReader, PadFollower, _of_pad),
    "pad skin": (PadSkinReader, _following_pad_skin, _of_pad_skin),
}
"""What reads single frames, what follows them, and what diagnoses them, by the kind of sensor."""


class Reader:
    """Reads the frames of one sensor, strip or pad, in the order in which they were taken.

    A frame starts from the loads of the last one, which takes tens of microseconds for a strip and
    some hundredths of a second for a pad; the first frame, and every one that this does not explain
    for certain, is searched as by `search`, which takes milliseconds, or a second for a pad.

    Of a strip, previous frames select between equivalent loads if the motion was small: a followed
    reading is OK where the frame alone would be AMBIGUOUS.  Otherwise, as after a jump, a full
    search runs.  Frames after an ambiguous one are AMBIGUOUS, with its alternatives, until a search
    settles it, which runs after one frame, then at doubling intervals.  Where forces are so weak
    that hardly a fringe shows, the mean of the frames since the last search is searched after 16 of
    them, then 64 and so on; it distinguishes loads that no single frame can, while the contact
    hardly moves.

    Threads may share a reader: each frame waits until the one before it has been read.  Readers can
    be pickled, with what they follow.  A process that is forked while a thread reads begins with a
    search.

    The loops of a strip take about a minute to compile on the first use on a machine, and half a
    second to load in each process; `prepare` does it before the first frame comes.

    Parameters
    ----------
    model : SensorModel or PadModel
        The characterised sensor.
    friction : float, optional
        If given, forces are limited to N >= 0 and |T| <= friction N; strips only.  Searches allow
        for 2, softly, or for it where contacts have uncertain places or widths.
    confidence : float
        Probability of the likeliest explanation from which a reading is OK.
    history : float
        Of a sensor with tactels that relaxes: standard deviation of forces that may have acted on
        each tactel for long before the first frame, whose creep is left [N].

    Raises
    ------
    InputError
        If a limit is out of range, or given for a pad.

    Examples
    --------
    >>> model = ff.characterize(ff.load_sensor("saad"))
    >>> frames = model.expose([ff.polar(1.0, angle=10, n=11)] * 3, rng=0)
    >>> reader = ff.Reader(model)
    >>> [reading.tracked for reading in reader.stream(frames)]
    [False, True, True]

    >>> pad = ff.load_sensor("pad").replace(
    ...     tactels={"count": [3, 3]}, camera={"pixels": [64, 64]}
    ... )
    >>> model = ff.characterize(pad)
    >>> forces = np.zeros((9, 3))
    >>> forces[4, 0] = 2.0  # the middle one, pressed
    >>> reading = ff.Reader(model).read(model.expose(forces, rng=0))
    >>> reading.status.name, round(float(reading.forces[4, 0]), 1)
    ('OK', 2.0)
    """

    def __init__(
        self,
        model: SensorModel | PadModel,
        friction: float | None = None,
        confidence: float = CONFIDENCE,
        history: float = 0.0,
    ) -> None:
        if not isinstance(model, SensorModel | PadModel):
            raise InputError(
                f"A reader takes a model, and this is of the kind {type(model).__name__}; make one "
                "with characterize(sensor), or take one from load_model(path)."
            )
        kind = model.sensor.kind
        if model.sensor.skin is not None:
            kind = "skin" if kind == "strip" else "pad skin"
        single, self._follow, self._diagnoses = _KINDS[kind]
        self._single = single(model, friction, confidence)
        self._follower, self._ready = self._follow(self._single), False
        self._history, self._turn = history, threading.RLock()
        self._creep = self._single.creep_filter(self._history)
        _READERS.add(self)

    def __getstate__(self) -> dict[str, object]:
        """All but the lock, which is of one process."""
        return {name: value for name, value in vars(self).items() if name != "_turn"}

    def __setstate__(self, state: dict[str, object]) -> None:
        """A reader of another process, or a copy."""
        vars(self).update(state, _turn=threading.RLock())
        _READERS.add(self)

    @property
    def model(self) -> SensorModel | PadModel:
        """The sensor that is read."""
        return self._single.model

    @property
    def needs_times(self) -> bool:
        """Whether frames show earlier loads too, so that readings take the time of each."""
        return self._single.relaxes

    def reset(self) -> None:
        """Forget the last reading, and all loads before: the next frame is searched."""
        with self._turn:
            self._follower.reset()
            if self._creep is not None:
                self._creep.reset()

    def prepare(self) -> None:
        """Compile or load the compiled loops, which the first frame would wait for otherwise.

        Raises
        ------
        InputError
            If frames of a pad cannot be read without an earlier state.
        """
        if self._ready:
            return
        trial, used = self._follow(self._single), self._single.usable(None)
        rng = np.random.default_rng(0)
        frames = [self._single.trial(share, rng) for share in TRIALS]
        noise = rng.integers(0, self.model.sensor.camera.full_scale, frames[0].shape, endpoint=True)
        for frame in (*frames, noise.astype(frames[0].dtype)):
            trial.read(frame.ravel(), used).std  # noqa: B018, they are computed when asked for
        self._ready = True

    def bound(self, forces: ArrayLike) -> Array:
        """Smallest deviations that an unbiased reading of one frame can have.

        The Cramer-Rao bound for Gaussian noise of the camera's variance; infinite where a frame
        does not change with a force to first order, as that of a strip without load.

        Parameters
        ----------
        forces : array_like, shape (n, components)
            Forces that act [N].

        Returns
        -------
        ndarray, shape (n, components)
            Standard deviations [N].
        """
        return self._single.bound(forces)

    def read(
        self,
        frame: ArrayLike,
        mask: ArrayLike | None = None,
        time: float | None = None,
        temperature: float | None = None,
    ) -> Reading:
        """Read the next frame.

        Parameters
        ----------
        frame : array_like, shape (n_pixels,) or (rows, columns), channels first if there are any
            Grey levels.
        mask : array_like of bool, shape of a frame, optional
            Pixels to leave out, such as dead ones, where true.
        time : float, optional
            When it was exposed [s]; needed of a sensor that relaxes, whose creep is taken out.
        temperature : float, optional
            Of the photoelastic layer [K], of designs that state what it does to the light; as at
            the design's reference temperature if not given.

        Returns
        -------
        Reading
            Never an error for a bad frame: its status says what to do, and the next frame is read
            as if the bad one had not come.

        Raises
        ------
        InputError
            If the mask does not fit the sensor, if the polariscope of a pad cannot tell a force
            from its negative, or if the time of a frame of a sensor that relaxes is missing.
        """
        used = self._single.usable(mask)
        levels = self._single.checked(frame, used)
        own, scales = self._times(time, 1), checked_scales(self.model.sensor, temperature, 1)
        if isinstance(levels, Reading):
            return levels
        scale, std = (1.0, 0.0) if scales is None else (float(part[0]) for part in scales)
        with self._turn:
            if len(own):
                self._follower.expect(own, np.array([scale]))
            reading = self._diagnosed(self._follower.read(levels, used), levels, used)
            if scales is not None:
                reading = reading.scaled(1 / scale, std / scale)
            return reading if self._creep is None else self._creep.reading(reading, float(own[0]))

    def _times(self, times: ArrayLike | None, frames: int) -> Array:
        """Times of frames of a sensor that relaxes; none of others."""
        if not self.needs_times:
            return np.empty(0)
        if times is None:
            raise InputError(
                "This sensor relaxes, so that its frames show earlier loads too; give the time of "
                "each frame, time= or times=, in seconds."
            )
        return checked_times(np.atleast_1d(times), frames)

    def search(
        self, frame: ArrayLike, mask: ArrayLike | None = None, start: ArrayLike | None = None
    ) -> Reading:
        """Read one frame without any earlier state; the next one is followed from earlier ones.

        Parameters
        ----------
        frame, mask
            As of `read`.
        start : array_like, shape (n, 3), optional
            Forces of a pad that are nearly right, to start from instead of a search [N].

        Raises
        ------
        InputError
            As of `read`, or if a start is given for a strip.
        """
        used = self._single.usable(mask)
        levels = self._single.checked(frame, used)
        if isinstance(levels, Reading):
            return levels
        begin = None if start is None else np.asarray(start, dtype=float)
        return self._diagnosed(self._single.search(levels, used, begin), levels, used)

    def _diagnosed(self, reading: Reading, levels: NDArray, used: NDArray[np.bool_]) -> Reading:
        """A reading that says what seems wrong, if no load explains its frame."""
        if reading.status is not Status.MODEL_MISMATCH or reading.findings:
            return reading
        return reading.with_findings(lambda: self._diagnosis(levels, used))

    def _diagnosis(self, levels: NDArray, used: NDArray[np.bool_]) -> tuple[str, ...]:
        """What departs from the design, or how else a frame would fit.

        Departures take longest, but on a skin, of which searches in vain do: it is turned last.
        """
        if found := fitting_response(self._encoding_otherwise, levels, used):
            return found
        single, of_skin = self._single, self.model.sensor.skin is not None
        if not of_skin and (found := fitting_order(single, levels, used, turned(single))):
            return found
        found = self._departures(levels, used)
        if found != (UNEXPLAINED,):
            return found
        orders = [*with_other_channels(single), *(turned(single) if of_skin else ())]
        return fitting_order(single, levels, used, orders) or found

    @cached_property
    def _encoding_otherwise(self) -> FrameReader:
        return encoding_otherwise(self._single)

    @cached_property
    def _departures(self) -> Findings:
        return self._diagnoses(self._single)

    def stream(
        self,
        frames: Iterable[ArrayLike],
        mask: ArrayLike | None = None,
        times: Iterable[float] | None = None,
        temperatures: Iterable[float] | None = None,
    ) -> Iterator[Reading]:
        """Read frames one after the other, as they come.

        Parameters
        ----------
        frames : iterable of array_like
            Frames as `read` takes them.
        mask : array_like of bool, shape of a frame, optional
            Pixels to leave out of all frames, where true.
        times : iterable of float, optional
            When they were exposed, as of `read` [s].
        temperatures : iterable of float, optional
            Of the photoelastic layer, as of `read` [K].

        Yields
        ------
        Reading
            One for each frame.
        """
        when, warm = (repeat(None) if one is None else one for one in (times, temperatures))
        for frame, time, temperature in zip(frames, when, warm, strict=False):
            yield self.read(frame, mask, time, temperature)

    def read_on(
        self,
        frames: ArrayLike,
        covariance: bool = False,
        mask: ArrayLike | None = None,
        progress: Callable[[int], None] | None = None,
        times: ArrayLike | None = None,
        temperatures: ArrayLike | None = None,
    ) -> Batch:
        """Read the next frames at once; those of a strip much faster than one by one.

        Parameters
        ----------
        frames : array_like, shape (k, ...) as frames
            Grey levels of the frames that follow the last one.
        covariance, mask, progress, times, temperatures
            As of `read_batch`.
        """
        if self._one_by_one:
            return self._each(frames, covariance, mask, progress, times, temperatures)
        levels, batch = self._prepared(frames, covariance or self._creep is not None)
        own, used = self._times(times, len(batch)), self._single.usable(mask)
        scales = checked_scales(self.model.sensor, temperatures, len(batch))
        with self._turn:
            if len(own):
                self._follower.expect(own, np.ones(len(own)) if scales is None else scales[0])
            self._follower.read_on(levels, used, batch, progress)
            if scales is not None:
                scale_batch(batch, *scales)
            if self._creep is not None:
                self._creep.batch(batch, own)
        return batch if covariance else replace(batch, covariance=None)

    @property
    def _one_by_one(self) -> bool:
        """Whether covariances, which tell creep from a contact, are too large to keep of frames."""
        return self._creep is not None and self.model.sensor.dimensions > 1

    def _each(
        self,
        frames: ArrayLike,
        covariance: bool,
        mask: ArrayLike | None,
        progress: Callable[[int], None] | None,
        times: ArrayLike | None,
        temperatures: ArrayLike | None,
    ) -> Batch:
        """Read the next frames one after the other, as of `read_on`."""
        _, batch = self._prepared(frames, covariance)
        when, sensor = self._times(times, len(batch)), self.model.sensor
        checked_scales(sensor, temperatures, len(batch))
        warm = np.broadcast_to(temperatures, len(batch)) if temperatures is not None else None
        for row, reading in enumerate(self.stream(np.asarray(frames), mask, when, warm)):
            batch.store(row, reading)
            if progress is not None:
                progress(1)
        return batch

    def read_batch(
        self,
        frames: ArrayLike,
        covariance: bool = True,
        mask: ArrayLike | None = None,
        workers: int | None = None,
        progress: Callable[[int], None] | None = None,
        times: ArrayLike | None = None,
        temperatures: ArrayLike | None = None,
    ) -> Batch:
        """Read a recording on all processor cores; independent of what was read before.

        The recording is cut into as many parts as there are workers, each of which begins with a
        search and is followed from there.  A pad or a skin that relaxes is read in one part, for
        what earlier frames left is known before each.

        Parameters
        ----------
        frames : array_like, shape (k, ...) as frames
            Grey levels of consecutive frames.
        covariance : bool
            Whether to keep the covariance of every frame, a megabyte each for a pad of 121 tactels.
            Those of an exact strip are of the very frames; without them deviations may be some
            frames old, right within 2 % root mean square, and reading takes half the time.
        mask : array_like of bool, shape of a frame, optional
            Pixels to leave out of all frames, where true.
        workers : int, optional
            Parts that are read at the same time; one for each core if not given.
        progress : callable, optional
            Called with numbers of frames as they are done, from any thread.
        times : array_like, shape (k,), optional
            When they were exposed, as of `read` [s].
        temperatures : float or array_like, shape (k,), optional
            Of the photoelastic layer, for all frames or each, as of `read` [K].
        """
        if self._one_by_one:
            other = Reader(self.model, history=self._history, confidence=self._single.confidence)
            return other._each(frames, covariance, mask, progress, times, temperatures)
        creep = self._single.creep_filter(self._history)
        levels, batch = self._prepared(frames, covariance or creep is not None)
        own = self._times(times, len(batch))
        scales = checked_scales(self.model.sensor, temperatures, len(batch))
        used = self._single.usable(mask)
        count = max(1, min(workers or os.cpu_count() or 1, len(levels) // SHORTEST_PART))
        if self.needs_times and creep is None:  # each frame is read with what the ones before left
            count = 1
        ends = np.linspace(0, len(levels), count + 1).astype(int)
        parts = [slice(*ends[i : i + 2]) for i in range(count)]
        ended = threading.Event()

        def told(frames: int) -> None:
            if ended.is_set():
                raise CancelledError
            if progress is not None:
                progress(frames)

        def read(rows: slice) -> None:
            follower = self._follow(self._single)
            if len(own):
                known = np.ones(len(own)) if scales is None else scales[0]
                follower.expect(own[rows], known[rows])
            follower.read_on(levels[rows], used, batch[rows], told)

        with ThreadPoolExecutor(count) as pool:
            try:
                jobs = [pool.submit(read, rows) for rows in parts]
                for job in as_completed(jobs):
                    job.result()
            except BaseException:  # such as Ctrl-C: the pool waits for frames that are begun
                ended.set()
                raise
        if scales is not None:
            scale_batch(batch, *scales)
        if creep is not None:
            creep.smoothed(batch, own)
        return batch if covariance else replace(batch, covariance=None)

    def _prepared(self, frames: ArrayLike, covariance: bool) -> tuple[NDArray, Batch]:
        """Grey levels of a recording with a row for each frame, and room for their readings."""
        levels = checked_recording(frames, self.model.frame_shape)
        skin = getattr(self.model.sensor, "skin", None) is not None
        batch = Batch.of(len(levels), self._single.forces_shape, covariance, skin)
        return levels.reshape(len(levels), -1), batch


def _begin_fork() -> None:
    """Let no reader wait for a thread that the process before the fork had, and this one has not.

    What that thread was reading is half done, and is forgotten.
    """
    for reader in list(_READERS):
        busy = not reader._turn.acquire(blocking=False)
        reader._turn = threading.RLock()
        if busy:
            reader._follower = reader._follow(reader._single)
            reader._creep = reader._single.creep_filter(reader._history)


if hasattr(os, "register_at_fork"):  # not on Windows, which has no forks
    os.register_at_fork(after_in_child=_begin_fork)
