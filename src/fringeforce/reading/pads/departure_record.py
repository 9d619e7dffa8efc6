"""What the frames of a pad tell together of departures, and when the next is to be tested.

Where nothing departs, the scores s of frames that follow each other are independent, with the
information V that each has about a departure.  Weighed by w, which falls with every frame,

    (sum w s)^2 / sum w^2 V

is a chi-square number of one degree of freedom, and - sum w s / sum w V is what departs.  It shows
a quarter of what a single frame shows where every eighth frame is tested, ten of which count.
Where forces rest, every frame has a score, by the information of the last test: eighty of them
count, and show a ninth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Single
from fringeforce.estimation.score_test import Score
from fringeforce.reading.departure_test import STRONGER
from fringeforce.reading.pads.light import REMEMBERED

RETESTED = 8
"""Frames after which one that follows is tested again, a quarter of a second of a camera: tests of
pads of 25 to 121 tactels make following take a third to six tenths longer."""
RENEWED = 32
"""The same where every frame has a score, for which a test is needed less."""
AT_REST = 0.1
"""Change of the retardance since a test, over its size, up to which forces rest: what frames tell
of departures changes by as much."""


@dataclass(frozen=True, eq=False)
class FullTest:
    """A test whose information serves frames that follow, of k departures beside m unknowns.

    Attributes
    ----------
    score : Score
        What it found.
    across : ndarray, shape (m, k)
        Information about both.
    layers : list of ndarray, each of shape (2, modes, rows, columns)
        Derivatives of the retardance by departures of layers, the last ones.
    """

    score: Score
    across: Array
    layers: list[Single]


class DepartureRecord:
    """What the frames of one pad told of departures by single numbers, and when."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Begin anew."""
        self._sums: Array | None = None
        self._modes: NDArray[np.floating] | None = None
        self._last: FullTest | None = None
        self._untested, self._unscored, self._doubted = 0, 0, False

    def due(self, modes: NDArray[np.floating]) -> bool:
        """Whether a frame that follows, with retardance of these modes, is to be tested.

        It is after some frames, where more is pressed, or where the last test left doubts.
        """
        self._untested += 1
        self._unscored += 1
        if self._modes is None or self._doubted:
            return True
        stronger = np.vdot(modes, modes) > STRONGER * np.vdot(self._modes, self._modes)
        often = RETESTED if self.serving(modes) is None else RENEWED
        return bool(stronger) or self._untested >= often

    def serving(self, modes: NDArray[np.floating]) -> FullTest | None:
        """The last test, if its information serves a frame with retardance of these modes."""
        if self._last is None or self._modes is None:
            return None
        moved = modes - self._modes
        at_rest = np.vdot(moved, moved) < AT_REST**2 * np.vdot(self._modes, self._modes)
        return self._last if at_rest else None

    def tested(
        self, modes: NDArray[np.floating], doubted: bool, last: FullTest | None = None
    ) -> None:
        """After a test of a frame, whether it may show a departure, and what serves others."""
        self._modes, self._untested, self._doubted, self._last = modes, 0, doubted, last

    def lose_test(self) -> None:
        """The last test serves no more frames, as other pixels count."""
        self._last = None

    def together(self, score: Score) -> Score:
        """A frame's score with those of the frames before it, as if it were that of one frame."""
        pull, told, alone, variance = self._with(score)
        # what unknowns absorb is not told, whatever sums over a lattice leave of it
        share = np.where(variance > 0, told / np.where(variance > 0, variance, 1.0), 1.0)
        return score._replace(
            pull=share * pull, information=np.diag(share * told), alone=share * alone
        )

    def add(self, score: Score) -> None:
        """Remember what a frame told."""
        self._sums, self._unscored = self._with(score), 0

    def _with(self, score: Score) -> Array:
        """Weighed sums of scores, information, beside all and alone, and variance, (4, k)."""
        known, r = score.information.diagonal(), REMEMBERED ** (self._unscored / RETESTED)
        own = np.stack([score.pull, known, score.alone, known])
        if self._sums is not None:
            own += np.array([[r], [r], [r], [r**2]]) * self._sums
        return own
