"""Frames of a pad as they come: each followed from the last ones, searched where that fails."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.estimation.levenberg_marquardt import Curvature
from fringeforce.models.pad import PadModel
from fringeforce.reading.batch import Batch, checked_recording
from fringeforce.reading.pads.fit import Start, Top
from fringeforce.reading.pads.reading import PadReading
from fringeforce.reading.pads.verdict import Judge
from fringeforce.reading.reading import Status

Array = NDArray[np.float64]
Found = tuple[PadReading, Top]

TRUSTED = Status.OK, Status.NO_CONTACT
"""Verdicts from which the next frame is followed."""
KEPT = 0.8
"""Share of the last change of the forces that the next is expected to have."""


class PadFollower:
    """Reads the frames of one pad in the order in which they were taken.

    `PadReader.follower` makes one.  It remembers the forces of the last two frames and the
    information of earlier ones.

    Parameters
    ----------
    model : PadModel
        Of the pad.
    judge : Judge
        Knows which pixels count.
    search : callable
        From grey levels to a reading without an earlier state.
    follow : callable
        The same from a start, with the curvature of a place near by.
    """

    def __init__(
        self,
        model: PadModel,
        judge: Judge,
        search: Callable[[Array], Found],
        follow: Callable[[Array, Start, Curvature | None], Found],
    ) -> None:
        self.model = model
        self._judge, self._search, self._follow = judge, search, follow
        self._here: Start | None = None
        self._ahead: Start | None = None
        self._known: Curvature | None = None
        self._spread: tuple[Array, Array] | None = None

    def read(self, frame: ArrayLike) -> PadReading:
        """Read the next frame.

        Parameters
        ----------
        frame : array_like, shape (rows, columns) or (channels, rows, columns)
            Grey levels.

        Returns
        -------
        PadReading
            Never an error for a bad frame: its status says what to do, and the next frame is read
            as if the bad one had not come.

        Raises
        ------
        InputError
            If the polariscope cannot tell a force from its negative.
        """
        levels = self._judge.checked(frame)
        if isinstance(levels, PadReading):
            return levels
        if self._ahead is None:
            reading, top = self._search(levels)
        else:
            reading, top = self._follow(levels, self._ahead, self._known)
        self._known = top.curvature
        before, here = self._here, top.place if reading.status in TRUSTED else None
        self._here = self._ahead = here
        if here is not None and before is not None and reading.tracked:
            # a steady motion goes on; noise, which a difference doubles, counts less
            self._ahead = here.onward(KEPT, before)
        return reading

    def read_on(
        self,
        frames: ArrayLike,
        covariance: bool = False,
        progress: Callable[[int], None] | None = None,
    ) -> Batch:
        """Read the next frames.

        Parameters
        ----------
        frames : array_like, shape (k, rows, columns) or (k, channels, rows, columns)
            Grey levels of the frames that follow the last one.
        covariance : bool
            Whether to keep the covariance of every frame, a megabyte each.
        progress : callable, optional
            Called with the number of frames that were done since.

        Raises
        ------
        InputError
            If the frames are none of this pad.
        """
        images = checked_recording(frames, self.model.frame_shape)
        batch = Batch.of(len(images), (self.model.sensor.tactels.total, 3), covariance)
        for row, image in enumerate(images):
            reading = self.read(image)
            batch.store(row, reading, self._std(reading))
            if progress is not None:
                progress(1)
        return batch

    def _std(self, reading: PadReading) -> Array:
        """Deviations of a reading, which frames with the same information share [N]."""
        if self._spread is None or self._spread[0] is not reading.information:
            self._spread = reading.information, reading.std
        return self._spread[1]

    def prepare(self) -> None:
        """Load all that the first frame would wait for otherwise; takes some seconds."""
        forces = np.zeros((self.model.sensor.tactels.total, 3))
        forces[len(forces) // 2, 0] = 1.0
        trial = PadFollower(self.model, self._judge, self._search, self._follow)
        trial.read_on(self.model.expose([forces, forces], rng=0))
