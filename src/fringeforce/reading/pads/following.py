"""Frames of a pad as they come: each followed from the last ones, searched where that fails."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from fringeforce.base.arrays import Mask
from fringeforce.estimation.levenberg_marquardt import Curvature
from fringeforce.reading.frame_reader import FrameByFrame
from fringeforce.reading.pads.departure_record import DepartureRecord
from fringeforce.reading.pads.fit import Optimum
from fringeforce.reading.pads.light import Prior, Start
from fringeforce.reading.pads.single_frame import Earlier, PadFrameReader
from fringeforce.reading.reading import Reading

TREND = 0.8
"""Share of the last change of the forces that the next is expected to have."""


class PadFollower(FrameByFrame):
    """Follows the frames of one pad from the forces of the last ones.

    It remembers the forces of the last two frames, the information of earlier ones, and what they
    tell of the unknowns of tolerances that stay as they are.

    Parameters
    ----------
    single : PadFrameReader
        What searches.
    """

    def __init__(self, single: PadFrameReader) -> None:
        self._single = single
        self._used: Mask | None = None
        self._known: Curvature | None = None
        super().__init__(single)

    def reset(self) -> None:
        """Forget the last reading: the next frame is searched."""
        self._here: Start | None = None
        self._ahead: Start | None = None
        self._prior: Prior | None = None
        self._told: Curvature | None = None
        self._probability = 1.0
        self._record = DepartureRecord()

    def read(self, levels: NDArray[Any], used: Mask) -> Reading:
        """Read the next frame, which was checked, shape (P,)."""
        if self._used is not used:
            # other pixels tell another thing
            self._used, self._known = used, None
            self._record.lose_test()
        # what distinguished the forces that were searched distinguishes those that follow
        known = Earlier(self._ahead, self._known, self._prior, self._probability, self._record)
        reading, optimum = self._single.found(levels, used, known)
        if reading.ok and reading.tracked and self._is_due(levels, used, optimum, known):
            reading = self._single.tested(reading, levels, used, optimum, known)
        self._known, self._probability = optimum.curvature, reading.probability
        before, here = self._here, optimum.place if reading.trusted else None
        self._remember(optimum if reading.trusted else None)
        self._here = self._ahead = here
        if here is not None and before is not None and reading.tracked:
            # a steady motion goes on; noise, which a difference doubles, counts less
            self._ahead = here.onward(TREND, before)
        return reading

    def _is_due(self, levels: NDArray[Any], used: Mask, optimum: Optimum, known: Earlier) -> bool:
        """Whether a frame that follows is to be tested, as one that was searched is already."""
        if self._record.due(optimum.place.modes) or self._single.tests_all:
            return True
        return self._single.doubted(levels, used, optimum, known)

    def _remember(self, optimum: Optimum | None) -> None:
        """Keep what a frame tells of lasting unknowns as what is known before the next."""
        known = self._single.uncertain
        if known is None or optimum is None:
            self._prior = self._told = None
            return
        # a matrix that served before has told already
        fresh = optimum.curvature if optimum.curvature is not self._told else None
        self._told = optimum.curvature
        self._prior = (self._prior or Prior.stated(known)).after(known, optimum.extra, fresh)
