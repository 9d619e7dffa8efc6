"""Frames of a strip as they come: filtered from one to the next, or searched."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.contacts.friction_cone import within_friction_cone
from fringeforce.estimation.followed_frames import AGEING, DONE, EMERGED, STALE
from fringeforce.estimation.frame_exposure import node_phase
from fringeforce.estimation.information_filter import InformationFilter, Undecided
from fringeforce.estimation.posterior import Posterior, Top
from fringeforce.estimation.residual_test import FALSE_ALARM, FALSE_VERDICT
from fringeforce.reading.batch import Batch, Progress
from fringeforce.reading.departure_test import HARMLESS, Retests
from fringeforce.reading.frame_reader import Follower
from fringeforce.reading.large_strain import StrainShift
from fringeforce.reading.reading import Reading, Status
from fringeforce.reading.strip_reader import (
    Before,
    Located,
    StripFrameReader,
)
from fringeforce.reading.strip_search import FAINT_PHASE, is_faint

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ALIKE_FRAMES = 16
"""Frames in a row in which the model's own errors do the same, so that all tell of the next."""
BLOCK = 256
"""Frames that are handed to the compiled loop at a time."""
INTERVAL, LONGEST = 1, 8192
"""Frames after which ambiguous ones are searched again, at first, and at most: it doubles."""
MORE = 4
"""Frames whose mean is searched first, and how many times as many each time after: errors of the
mean that are of second order are a quarter of those of one frame."""


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


class StripFollower(Follower):
    """Reads the frames of one strip in the order in which they were taken.

    A reading begins a filter that follows its explanation; where it is the mean of several, their
    spread is added to what is followed.  Where a frame contradicts the filter, it is read alone,
    from the last unknowns at first if these were of one, and its own reading begins another filter,
    so that what contradicts is forgotten.  Frames after an ambiguous one are ambiguous until a
    search settles it.  Where the phase is so small that loads are hardly told from others, the
    filter stays where it began, and the mean of the frames since is searched at growing intervals:
    it has less noise than each of them.  Until the first such mean the filter only tells whether
    loads stay as they are, and each frame is read alone.

    Parameters
    ----------
    single : StripFrameReader
        What searches.
    """

    def __init__(self, single: StripFrameReader) -> None:
        self._single = single
        self.reset()

    def reset(self) -> None:
        """Forget the last reading: the next frame is searched."""
        self._filter: InformationFilter | None = None
        self._last: Array | None = None
        self._used = np.empty(0, bool)
        self._begun: Reading | None = None
        self._interval = INTERVAL
        self._left = self._count = 0
        self._held: Posterior | None = None
        self._posterior: Posterior | None = None
        self._reader = self._single
        self._shift: StrainShift | None = None
        self._seen_with_it = 0
        self._earlier = deque[NDArray[Any]](maxlen=ALIKE_FRAMES)
        self._undecided: Undecided | None = None
        self._several: Located | None = None
        self._total = np.empty(0)
        self._retests = Retests()

    def read(self, levels: NDArray[Any], used: Mask) -> Reading:
        """Read the next frame, which was checked, shape (P,)."""
        followed = Followed.of(1, self._single.uncertain.frame.at.loads, covariances=True)
        begun = self._look(used)
        if begun is None or not self._follow(levels[None], used, followed):
            return self._read_alone(levels, used)
        single = self._single
        if self._from_one or self._departs(levels, used, 1):
            return single.alone(levels, used)
        loads, covariance = followed.loads[0], followed.covariances[0]
        covariance = covariance + single.calibration_covariance(loads, used)
        if (several := self._several) is not None:
            loads, covariance = loads + several.offset, covariance + several.between
        if self._shift is not None:
            covariance = covariance + self._shift.covariance(loads)
        limited = np.zeros(len(loads) // 2, dtype=bool)
        if single.friction is not None:
            loads, limited = within_friction_cone(loads, covariance, single.friction)
        top, others = Top(loads, 0.0, *followed.squares[0]), begun.alternatives
        return single.reading(
            loads, covariance, top, begun.status, begun.probability, limited, others, True,
            begun.detail,
        )  # fmt: skip

    def read_on(
        self, levels: NDArray[Any], used: Mask, batch: Batch, progress: Progress | None = None
    ) -> None:
        """Fill in the readings of the next frames, shape (k, P), which were not checked."""
        single, whole = self._single, batch.covariance is not None
        whole = whole or single.friction is not None or self._wide
        room = Followed.of(min(BLOCK, len(levels)), single.uncertain.frame.at.loads, whole)
        for first in range(0, len(levels), BLOCK):
            block, result = levels[first : first + BLOCK], batch[first : first + BLOCK]
            bad, done = single.suspicious(block, used), 0
            while done < len(block):
                count = self._read_some(block[done:], used, bad[done:], result[done:], room)
                done += count
                if progress is not None:
                    progress(count)

    def _read_some(
        self, levels: NDArray[Any], used: Mask, bad: Mask, result: Batch, room: Followed
    ) -> int:
        """Fill in the readings of frames that follow, or of one that is searched; how many."""
        single, done = self._single, 0
        ahead = int(bad.argmax()) if bad.any() else len(levels)
        begun = self._look(used)
        if begun is not None and ahead:
            done = self._follow(levels[:ahead], used, room)
            if self._from_one:
                for row in range(done):
                    result.store(row, single.alone(levels[row], used))
            else:
                self._store(room[:done], result[:done], begun)
                if done and self._departs(levels[done - 1], used, done):
                    result.store(done - 1, single.alone(levels[done - 1], used))
            if self._filter is not None and done < len(levels) and not bad[done]:
                return done
        if done < len(levels):
            checked = single.checked(levels[done].reshape(single.model.frame_shape), used)
            if not isinstance(checked, Reading):
                checked = self._read_alone(checked, used)
            result.store(done, checked)
            done += 1
        return done

    def _departs(self, levels: NDArray[Any], used: Mask, count: int) -> bool:
        """Whether the last of some frames that followed shows a departure; then it is forgotten."""
        own, begun = self._filter, self._begun
        if own is None or begun is None or not begun.ok or self._held is not None:
            return False
        if not self._retests.due(count, lambda: node_phase(own.model, own.unknowns)):
            return False
        if not self._reader.departing(levels, used, own.unknowns):
            return False
        self._filter = self._last = None
        return True

    @property
    def _wide(self) -> bool:
        """Whether errors of the model widen deviations."""
        return self._single.model.imaging is not None or self._single.higher_orders is not None

    @property
    def _from_one(self) -> bool:
        """Whether the filter stays where one frame began it, off by errors of second order."""
        return self._held is not None and self._count <= MORE

    def _read_alone(self, levels: NDArray[Any], used: Mask) -> Reading:
        centre = self._reader.uncertain.centre
        known = Before(self._last, self._earlier, self._undecided, centre)
        reading, located = self._single.followed(levels, used, known)
        before = self._begun
        self._filter = self._begun = self._last = self._held = self._several = None
        if located is None:
            self._earlier.clear()
            return reading
        self._earlier.append(levels.copy())
        posterior, top = located.posterior, located.top
        self._several = located if located.several else None
        self._used, self._begun, self._last = used, reading, top.unknowns.copy()
        weak = reading.status is Status.NO_CONTACT or is_faint(posterior, top)
        again = before is not None and before.status is reading.status
        self._interval = min(2 * self._interval, LONGEST) if again else INTERVAL
        self._left = self._interval if reading.status is Status.AMBIGUOUS else -1
        self._posterior, self._shift, self._reader = posterior, None, located.reader
        if not reading.tracked:
            phase = posterior.phase(top)
            self._retests.begin(float(phase @ phase))
        self._begin(posterior, top, weak)
        if weak and reading.status is not Status.NO_CONTACT:
            self._held, self._count, self._total = posterior, 1, levels.astype(float)
            self._left = MORE - 1
        return reading

    def _begin(self, posterior: Posterior, top: Top, weak: bool) -> None:
        own = InformationFilter(
            posterior.model,
            posterior.prior,
            self._single.uncertain.lasting,
            self._used,
            FAINT_PHASE,
            self._single.mirrored,
            top.unknowns.copy(),
        )
        about, spread = posterior.linearised(top), posterior.spread(top)
        if weak:
            still = self._begun is not None and self._begun.status is Status.NO_CONTACT
            own.hold(about, spread, still, FALSE_VERDICT if still else FALSE_ALARM)
        else:
            own.begin(about, spread)
        self._filter, self._last = own, own.unknowns

    def _look(self, used: Mask) -> Reading | None:
        """What the filter began with, or None if there is none; searches anew where it is time."""
        if self._filter is None:
            return None
        if used is not self._used and not np.array_equal(used, self._used):
            self._filter = None
            self._earlier.clear()
            return None
        if self._left == 0 and self._held is None:
            self._filter = self._last = None
            return None
        if self._left == 0 and self._held is not None:
            quiet = self._single.quieter(1 / self._count)
            mean = self._total / self._count
            reading, located = quiet.followed(mean, used)
            if located is None or reading.status is Status.NO_CONTACT:
                self._filter = self._last = None
                return None
            posterior, top = located.posterior, located.top
            self._several = located if located.several else None
            self._reader = located.reader
            frame = np.where(used, mean, np.nan)
            model = posterior.model._replace(variance=self._single.uncertain.frame.variance)
            self._begun = reading
            self._held = Posterior(model, posterior.prior, frame)
            self._left = (MORE - 1) * self._count
            self._begin(self._held, top, weak=True)
        return self._begun

    def _follow(self, levels: NDArray[Any], used: Mask, room: Followed) -> int:
        """Read frames, shape (k, P), as far as the filter explains them; returns how many."""
        own = self._filter
        assert own is not None
        if self._left > 0:
            levels = levels[: self._left]
        if self._single.higher_orders is not None:
            levels = levels[:ALIKE_FRAMES]
        done = self._explained(own, levels, room)
        self._seen_with_it += done
        self._earlier.extend(levels[max(done - ALIKE_FRAMES, 0) : done].copy())
        # of an ambiguous phase any stretch may be on either side
        sure = self._begun is not None and self._begun.ok
        self._undecided = own.undecided if sure else None
        bent = self._single.higher_orders is not None and self._bent(own)
        if bent or done < len(levels):
            self._filter = None
        if self._left > 0:
            self._left -= done
        if self._held is not None:
            self._total += np.where(used, levels[:done], 0.0).sum(axis=0)
            self._count += done
        return done

    def _bent(self, own: InformationFilter) -> bool:
        """Whether large strain asks for a model that is exact at loads nearer to the last ones."""
        if self._posterior is None:
            return False
        if self._shift is None or self._seen_with_it >= BLOCK:
            self._shift = self._single.strain_shift(self._posterior, own.unknowns)
            self._seen_with_it = 0
        loads = own.unknowns[: own.model.at.loads]
        return self._shift is not None and self._shift.share(loads) > HARMLESS

    def _explained(self, own: InformationFilter, levels: NDArray[Any], room: Followed) -> int:
        done = 0
        frames = np.ascontiguousarray(levels, dtype=np.float32)
        while done < len(frames):
            rest = room[done:]
            count, why = own.follow(
                frames[done:], rest.loads, rest.std, rest.covariances, rest.squares
            )
            done += count
            if why == DONE:
                continue
            if self._held is not None:
                break
            if why == AGEING:
                if self._renewed(own, frames[done - 1]) is None:
                    break
                continue
            top = self._renewed(own, frames[done]) if why in (STALE, EMERGED) else None
            if top is None:
                break
            room.squares[done] = top.square, top.count
            room.loads[done] = top.unknowns[: room.loads.shape[1]]
            covariance = own.covariance
            room.std[done] = np.sqrt(np.diag(covariance))
            room.covariances[done : done + 1] = covariance
            done += 1
        return done

    def _renewed(self, own: InformationFilter, levels: NDArray[np.float32]) -> Top | None:
        frame = np.where(self._used, levels.astype(float), np.nan)
        return own.renew(frame, partial(self._reader.images, own.model, own.prior, frame))

    def _widen(self, followed: Followed) -> None:
        """Add what calibration and large strain leave uncertain."""
        for first in range(0, len(followed.loads), ALIKE_FRAMES):
            rows = slice(first, first + ALIKE_FRAMES)
            own = followed.covariances[rows]
            own += self._single.calibration_covariance(followed.loads[first], self._used)
            if self._shift is not None:
                own += self._shift.covariance(followed.loads[first])
            followed.std[rows] = np.sqrt(np.diagonal(own, axis1=1, axis2=2))

    def _store(self, followed: Followed, batch: Batch, begun: Reading) -> None:
        """Fill in frames that were followed."""
        loads, std = followed.loads, followed.std
        if self._wide and len(loads):
            self._widen(followed)
        if (several := self._several) is not None:
            loads += several.offset
            std[:] = np.hypot(std, np.sqrt(np.diag(several.between)))
            followed.covariances[:] += several.between
        if (friction := self._single.friction) is not None:
            pairs = zip(loads, followed.covariances, strict=True)
            loads = np.array([within_friction_cone(*pair, friction)[0] for pair in pairs])
        batch.forces[:] = loads.reshape(batch.forces.shape)
        batch.std[:] = std.reshape(batch.std.shape)
        square, count = followed.squares.T
        batch.chi2[:] = square / np.maximum(count - loads.shape[1], 1.0)
        batch.status[:], batch.tracked[:] = begun.status, True
        if batch.covariance is not None:
            batch.covariance[:] = followed.covariances
