"""Where a live reader stands: the lock on a sequence of frames, taken, kept and lost."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.blas_threads import one_blas_thread
from fringeforce.estimation.bad_pixels import outlying
from fringeforce.estimation.evaluation import REPORT
from fringeforce.estimation.following import (
    NONE,
    STEP,
    WHOLE,
    TrackerState,
    covariance_at,
    follow_all,
    state_of,
)
from fringeforce.estimation.gauss_newton import Place
from fringeforce.estimation.residual_monitor import begin_trend
from fringeforce.estimation.residual_test import FALSE_CONTACT, absorbed, square_limit
from fringeforce.estimation.running_mean import LAGGING, steady_covariance, update_running_mean
from fringeforce.estimation.strip import Strip
from fringeforce.estimation.track_status import (
    FEW,
    FOLLOWED,
    HELD,
    SILENT,
    UNSETTLED,
    Limits,
    begin,
)
from fringeforce.reading.hypothesis_selection import Hypothesis
from fringeforce.reading.reading import Reading, Status
from fringeforce.reading.single_frame import SingleFrameReader

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

KINDS = ("|u1", "<u2")
"""Kinds of grey levels that the compiled loops take as they are; others become float32."""

STATUSES: Any = np.full(max(FOLLOWED, SILENT, HELD, UNSETTLED) + 1, None, dtype=object)
STATUSES[[FOLLOWED, HELD]] = Status.OK
STATUSES[UNSETTLED], STATUSES[SILENT] = Status.AMBIGUOUS, Status.NO_CONTACT
"""Status of a frame that was followed."""


class Track(NamedTuple):
    """What was found for k frames; arrays of the shapes that `follow_all` wants."""

    loads: Array
    covariances: Array
    reports: NDArray[np.void]
    verdicts: NDArray[np.int64]

    @classmethod
    def of(cls, frames: int, loads: int, covariances: bool) -> Track:
        """Workspace for so many frames."""
        return cls(
            np.empty((frames, loads)),
            np.empty((frames if covariances else 0, loads, loads)),
            np.empty(frames, REPORT),
            np.empty(frames, dtype=np.int64),
        )

    def since(self, first: int) -> tuple[Any, ...]:
        """The arrays from one frame on."""
        return tuple(part[first:] for part in self)


class Tracker:
    """The lock on one sequence of frames.

    It is taken where a search explains a frame, and kept while the frames leave no doubt, or none
    that the last search did not settle.
    """

    def __init__(self, single: SingleFrameReader) -> None:
        self.single = single
        self._used: Mask | None = None
        self._strip: Strip | None = None
        self._sound = np.empty(0, dtype=bool)
        self._place: Place | None = None
        self._last: Place | None = None
        self._tracker: TrackerState | None = None
        self._state: tuple[Any, ...] = ()
        self._excess, self.rivals = np.empty((0, 0)), np.empty((0, 0))

    def release(self) -> None:
        """Give up the lock."""
        self._place = None

    def holds(self, used: Mask) -> bool:
        """Whether there is a lock, on these pixels."""
        if self._place is None or self._used is None:
            return False
        return used is self._used or np.array_equal(used, self._used)

    def packed(self, levels: NDArray[Any], used: Mask) -> NDArray[Any]:
        """Frames (k, n_pixels) as the compiled loops want them."""
        if levels.dtype.str not in KINDS:
            levels = levels.astype(np.float32)
        if not self.single.complete(used):
            levels = np.where(used, levels, 0)  # for those left out may hold no number
        elif not levels.flags.writeable:
            levels = levels.copy()  # or the loops would be compiled again, for arrays like this
        return np.ascontiguousarray(levels)

    def advance(self, frames: NDArray[Any], track: Track, first: int, whole: bool = False) -> int:
        """Follow frames until one is doubtful; returns how many were done before it.

        The lock is lost with it, unless the frames before it together allow to take it anew.

        Parameters
        ----------
        frames : ndarray, shape (k, n_pixels)
            Packed frames.
        track : Track
            Filled from its frame number `first`; covariances if it has room for them.
        whole : bool
            Whether covariances are those of each frame itself rather than of the last step's
            matrix, which may be some frames old.
        """
        if self._place is None or self._strip is None:
            return 0
        wanted = (WHOLE if whole else STEP) if len(track.covariances) else NONE
        silent = not self._place.loads.any()
        done = follow_all(self._state, silent, frames, wanted, *track.since(first))
        if done < len(frames):
            self._last = self._place
            if not self._regain():
                self.release()
        return done

    def _regain(self) -> bool:
        """Search what the last frames show together, where one of them is too noisy to tell.

        Where one frame may be any of several mirror images, the mean of many shows which.  Motion
        in between does not blur it: it is the expected frame where the mean of the loads stands,
        and the mean of what was left of each.
        """
        place, state, strip, used = self._place, self._tracker, self._strip, self._used
        if place is None or state is None or strip is None or used is None:
            return False
        mean = state.mean.copy()[0]
        if not mean["steady"] or mean["recalled"] < FEW or mean["surprise"] > LAGGING:
            return False
        left = np.divide(state.rest, strip.inverse, where=strip.inverse > 0, out=0 * state.rest)
        levels = strip.layout.pick(place.level - left).astype(float)
        spread, start = float(mean["spread"]), place.loads.copy()
        found, sound = self.single.explained(levels, self._sound, spread, start)
        if found.status not in (Status.OK, Status.AMBIGUOUS):
            return False
        self._lock(levels, used, found, sound, mean)
        return True

    @one_blas_thread()
    def search(self, levels: NDArray[Any], used: Mask) -> Reading:
        """Search a frame, also from the last loads, and take the lock if the reading allows it."""
        grey, last = levels.astype(float), self._place or self._last
        start = None if last is None else last.loads.copy()
        found, sound = self.single.explained(grey, used, start=start)
        self.release()
        explained = (Status.OK, Status.NO_CONTACT, Status.AMBIGUOUS)
        if found.status in explained:
            self._lock(grey, used, found, sound)
        return self.single.stated(found, sound)

    def _lock(
        self,
        levels: Array,
        used: Mask,
        found: Hypothesis,
        sound: Mask,
        mean: np.void | None = None,
    ) -> None:
        """Take the lock where a search ended, with what was known of a mean that was searched."""
        response, loads = self.single.model.response, found.loads
        expected = response.level(self.single.influence @ loads)
        # the search, too, leaves out pixels that alone contradict all others
        sound = sound & ~outlying((levels - expected)[None] / np.sqrt(response.variance))
        if self._strip is None or not np.array_equal(sound, self._sound):
            self._strip = self.single.strip.without(sound)
            self._sound, self._tracker = sound, None
        strip, state = self._strip, self._tracker or TrackerState.of(self._strip)
        self._used = used
        self._limits, self._tracker = Limits.of(strip, self._taken(found, sound)), state
        self._place = place = Place.at(strip, loads)
        self._excess = found.covariance - found.noise
        unsettled = found.status is Status.AMBIGUOUS or not found.settled
        state.mean["steady"] = False
        begin_trend(state.lasting, self._confirms(found))
        begin(state.known, unsettled, found.status is Status.NO_CONTACT)
        if unsettled or mean is not None:
            update_running_mean(strip.arrays, place, state.variance, state.mean[0])
        if mean is not None:
            for name in ("frames", "share", "surprise"):
                state.mean[name] = mean[name]
        self._state = state_of(strip, place, state, self._limits)
        self.rivals = np.reshape(found.rivals, (-1, len(loads)))

    def _confirms(self, found: Hypothesis) -> bool:
        """Whether a search found what was followed before it."""
        if self._last is None:
            return False
        off = found.loads - self._last.loads
        square = off @ np.linalg.solve(found.noise, off)
        return bool(square < square_limit(len(off), FALSE_CONTACT))

    def _taken(self, found: Hypothesis, sound: Mask) -> float:
        """Degrees of freedom that the loads take from sums over neighbours."""
        response, influence = self.single.model.response, self.single.influence
        slope = response.slope(influence @ found.loads) / np.sqrt(response.variance)
        return absorbed(np.where(sound, slope, 0), influence, found.noise)

    def noise(self, loads: Array, verdict: int) -> Callable[[], Array]:
        """What computes the covariance of the frame that was followed last, shape (2n, 2n)."""
        if self._strip is None or self._place is None or self._tracker is None:
            raise RuntimeError("There is no lock yet.")
        if not self._tracker.mean["steady"][0]:
            return partial(covariance_at, self._strip, loads)
        place, variance = self._place, self._tracker.variance
        # as they are now: they move with the next frame
        mean = place.slope.copy(), place.work.root.copy(), variance.copy()
        return partial(_steady, self._strip, mean, self.excess(verdict))

    def excess(self, verdict: int) -> Array:
        """What the last search's doubts add to the covariance of a frame, shape (2n, 2n) [N^2]."""
        return self._excess if verdict in (HELD, UNSETTLED) else np.zeros_like(self._excess)

    def chi2(self, reports: NDArray[np.void] | np.void) -> Array:
        """Reduced chi-square of frames that were followed, shape (k,)."""
        return np.asarray(reports["squares"] / self._limits.pixels)

    @property
    def widens(self) -> bool:
        """Whether deviations have other causes than noise."""
        return self.single.model.imaging is not None

    def widened(self, noise: Array, loads: Array) -> Array:
        """Covariance from all causes, given that from noise, shape (2n, 2n) [N^2]."""
        return noise + self.single.calibration_covariance(loads, self._sound, noise)


def _steady(strip: Strip, mean: tuple[Any, Any, Any], excess: Array) -> Array:
    """Covariance of a frame that was read from a mean, shape (2n, 2n) [N^2]."""
    result = np.empty_like(excess)
    steady_covariance(strip.arrays, *mean, result)
    return result + excess
