"""What the frames of a pad tell together of departures, and when the next is to be tested.

Where nothing departs, the scores s of frames that follow each other are independent, with the
information V that each has about a departure.  Weighed by w, which falls with every test,

    (sum w s)^2 / sum w^2 V

is a chi-square number of one degree of freedom, and - sum w s / sum w V is what departs.  It shows
a quarter of what a single frame shows where ten count, as after many tests.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array
from fringeforce.estimation.score_test import Score
from fringeforce.reading.departure_test import STRONGER
from fringeforce.reading.pads.light import REMEMBERED

RETESTED = 8
"""Frames after which one that follows is tested again, a quarter of a second of a camera: tests of
pads of 25 to 121 tactels make following take a third to six tenths longer."""


class DepartureRecord:
    """What the frames of one pad told of departures by single numbers, and when."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self._scores: Array | None = None
        self._strength, self._since, self._doubted = 0.0, 0, False

    def due(self, modes: NDArray[np.floating]) -> bool:
        """Whether a frame that follows, with retardance of these modes, is to be tested.

        It is after some frames, where more is pressed, or where the last test left doubts.
        """
        self._since += 1
        stronger = np.vdot(modes, modes) > STRONGER * self._strength
        return bool(stronger) or self._doubted or self._since >= RETESTED

    def tested(self, modes: NDArray[np.floating], doubted: bool) -> None:
        """After a test of a frame, and whether it may show a departure."""
        self._strength, self._since, self._doubted = float(np.vdot(modes, modes)), 0, doubted

    def together(self, score: Score) -> Score:
        """A frame's score with those of the frames before it, as if it were that of one frame."""
        known, r = score.information.diagonal(), REMEMBERED
        own = np.stack([score.pull, known, score.alone, known])
        if self._scores is not None:
            own += np.array([[r], [r], [r], [r**2]]) * self._scores
        self._scores = own
        pull, told, alone, variance = own
        # what unknowns absorb is not told, whatever sums over a lattice leave of it
        share = np.where(variance > 0, told / np.where(variance > 0, variance, 1.0), 1.0)
        return score._replace(
            pull=share * pull, information=np.diag(share * told), alone=share * alone
        )
