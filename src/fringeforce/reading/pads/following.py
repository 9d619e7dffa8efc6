"""Frames of a pad as they come: each followed from the last ones, searched where that fails."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.levenberg_marquardt import Curvature
from fringeforce.reading.batch import Batch, Progress
from fringeforce.reading.frame_reader import Follower
from fringeforce.reading.pads.fit import Start
from fringeforce.reading.pads.single_frame import PadFrameReader
from fringeforce.reading.reading import Reading

Mask = NDArray[np.bool_]

KEPT = 0.8
"""Share of the last change of the forces that the next is expected to have."""


class PadFollower(Follower):
    """Reads the frames of one pad in the order in which they were taken.

    It remembers the forces of the last two frames and the information of earlier ones.

    Parameters
    ----------
    single : PadFrameReader
        What searches.
    """

    def __init__(self, single: PadFrameReader) -> None:
        self._single = single
        self._used: Mask | None = None
        self._known: Curvature | None = None
        self.reset()

    def reset(self) -> None:
        """Forget the last reading: the next frame is searched."""
        self._here: Start | None = None
        self._ahead: Start | None = None

    def read(self, levels: NDArray[Any], used: Mask) -> Reading:
        """Read the next frame, which was checked, shape (P,)."""
        if self._used is not used:
            # other pixels tell another thing
            self._used, self._known = used, None
        reading, optimum = self._single.found(levels, used, self._ahead, self._known)
        self._known = optimum.curvature
        before, here = self._here, optimum.place if reading.trusted else None
        self._here = self._ahead = here
        if here is not None and before is not None and reading.tracked:
            # a steady motion goes on; noise, which a difference doubles, counts less
            self._ahead = here.onward(KEPT, before)
        return reading

    def read_on(
        self, levels: NDArray[Any], used: Mask, batch: Batch, progress: Progress | None = None
    ) -> None:
        """Fill in the readings of the next frames, shape (k, P), which were not checked."""
        for row, image in enumerate(levels):
            checked = self._single.checked(image.reshape(self._single.model.frame_shape), used)
            reading = checked if isinstance(checked, Reading) else self.read(checked, used)
            batch.store(row, reading)
            if progress is not None:
                progress(1)
