"""From frames of a pad to readings: one at a time, or one after the other as they come."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import InputError
from fringeforce.estimation.levenberg_marquardt import Curvature
from fringeforce.estimation.likelihood import Response
from fringeforce.models.imaging import camera_response
from fringeforce.models.pad import PadModel
from fringeforce.optics.arrangement import signed
from fringeforce.reading.batch import Batch
from fringeforce.reading.pads.fit import Fit, Start, Top
from fringeforce.reading.pads.following import TRUSTED, PadFollower
from fringeforce.reading.pads.mirror_images import Mirror, Verdict, are_apart, weighed
from fringeforce.reading.pads.reading import PadReading
from fringeforce.reading.pads.sampling import Sampling, lattice
from fringeforce.reading.pads.search import Search
from fringeforce.reading.pads.verdict import Judge
from fringeforce.reading.reading import Status

Array = NDArray[np.float64]

FOLLOWED, STEPPED, STATED = 32, 48, 64
"""Rows and columns of pixels of the matrix of followed and searched frames, and of a covariance."""
DEPTH = 4
"""Times that mirror images are tried, each time of what is likelier than all before."""
PROMISING = 0.5
"""Mean square by which a mirror image may be worse than what it is an image of, to be tried."""


@dataclass(frozen=True, eq=False)
class PadReader:
    """Reads frames of one pad.

    Attributes
    ----------
    model : PadModel
        Of the pad.

    Examples
    --------
    >>> pad = ff.load_sensor("pad").replace(
    ...     tactels={"count": [3, 3]}, camera={"pixels": [64, 64]}
    ... )
    >>> model = ff.characterize(pad)
    >>> forces = np.zeros((9, 3))
    >>> forces[4, 0] = 2.0  # the middle one, pressed
    >>> reading = ff.PadReader(model).read(model.expose(forces, rng=0))
    >>> reading.status.name, round(float(reading.forces[4, 0]), 1)
    ('OK', 2.0)
    """

    model: PadModel

    @cached_property
    def response(self) -> Response:
        """What the camera makes of light."""
        return camera_response(self.model.sensor.camera)

    @cached_property
    def _following(self) -> Sampling:
        return lattice(self.model, FOLLOWED)

    @cached_property
    def _stepping(self) -> Sampling:
        return lattice(self.model, STEPPED)

    @cached_property
    def _stating(self) -> Sampling:
        return lattice(self.model, STATED)

    @cached_property
    def _search(self) -> Search:
        forms = np.concatenate([picture.forms for picture in self.model.pictures])
        if not signed(forms):
            raise InputError(
                "Frames of this polariscope are the same for a force and its negative, so that "
                "nothing can be read without an earlier state; take a polarisation camera, or "
                'channels with arrangement = "analyser" at two angles, 45 degrees apart.'
            )
        return Search(self.model, self.response)

    @cached_property
    def _mirror(self) -> Mirror:
        waves = {picture.dispersion for picture in self.model.pictures}
        return Mirror(self._search.places, tuple(sorted(waves)))

    def read(
        self, frame: ArrayLike, start: ArrayLike | None = None, mask: ArrayLike | None = None
    ) -> PadReading:
        """Read one frame without any earlier state, or from forces that are nearly right.

        Parameters
        ----------
        frame : array_like, shape (rows, columns) or (channels, rows, columns)
            Grey levels.
        start : array_like, shape (n, 3), optional
            Forces to start from instead of a search [N].
        mask : array_like of bool, shape of a frame, optional
            Pixels to leave out, such as dead ones, where true.

        Returns
        -------
        PadReading
            Never an error for a bad frame: its status says what to do.

        Raises
        ------
        InputError
            If there is no start and the polariscope cannot tell a force from its negative, or if
            the mask does not fit.
        """
        judge = self._judge(mask)
        levels = judge.checked(frame)
        if isinstance(levels, PadReading):
            return levels
        return self._searched(levels, start, judge)[0]

    def _searched(
        self, levels: Array, start: ArrayLike | None, judge: Judge
    ) -> tuple[PadReading, Top]:
        """Reading of a frame without an earlier state, or from a start, and where it is."""
        fit = self._fit(levels, self._stepping, judge)
        if start is not None:
            tops, sure = [fit.climb(self.model.checked(start, single=True).ravel())], True
        else:
            tops, sure = self._explanations(fit, judge)
        fine = self._fit(levels, self._stating, judge).information(tops[0].place)
        if not judge.explained(tops[0]):
            return judge.unexplained(levels, tops[0], fine), tops[0]
        if start is None:
            sure = sure and self._stays_this_side(fine)
        verdict = weighed([top for top in tops if judge.explained(top)], fine)
        return judge.reading(levels, tops[0], verdict, tracked=False, sure=sure), tops[0]

    def _explanations(self, fit: Fit, judge: Judge) -> tuple[list[Top], bool]:
        """Where a search, and mirror images of what it finds, lead, and whether that is all.

        The likeliest comes first.
        """
        tops: list[Top] = []
        sure = False
        for forces, whole in self._search.attempts(fit.frame, judge.used):
            tops.append(fit.climb(forces))
            plain = judge.plain(fit.frame, tops[-1])
            sure |= whole or plain
            if judge.explained(tops[-1]) and plain:
                break
        tops.sort(key=lambda top: top.misfit.loss)
        return (self._with_images(fit, judge, tops) if judge.explained(tops[0]) else tops), sure

    def _stays_this_side(self, information: Array) -> bool:
        """Whether no push is uncertain by as much as takes retardance from one fold to beyond it.

        Where one is, as may be where a mask hides its tactel, deviations, which are those of a
        linear model, do not say how far other forces are that explain a frame as well.
        """
        deviations = np.sqrt(np.diag(np.linalg.inv(information))[::3])
        most = self._search.strongest * max(self._mirror.dispersions)
        return bool(deviations.max() * most < np.pi / 2)

    def _with_images(self, fit: Fit, judge: Judge, tops: list[Top]) -> list[Top]:
        """Explanations, and where their mirror images lead, the likeliest first."""
        shown = None
        if judge.used is not None:
            counts = judge.used.reshape(len(self.model.pictures), -1)
            shown = np.asarray(counts.any(axis=0), dtype=bool)
        for _ in range(DEPTH):
            likeliest = tops[0]
            for forces in self._mirror.images(likeliest.forces, shown):
                start = fit.at(forces)
                if fit.misfit(start).loss < likeliest.misfit.loss + PROMISING * self._pixels:
                    tops.append(fit.climb(start))
            tops.sort(key=lambda top: top.misfit.loss)
            # what returned to where it was an image of has the same images again
            known = likeliest.curvature.information
            if not are_apart(tops[0].forces, likeliest.forces, known):
                break
        return tops

    def follow(
        self, frame: ArrayLike, last: PadReading, mask: ArrayLike | None = None
    ) -> PadReading:
        """Read a frame that comes soon after another, and search where that fails.

        Parameters
        ----------
        frame : array_like, shape (rows, columns) or (channels, rows, columns)
            Grey levels.
        last : PadReading
            Of the frame before.
        mask : array_like of bool, shape of a frame, optional
            Pixels to leave out, where true.
        """
        if last.status not in TRUSTED:
            return self.read(frame, mask=mask)
        judge = self._judge(mask)
        levels = judge.checked(frame)
        if isinstance(levels, PadReading):
            return levels
        return self._followed(levels, last.forces.ravel(), judge)[0]

    def _followed(
        self, levels: Array, start: Array | Start, judge: Judge, known: Curvature | None = None
    ) -> tuple[PadReading, Top]:
        """Reading of a frame from a start, or searched, and where it was followed to."""
        top = self._fit(levels, self._following, judge).climb(start, 6, known)
        if judge.explained(top):
            verdict = Verdict(top.forces, top.curvature.information, np.empty((0, len(top.forces))))
            return judge.reading(levels, top, verdict, tracked=True), top
        return self._searched(levels, None, judge)

    def bound(self, forces: ArrayLike) -> Array:
        """Smallest deviations that an unbiased reading of one frame can have, shape (n, 3) [N].

        The Cramer-Rao bound for Gaussian noise of the camera's variance.

        Parameters
        ----------
        forces : array_like, shape (n, 3)
            Forces that act [N].
        """
        loads = self.model.checked(forces, single=True)
        fit = self._fit(np.zeros(self._pixels), self._stating, self._judge(None))
        information = fit.information(fit.at(loads.ravel()))
        return PadReading(loads, information, 1.0, Status.OK).std

    def stream(
        self, frames: Iterable[ArrayLike], mask: ArrayLike | None = None
    ) -> Iterator[PadReading]:
        """Readings of frames one after the other, each followed from the last."""
        follower = self.follower(mask)
        for frame in frames:
            yield follower.read(frame)

    def follower(self, mask: ArrayLike | None = None) -> PadFollower:
        """What reads frames as they come, remembering the last; for `fringeforce.live` too.

        Parameters
        ----------
        mask : array_like of bool, shape of a frame, optional
            Pixels to leave out of all frames, where true.
        """
        judge = self._judge(mask)
        return PadFollower(
            self.model,
            judge,
            search=lambda levels: self._searched(levels, None, judge),
            follow=lambda levels, start, known: self._followed(levels, start, judge, known),
        )

    def read_batch(
        self,
        frames: ArrayLike,
        covariance: bool = False,
        mask: ArrayLike | None = None,
        progress: Callable[[int], None] | None = None,
    ) -> Batch:
        """Read a recording, each frame followed from the last.

        Parameters
        ----------
        frames : array_like, shape (k, rows, columns) or (k, channels, rows, columns)
            Grey levels of consecutive frames.
        covariance : bool
            Whether to keep the covariance of every frame, a megabyte each.
        mask : array_like of bool, shape of a frame, optional
            Pixels to leave out of all frames, where true.
        progress : callable, optional
            Called with the number of frames that were done since.

        Raises
        ------
        InputError
            If the frames are none of this pad, or the mask does not fit.
        """
        return self.follower(mask).read_on(frames, covariance, progress)

    @property
    def _pixels(self) -> int:
        return int(np.prod(self.model.frame_shape))

    def _judge(self, mask: ArrayLike | None) -> Judge:
        if mask is None:
            return self._unmasked
        return Judge.masked(self.model, self.response, np.asarray(mask, dtype=bool))

    @cached_property
    def _unmasked(self) -> Judge:
        return Judge(self.model, self.response)

    def _fit(self, levels: Array, sampling: Sampling, judge: Judge) -> Fit:
        return Fit(self.model, self.response, sampling, levels, judge.used)
