"""Frames of a strip with tolerances as they come: filtered from one to the next, or searched."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.contacts.friction_cone import within_friction_cone
from fringeforce.estimation import information_filter
from fringeforce.estimation.information_filter import AGEING, DONE, InformationFilter
from fringeforce.estimation.posterior import Top
from fringeforce.reading.batch import Batch, Progress
from fringeforce.reading.frame_reader import Follower
from fringeforce.reading.posterior_reader import FAINT, Located, PosteriorReader
from fringeforce.reading.reading import Reading, Status

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BLOCK = 256
"""Frames that are handed to the compiled loop at a time."""
GROWTH = 2.0
"""Factor by which normal forces may grow or shrink, root mean square, until what is known of them
before a frame is drawn up anew."""


@dataclass(frozen=True, eq=False)
class Followed:
    """Frames in a row that were read with one linearisation.

    Attributes
    ----------
    loads : ndarray, shape (k, 2n)
        Forces [N].
    squares : ndarray, shape (k, 2)
        Squared residuals and their number.
    covariance : ndarray, shape (2n, 2n)
        Of each frame's loads [N^2].
    """

    loads: Array
    squares: Array
    covariance: Array


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
        self._probability, self._size = 0.0, 0.0

    def read(self, levels: NDArray[Any], used: Mask) -> Reading:
        """Read the next frame, which was checked, shape (P,)."""
        found = self._follow(levels[None], used)
        if not found:
            return self._read_alone(levels, used)
        followed, single = found[0], self._single
        loads, covariance = followed.loads[0], followed.covariance
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
        single = self._single
        for first in range(0, len(levels), BLOCK):
            block, result = levels[first : first + BLOCK], batch[first : first + BLOCK]
            bad, done = single.suspicious(block, used), 0
            while done < len(block):
                ahead = int(bad[done:].argmax()) if bad[done:].any() else len(block) - done
                for followed in self._follow(block[done : done + ahead], used):
                    self._store(followed, result[done : done + len(followed.loads)])
                    done += len(followed.loads)
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
        self._size = self._push(top.unknowns)

    def _push(self, unknowns: Array) -> float:
        """Normal forces, root mean square [N]."""
        loads = self._single.uncertain.frame.at.loads
        return float(np.sqrt(np.mean(np.square(unknowns[:loads:2]))))

    def _follow(self, levels: NDArray[Any], used: Mask) -> list[Followed]:
        """Read frames, shape (k, P), as far as the filter explains them."""
        found, done = list[Followed](), 0
        if self._filter is None or not len(levels):
            return found
        if used is not self._used and not np.array_equal(used, self._used):
            return found
        frames = np.ascontiguousarray(levels, dtype=np.float32)
        loads = np.empty((len(frames), self._single.uncertain.frame.at.loads))
        squares = np.empty((len(frames), 2))
        while done < len(frames):
            covariance = self._filter.covariance
            count, why = self._filter.follow(frames[done:], loads[done:], squares[done:])
            if count:
                rows = slice(done, done + count)
                found.append(Followed(loads[rows], squares[rows], covariance))
            done += count
            if why == DONE:
                continue
            size = self._push(self._filter.unknowns)
            if (
                why == information_filter.FAINT
                or not self._size / GROWTH < size < self._size * GROWTH
            ):
                break
            if why == AGEING:
                if self._filter.renew(self._seen(frames[done - 1])) is None:
                    break
                continue
            top = self._filter.renew(self._seen(frames[done]))
            if top is None:
                break
            squares[done] = top.square, top.count
            loads[done] = top.unknowns[: loads.shape[1]]
            rows = slice(done, done + 1)
            found.append(Followed(loads[rows], squares[rows], self._filter.covariance))
            done += 1
        return found

    def _seen(self, frame: NDArray[np.float32]) -> Array:
        return np.where(self._used, frame.astype(float), np.nan)

    def _store(self, followed: Followed, batch: Batch) -> None:
        """Fill in frames that were followed."""
        loads, covariance = followed.loads, followed.covariance
        if (friction := self._single.friction) is not None:
            loads = np.array([within_friction_cone(row, covariance, friction)[0] for row in loads])
        batch.forces[:] = loads.reshape(batch.forces.shape)
        batch.std[:] = np.sqrt(np.diag(covariance)).reshape(batch.std.shape[1:])
        square, count = followed.squares.T
        batch.chi2[:] = square / np.maximum(count - loads.shape[1], 1.0)
        batch.status[:], batch.tracked[:] = Status.OK, True
        if batch.covariance is not None:
            batch.covariance[:] = covariance
