"""Whether forces explain a frame of a pad, and a verdict where they do not."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import InputError
from fringeforce.estimation.likelihood import Response, misfit
from fringeforce.estimation.residual_test import (
    FALSE_CONTACT,
    GROUP,
    is_noise,
    reduced_chi_square,
    square_limit,
)
from fringeforce.models.pad import PadModel
from fringeforce.reading.pads.fit import Top
from fringeforce.reading.pads.mirror_images import Verdict
from fringeforce.reading.pads.reading import PadReading
from fringeforce.reading.reading import Status

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BLOCK = 4
"""Side of the squares of pixels whose residuals are summed to find a misfit that noise hides."""
MISTAKEN = 0.01
"""Share of a load's trace in a frame that a mistaken explanation leaves at least."""
CLIPPED = 0.02
"""Share of pixels at the converter's limit above which a frame that nothing explains is clipped."""
DENSE = 0.35
"""Difference of like pixels side by side, root mean square, beyond which fringes are too dense."""


@dataclass(frozen=True, eq=False)
class Judge:
    """Judges frames of one pad, of which some pixels count.

    Attributes
    ----------
    model : PadModel
        Of the pad.
    response : Response
        Of its camera.
    used : ndarray of bool, shape (channels * P,), optional
        Pixels that count; all if not given.
    """

    model: PadModel
    response: Response
    used: Mask | None = None

    @classmethod
    def masked(cls, model: PadModel, response: Response, mask: Mask) -> Judge:
        """One that leaves out pixels of a frame, where true."""
        unknowns, shape = 3 * model.sensor.tactels.total, model.frame_shape
        if mask.shape != shape or (~mask).sum() <= unknowns:
            raise InputError(
                f"A mask of shape {mask.shape} with {int((~mask).sum())} pixels to use does not "
                f"fit; this pad's frames have the shape {shape} and need more than {unknowns} of "
                "them."
            )
        return cls(model, response, ~mask.ravel() if mask.any() else None)

    def explained(self, top: Top) -> bool:
        """Whether forces leave nothing but noise."""
        residuals, unknowns = top.misfit.slope[self._order], len(top.forces)
        # where squares are fewer than loads, these leave nothing of them
        return is_noise(residuals, unknowns, grouped=len(residuals) // GROUP > unknowns)

    @cached_property
    def _order(self) -> NDArray[np.intp]:
        """Pixels that count, those of a square that measure alike one after the other."""
        step = 1 if len(self.model.pictures[0].forms) == 1 else 2
        shape = len(self.model.pictures), *self.model.frame_shape[-2:]
        images = np.arange(np.prod(shape)).reshape(shape)
        alike = [_squares(images[:, i::step, j::step]) for i in range(step) for j in range(step)]
        order = np.concatenate(alike)
        return order if self.used is None else order[self.used[order]]

    def plain(self, levels: Array, top: Top) -> bool:
        """Whether what other forces would leave of a frame could not be taken for noise."""
        freedom = len(self._order)
        return MISTAKEN * self._shown(levels, top) > square_limit(freedom) - freedom

    def _shown(self, levels: Array, top: Top) -> float:
        """Loss of silence beyond that of an explanation."""
        count = slice(None) if self.used is None else self.used
        silence = misfit(levels[count], self._silent[count], self.response)
        return silence.loss - top.misfit.loss

    def reading(
        self, levels: Array, top: Top, verdict: Verdict, tracked: bool, sure: bool = True
    ) -> PadReading:
        """What an explanation comes to, or several, that are surely all or not."""
        status, unknowns, detail = Status.OK, len(top.forces), ""
        if self._shown(levels, top) <= square_limit(unknowns, FALSE_CONTACT):
            status = Status.NO_CONTACT
        elif len(verdict.others) or not sure:
            status = Status.AMBIGUOUS
            detail = "" if sure else "Too little shows to rule out all other forces."
        return PadReading(
            forces=verdict.forces.reshape(-1, 3),
            information=verdict.information,
            chi2=self._chi2(top),
            status=status,
            detail=detail,
            tracked=tracked,
            alternatives=verdict.others.reshape(-1, *self._shape),
        )

    def unexplained(self, levels: Array, top: Top, information: Array) -> PadReading:
        """A reading of a frame that nothing explains."""
        forces, chi2 = top.forces.reshape(self._shape), self._chi2(top)
        return PadReading(forces, information, chi2, self._unexplained(levels))

    def _chi2(self, top: Top) -> float:
        residuals = top.misfit.slope if self.used is None else top.misfit.slope[self.used]
        return reduced_chi_square(residuals, len(top.forces))

    @property
    def _shape(self) -> tuple[int, int]:
        return self.model.sensor.tactels.total, 3

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
            noise = 2 * self.response.variance / camera.amplitude**2
            if squares.mean(axis=(2, 4)).max() > DENSE**2 + noise:
                return Status.FRINGES_TOO_DENSE
        return Status.MODEL_MISMATCH

    def checked(self, frame: ArrayLike) -> Array | PadReading:
        """A frame's grey levels in one row if they can be used, or a reading that says why not."""
        camera = self.model.sensor.camera
        try:
            levels = np.asarray(frame, dtype=float)
        except (TypeError, ValueError):
            return self._bad(f"It holds {type(frame).__name__}, not grey levels.")
        if levels.shape != (shape := self.model.frame_shape):
            return self._bad(f"It has the shape {levels.shape}; this pad's frames have {shape}.")
        levels = levels.ravel()
        if self.used is not None:
            # what does not count is as if nothing touched
            levels = np.where(self.used, levels, self._silent)
        seen = levels if self.used is None else levels[self.used]
        darkest, brightest = float(seen.min()), float(seen.max())
        if not np.isfinite(darkest + brightest):
            return self._bad(f"{int((~np.isfinite(seen)).sum())} pixels are not a number.")
        if darkest < 0 or brightest > camera.full_scale:
            return self._bad(
                f"Grey levels from {darkest:g} to {brightest:g} exceed the converter's 0 to "
                f"{camera.full_scale}."
            )
        if darkest == brightest and camera.noise > 0.5:
            return self._bad(f"All pixels are {darkest:g}.")
        return levels

    def _bad(self, detail: str) -> PadReading:
        n = self.model.sensor.tactels.total
        return PadReading(
            forces=np.full((n, 3), np.nan),
            information=np.full((3 * n, 3 * n), np.nan),
            chi2=np.nan,
            status=Status.BAD_FRAME,
            detail=detail,
        )


def _squares(images: NDArray[np.intp]) -> NDArray[np.intp]:
    """Pixels of images, shape (k, rows, columns), square by square; the last odd ones left out."""
    rows, columns = (length // BLOCK for length in images.shape[1:])
    whole = images[:, : rows * BLOCK, : columns * BLOCK]
    squares = whole.reshape(len(images), rows, BLOCK, columns, BLOCK)
    return squares.swapaxes(2, 3).ravel()
