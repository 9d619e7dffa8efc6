"""Frames of a strip with tolerances as they come: filtered from one to the next, or searched."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.contacts.friction_cone import within_friction_cone
from fringeforce.estimation.followed_frames import AGEING, DONE, STALE
from fringeforce.estimation.information_filter import InformationFilter
from fringeforce.estimation.posterior import Top
from fringeforce.reading.batch import Batch, Progress
from fringeforce.reading.frame_reader import Follower
from fringeforce.reading.posterior_reader import FAINT, Located, PosteriorReader
from fringeforce.reading.reading import Reading, Status

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BLOCK = 256
"""Frames that are handed to the compiled loop at a time."""


@dataclass(frozen=True, eq=False)
class Followed:
    """Frames in a row that were followed.

    Attributes
    ----------
    loads, std : ndarray, shape (k, 2n)
        Forces and their standard deviations [N].
    covariances : ndarray, shape (k or 0, 2n, 2n)
        Of each frame's loads [N^2].
    squares : ndarray, shape (k, 2)
        Squared residuals and their number.
    """

    loads: Array
    std: Array
    covariances: Array
    squares: Array

    @classmethod
    def of(cls, frames: int, loads: int, covariances: bool) -> Followed:
        """Room for so many frames."""
        return cls(
            np.empty((frames, loads)),
            np.empty((frames, loads)),
            np.empty((frames if covariances else 0, loads, loads)),
            np.empty((frames, 2)),
        )

    def __getitem__(self, rows: slice) -> Followed:
        """Some of the frames."""
        return Followed(
            self.loads[rows], self.std[rows], self.covariances[rows], self.squares[rows]
        )


class PosteriorFollower(Follower):
    """Reads the frames of one strip with tolerances in the order in which they were taken.

    An OK reading begins a filter that follows its explanation.  Where a frame contradicts the
    filter, it is read alone, from the last unknowns at first, and its own reading begins another
    filter, so that what contradicts is forgotten.

    Parameters
    ----------
    single : PosteriorReader
        What searches.
    """

    def __init__(self, single: PosteriorReader) -> None:
        self._single = single
        self.reset()

    def reset(self) -> None:
        """Forget the last reading: the next frame is searched."""
        self._filter: InformationFilter | None = None
        self._used = np.empty(0, bool)
        self._probability = 0.0

    def read(self, levels: NDArray[Any], used: Mask) -> Reading:
        """Read the next frame, which was checked, shape (P,)."""
        followed = Followed.of(1, self._single.uncertain.frame.at.loads, covariances=True)
        if not self._follow(levels[None], used, followed):
            return self._read_alone(levels, used)
        single = self._single
        loads, covariance = followed.loads[0], followed.covariances[0]
        limited = np.zeros(len(loads) // 2, dtype=bool)
        if single.friction is not None:
            loads, limited = within_friction_cone(loads, covariance, single.friction)
        top = Top(loads, 0.0, *followed.squares[0])
        return single.reading(
            loads, covariance, top, Status.OK, self._probability, limited, np.empty(0), True
        )

    def read_on(
        self, levels: NDArray[Any], used: Mask, batch: Batch, progress: Progress | None = None
    ) -> None:
        """Fill in the readings of the next frames, shape (k, P), which were not checked."""
        single, whole = self._single, batch.covariance is not None
        whole = whole or single.friction is not None
        room = Followed.of(min(BLOCK, len(levels)), single.uncertain.frame.at.loads, whole)
        for first in range(0, len(levels), BLOCK):
            block, result = levels[first : first + BLOCK], batch[first : first + BLOCK]
            bad, done = single.suspicious(block, used), 0
            while done < len(block):
                ahead = int(bad[done:].argmax()) if bad[done:].any() else len(block) - done
                count = self._follow(block[done : done + ahead], used, room)
                if count:
                    self._store(room[:count], result[done : done + count])
                    done += count
                if done < len(block):
                    checked = single.checked(block[done].reshape(single.model.frame_shape), used)
                    if not isinstance(checked, Reading):
                        checked = self._read_alone(checked, used)
                    result.store(done, checked)
                    done += 1
            if progress is not None:
                progress(len(block))

    def _read_alone(self, levels: NDArray[Any], used: Mask) -> Reading:
        last = None if self._filter is None else self._filter.unknowns
        reading, located = self._single.followed(levels, used, last)
        self._filter = None
        if located is not None:
            self._begin(located, reading.probability, used)
        return reading

    def _begin(self, located: Located, probability: float, used: Mask) -> None:
        posterior, top = located
        uncertain = self._single.uncertain
        self._filter = InformationFilter(
            posterior.model, posterior.prior, uncertain.lasting, used, FAINT, top.unknowns.copy()
        )
        about = posterior.linearised(top)
        self._filter.begin(about, posterior.spread(top))
        self._probability, self._used = probability, used

    def _follow(self, levels: NDArray[Any], used: Mask, room: Followed) -> int:
        """Read frames, shape (k, P), as far as the filter explains them; returns how many."""
        done, own = 0, self._filter
        if own is None or not len(levels):
            return done
        if used is not self._used and not np.array_equal(used, self._used):
            return done
        frames = np.ascontiguousarray(levels, dtype=np.float32)
        while done < len(frames):
            rest = room[done:]
            count, why = own.follow(
                frames[done:], rest.loads, rest.std, rest.covariances, rest.squares
            )
            done += count
            if why == DONE:
                continue
            if why == AGEING:
                if own.renew(self._seen(frames[done - 1])) is None:
                    break
                continue
            top = own.renew(self._seen(frames[done])) if why == STALE else None
            if top is None:
                break
            room.squares[done] = top.square, top.count
            room.loads[done] = top.unknowns[: room.loads.shape[1]]
            covariance = own.covariance
            room.std[done] = np.sqrt(np.diag(covariance))
            room.covariances[done : done + 1] = covariance
            done += 1
        return done

    def _seen(self, frame: NDArray[np.float32]) -> Array:
        return np.where(self._used, frame.astype(float), np.nan)

    def _store(self, followed: Followed, batch: Batch) -> None:
        """Fill in frames that were followed."""
        loads = followed.loads
        if (friction := self._single.friction) is not None:
            pairs = zip(loads, followed.covariances, strict=True)
            loads = np.array([within_friction_cone(*pair, friction)[0] for pair in pairs])
        batch.forces[:] = loads.reshape(batch.forces.shape)
        batch.std[:] = followed.std.reshape(batch.std.shape)
        square, count = followed.squares.T
        batch.chi2[:] = square / np.maximum(count - loads.shape[1], 1.0)
        batch.status[:], batch.tracked[:] = Status.OK, True
        if batch.covariance is not None:
            batch.covariance[:] = followed.covariances
