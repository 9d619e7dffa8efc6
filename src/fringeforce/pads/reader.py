"""From frames of a pad to readings: one at a time, or one after the other as they come."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.errors import InputError
from fringeforce.force.goodness import is_noise, reduced_chi_square
from fringeforce.force.likelihood import Response, misfit
from fringeforce.imaging import camera_response
from fringeforce.optics.arrangement import signed
from fringeforce.pads.fit import Fit, Top
from fringeforce.pads.model import PadModel
from fringeforce.pads.reading import PadReading
from fringeforce.pads.sampling import Sampling, lattice, sampled
from fringeforce.pads.search import Search
from fringeforce.reading.reading import Status

Array = NDArray[np.float64]

SEARCHED = 3072
"""Pixels of the search."""
FOLLOWED, STEPPED, STATED = 32, 48, 64
"""Rows and columns of pixels of the matrix of followed and searched frames, and of a covariance."""
KEPT = 0.8
"""Share of the last change of the forces that the next is expected to have."""
BLOCK = 4
"""Side of the squares of pixels whose residuals are summed to find a misfit that noise hides."""
CONTACT = 6.0
"""Standard deviations of pure noise by which an explanation must beat silence."""
CLIPPED = 0.02
"""Share of pixels at the converter's limit above which a frame that nothing explains is clipped."""
DENSE = 0.35
"""Difference of like pixels side by side, root mean square, beyond which fringes are too dense."""


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
    def _following(self) -> list[Sampling]:
        return [lattice(self.model, c, FOLLOWED) for c in range(len(self.model.pictures))]

    @cached_property
    def _stepping(self) -> list[Sampling]:
        return [lattice(self.model, c, STEPPED) for c in range(len(self.model.pictures))]

    @cached_property
    def _stating(self) -> list[Sampling]:
        return [lattice(self.model, c, STATED) for c in range(len(self.model.pictures))]

    @cached_property
    def _search(self) -> Search:
        forms = np.concatenate([picture.forms for picture in self.model.pictures])
        if not signed(forms):
            raise InputError(
                "Frames of this polariscope are the same for a force and its negative, so that "
                "nothing can be read without an earlier state; take a polarisation camera, or "
                'channels with arrangement = "analyser" at two angles, 45 degrees apart.'
            )
        channels = len(self.model.pictures)
        samplings = [sampled(self.model, c, SEARCHED // channels) for c in range(channels)]
        return Search(self.model, self.response, samplings)

    def read(self, frame: ArrayLike, start: ArrayLike | None = None) -> PadReading:
        """Read one frame without any earlier state, or from forces that are nearly right.

        Parameters
        ----------
        frame : array_like, shape (rows, columns) or (channels, rows, columns)
            Grey levels.
        start : array_like, shape (n, 3), optional
            Forces to start from instead of a search [N].

        Returns
        -------
        PadReading
            Never an error for a bad frame: its status says what to do.

        Raises
        ------
        InputError
            If there is no start and the polariscope cannot tell a force from its negative.
        """
        levels = self._checked(frame)
        if isinstance(levels, PadReading):
            return levels
        if start is not None:
            starts = [self.model.checked(start, single=True).ravel()]
        else:
            starts = [forces for _, forces in self._search.attempts(levels)[:2]]
        best: Top | None = None
        for forces in starts:
            top = self._fit(levels, self._stepping).climb(forces)
            if best is None or top.misfit.loss < best.misfit.loss:
                best = top
            if self._explained(best):
                break
        assert best is not None
        fine = self._fit(levels, self._stating).information(best.forces)
        return self._reading(levels, best, fine, tracked=False)

    def follow(self, frame: ArrayLike, last: PadReading) -> PadReading:
        """Read a frame that comes soon after another, and search where that fails.

        Parameters
        ----------
        frame : array_like, shape (rows, columns) or (channels, rows, columns)
            Grey levels.
        last : PadReading
            Of the frame before.
        """
        if last.status not in (Status.OK, Status.NO_CONTACT):
            return self.read(frame)
        levels = self._checked(frame)
        if isinstance(levels, PadReading):
            return levels
        start = (last.forces + last.trend).ravel()
        top = self._fit(levels, self._following).climb(start, steps=6)
        if not self._explained(top):
            return self.read(frame)
        reading = self._reading(levels, top, top.information, tracked=True)
        # a steady motion goes on; noise, which a difference doubles, counts less
        return replace(reading, trend=KEPT * (reading.forces - last.forces))

    def bound(self, forces: ArrayLike) -> Array:
        """Smallest deviations that an unbiased reading of one frame can have, shape (n, 3) [N].

        The Cramer-Rao bound for Gaussian noise of the camera's variance.

        Parameters
        ----------
        forces : array_like, shape (n, 3)
            Forces that act [N].
        """
        loads = self.model.checked(forces, single=True)
        fit = self._fit(np.zeros(len(self._silent)), self._stating)
        information = fit.information(loads.ravel())
        return PadReading(loads, information, 1.0, Status.OK).std

    def stream(self, frames: Iterable[ArrayLike]) -> Iterator[PadReading]:
        """Readings of frames one after the other, each followed from the last."""
        last: PadReading | None = None
        for frame in frames:
            last = self.read(frame) if last is None else self.follow(frame, last)
            yield last

    def _fit(self, levels: Array, samplings: list[Sampling]) -> Fit:
        return Fit(self.model, self.response, samplings, levels)

    def _explained(self, top: Top) -> bool:
        return is_noise(self._blocks(top.misfit.slope), len(top.forces))

    def _blocks(self, values: Array) -> Array:
        """Values of pixels, those of a square that measure alike one after the other."""
        step = 1 if len(self.model.pictures[0].forms) == 1 else 2
        images = values.reshape(-1, *self.model.frame_shape[-2:])
        alike = [images[:, i::step, j::step] for i in range(step) for j in range(step)]
        return np.concatenate([_squares(image) for image in alike])

    def _reading(self, levels: Array, top: Top, information: Array, tracked: bool) -> PadReading:
        status, unknowns = Status.OK, len(top.forces)
        if not self._explained(top):
            status = self._unexplained(levels)
        else:
            silence = misfit(levels, self._silent, self.response).loss
            if silence - top.misfit.loss <= unknowns + CONTACT * np.sqrt(2 * unknowns):
                status = Status.NO_CONTACT
        return PadReading(
            forces=top.forces.reshape(-1, 3),
            information=information,
            chi2=reduced_chi_square(top.misfit.slope, unknowns),
            status=status,
            tracked=tracked,
        )

    @cached_property
    def _silent(self) -> Array:
        """Grey levels where nothing touches."""
        nothing = self.model.intensity(np.zeros((self.model.sensor.tactels.total, 3)))
        return np.asarray(self.response.amplitude * nothing.ravel() + self.response.offset)

    def _unexplained(self, levels: Array) -> Status:
        """Why nothing explains a frame."""
        camera = self.model.sensor.camera
        if (levels >= camera.full_scale).mean() > CLIPPED:
            return Status.SATURATED
        images = levels.reshape(-1, *self.model.frame_shape[-2:]) / camera.amplitude
        apart = (images[:, :, 2:] - images[:, :, :-2]) ** 2
        side = 16
        rows, columns = (length // side * side for length in apart.shape[1:])
        if rows and columns:
            squares = apart[:, :rows, :columns].reshape(
                -1, rows // side, side, columns // side, side
            )
            if np.sqrt(squares.mean(axis=(2, 4)).max()) > DENSE:
                return Status.FRINGES_TOO_DENSE
        return Status.MODEL_MISMATCH

    def _checked(self, frame: ArrayLike) -> Array | PadReading:
        """A frame's grey levels in one row if they can be used, or a reading that says why not."""
        camera = self.model.sensor.camera
        try:
            levels = np.asarray(frame, dtype=float)
        except (TypeError, ValueError):
            return self._bad(f"It holds {type(frame).__name__}, not grey levels.")
        if levels.shape != (shape := self.model.frame_shape):
            return self._bad(f"It has the shape {levels.shape}; this pad's frames have {shape}.")
        darkest, brightest = float(levels.min()), float(levels.max())
        if not np.isfinite(darkest + brightest):
            return self._bad(f"{int((~np.isfinite(levels)).sum())} pixels are not a number.")
        if darkest < 0 or brightest > camera.full_scale:
            return self._bad(
                f"Grey levels from {darkest:g} to {brightest:g} exceed the converter's 0 to "
                f"{camera.full_scale}."
            )
        if darkest == brightest and camera.noise > 0.5:
            return self._bad(f"All pixels are {darkest:g}.")
        return levels.ravel()

    def _bad(self, detail: str) -> PadReading:
        n = self.model.sensor.tactels.total
        return PadReading(
            forces=np.full((n, 3), np.nan),
            information=np.full((3 * n, 3 * n), np.nan),
            chi2=np.nan,
            status=Status.BAD_FRAME,
            detail=detail,
        )


def _squares(images: Array) -> Array:
    """Pixels of images, shape (k, rows, columns), square by square; the last odd ones left out."""
    rows, columns = (length // BLOCK for length in images.shape[1:])
    whole = images[:, : rows * BLOCK, : columns * BLOCK]
    squares = whole.reshape(len(images), rows, BLOCK, columns, BLOCK)
    return squares.swapaxes(2, 3).ravel()
