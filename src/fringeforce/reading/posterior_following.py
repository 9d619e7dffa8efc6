"""Frames of a strip with tolerances as they come: each starts from the last one's estimate."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.reading.batch import Batch, Progress
from fringeforce.reading.frame_reader import Follower
from fringeforce.reading.posterior_reader import PosteriorReader
from fringeforce.reading.reading import Reading

Mask = NDArray[np.bool_]


class PosteriorFollower(Follower):
    """Reads the frames of one strip with tolerances in the order in which they were taken.

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
        self._last: NDArray[np.float64] | None = None

    def read(self, levels: NDArray[Any], used: Mask) -> Reading:
        """Read the next frame, which was checked, shape (P,)."""
        reading, self._last = self._single.followed(levels, used, self._last)
        return reading

    def read_on(
        self, levels: NDArray[Any], used: Mask, batch: Batch, progress: Progress | None = None
    ) -> None:
        """Fill in the readings of the next frames, shape (k, P), which were not checked."""
        for row, frame in enumerate(levels):
            checked = self._single.checked(frame.reshape(self._single.model.frame_shape), used)
            if not isinstance(checked, Reading):
                checked = self.read(checked, used)
            batch.store(row, checked)
            if progress is not None:
                progress(1)
