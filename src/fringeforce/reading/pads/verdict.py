"""Whether forces explain a frame of a pad, and a verdict where they do not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from math import isqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from fringeforce.estimation.hypotheses import CONFIDENCE
from fringeforce.estimation.likelihood import Response, misfit
from fringeforce.estimation.residual_test import (
    FALSE_ALARM,
    FALSE_VERDICT,
    GROUP,
    is_noise,
    reduced_chi_square,
    square_limit,
)
from fringeforce.models.pad import PadModel
from fringeforce.models.strain_error import strain_deviation
from fringeforce.reading.contact_prior import UNSEEN_PUSH, unseen_words
from fringeforce.reading.pads.fit import Fit, Optimum
from fringeforce.reading.pads.light import Curve
from fringeforce.reading.pads.mirror_images import Verdict
from fringeforce.reading.reading import Reading, Status

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BLOCK_SIDE = isqrt(GROUP)
"""Side of the squares of pixels whose residuals are summed to find a misfit that noise hides."""
HALF = 0.5
"""Probability of an explanation where too little shows to rule out others: even odds."""
MISTAKEN = 0.01
"""Share of a load's trace in a frame that a mistaken explanation leaves at least."""
CLIPPED = 0.02
"""Share of pixels at the converter's limit above which a frame that nothing explains is clipped."""
DENSE_DIFFERENCE = 0.35
"""Difference of like pixels side by side, root mean square, beyond which fringes are too dense."""


@dataclass(frozen=True, eq=False)
class FrameClassifier:
    """Judges frames of one pad, of which some pixels count.

    Attributes
    ----------
    model : PadModel
        Of the pad.
    response : Response
        Of its camera.
    used : ndarray of bool, shape (channels * P,), optional
        Pixels that count; all if not given.
    confidence : float
        Probability from which a reading is OK.
    """

    model: PadModel
    response: Response
    used: Mask | None = None
    confidence: float = CONFIDENCE

    def explained(self, optimum: Optimum) -> bool:
        """Whether forces leave nothing but noise."""
        return self.noise(optimum.misfit.slope, self.loads)

    def noise(self, slope: Array, unknowns: int, chance: float = FALSE_ALARM) -> bool:
        """Whether residuals of all pixels, shape (channels * P,), look like noise."""
        residuals = slope[self._order]
        # where squares are fewer than loads, these leave nothing of them
        return is_noise(residuals, unknowns, chance, grouped=len(residuals) // GROUP > unknowns)

    @cached_property
    def _order(self) -> NDArray[np.intp]:
        """Pixels that count, those of a square that measure alike one after the other."""
        step = 1 if len(self.model.pictures[0].forms) == 1 else 2
        shape = len(self.model.pictures), *self.model.frame_shape[-2:]
        images = np.arange(np.prod(shape)).reshape(shape)
        alike = [_squares(images[:, i::step, j::step]) for i in range(step) for j in range(step)]
        order = np.concatenate(alike)
        return order if self.used is None else order[self.used[order]]

    def plain(self, optimum: Optimum, silence: float) -> bool:
        """Whether what other forces would leave of a frame could not be taken for noise."""
        freedom = len(self._order)
        return MISTAKEN * (silence - optimum.misfit.loss) > square_limit(freedom) - freedom

    def silence(self, fit: Fit) -> float:
        """Loss of a frame without forces."""
        if fit.uncertain is not None:
            return fit.silence()
        count = slice(None) if self.used is None else self.used
        return misfit(fit.frame[count], self._silent[count], self.response).loss

    def reading(
        self,
        optimum: Optimum,
        verdict: Verdict,
        silence: float,
        covariance: Callable[[], Array],
        tracked: bool = False,
        doubt: str = "",
    ) -> Reading:
        """What an explanation comes to, or several; `doubt` says why others may be as good."""
        status, unknowns, detail = Status.OK, len(optimum.forces), ""
        probability = verdict.probability * (HALF if doubt else 1.0)
        others = verdict.others
        if silence - optimum.misfit.loss <= square_limit(unknowns, FALSE_VERDICT):
            status = Status.NO_CONTACT
        elif probability < self.confidence:
            status = Status.AMBIGUOUS
            detail = doubt
        else:
            others = others[:0]
        if self.unseen.any():
            detail = f"{detail} {unseen_words(self.unseen)}".strip()
            if status is Status.NO_CONTACT:
                status = Status.AMBIGUOUS if self.unseen.all() else Status.OK
        forces = verdict.forces.reshape(self._shape)
        return Reading.of(
            forces=forces,
            chi2=self.chi2(optimum),
            status=status,
            covariance=self._widened(covariance, forces),
            phase=partial(self.model.retardance, forces),
            detail=detail,
            alternatives=others.reshape(-1, *self._shape),
            tracked=tracked,
            probability=probability,
        )

    def _widened(self, covariance: Callable[[], Array], forces: Array) -> Callable[[], Array]:
        """A covariance with what large strain changes, where the design asks for it.

        And as wide as forces may be that no light shows.
        """
        sensor, unseen = self.model.sensor, self.unseen
        large = sensor.transducer.strain != "linear"
        if not (large or unseen.any()):
            return covariance
        wider = np.repeat(np.where(unseen, UNSEEN_PUSH, 1.0), forces.shape[1])
        deviation = strain_deviation(sensor, forces) if large else np.zeros(forces.shape)
        more = np.diag(np.square(deviation).ravel())
        return lambda: wider[:, None] * covariance() * wider + more

    @property
    def loads(self) -> int:
        """Forces that a fit takes from frames: what no light shows takes nothing."""
        return 3 * int(np.count_nonzero(~self.unseen))

    @cached_property
    def unseen(self) -> Mask:
        """Tactels, or squares of a skin, that no light shows, shape (n,).

        Stresses reach as far beside what presses as the clear layer is thick.
        """
        sensor, (rows, columns) = self.model.sensor, self.model.frame_shape[-2:]
        x, y = sensor.pixel_positions
        seen = np.ones((rows, columns), dtype=bool)
        if self.used is not None:
            seen = self.used.reshape(-1, rows, columns).any(axis=0)
        pixels = np.stack(np.meshgrid(x, y), axis=-1)[seen]
        distance, _ = KDTree(pixels).query(sensor.tactels.places)
        return np.asarray(distance > sensor.transducer.photoelastic.thickness)

    def unexplained(
        self, levels: Array, optimum: Optimum, covariance: Callable[[], Array]
    ) -> Reading:
        """A reading of a frame that nothing explains."""
        forces = optimum.forces.reshape(self._shape)
        return Reading.of(
            forces=forces,
            chi2=self.chi2(optimum),
            status=self.refusal(levels),
            covariance=covariance,
            phase=partial(self.model.retardance, forces),
            probability=0.0,
        )

    def chi2(self, optimum: Optimum) -> float:
        """Reduced chi-square of what an explanation leaves."""
        return self.reduced(optimum.misfit.slope, self.loads)

    def reduced(self, slope: Array, unknowns: int) -> float:
        """The same of residuals of all pixels, shape (channels * P,)."""
        return reduced_chi_square(slope if self.used is None else slope[self.used], unknowns)

    @property
    def _shape(self) -> tuple[int, int]:
        return self.model.sensor.tactels.total, 3

    @cached_property
    def _silent(self) -> Array:
        """Grey levels where nothing touches."""
        nothing = self.model.intensity(np.zeros((self.model.sensor.tactels.total, 3)))
        level = np.asarray(self.response.amplitude * nothing.ravel() + self.response.offset)
        curve = Curve.of(self.model.sensor.camera)
        return level if curve.straight else curve.level(level)

    def refusal(self, levels: Array) -> Status:
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
            if squares.mean(axis=(2, 4)).max() > DENSE_DIFFERENCE**2 + noise:
                return Status.FRINGES_TOO_DENSE
        return Status.MODEL_MISMATCH

    def filled(self, levels: NDArray[Any]) -> Array:
        """Grey levels as numbers, where what does not count is as if nothing touched."""
        grey = levels.astype(float)
        return grey if self.used is None else np.where(self.used, grey, self._silent)


def _squares(images: NDArray[np.intp]) -> NDArray[np.intp]:
    """Pixels of images, shape (k, rows, columns), square by square; the last odd ones left out."""
    rows, columns = (length // BLOCK_SIDE for length in images.shape[1:])
    whole = images[:, : rows * BLOCK_SIDE, : columns * BLOCK_SIDE]
    squares = whole.reshape(len(images), rows, BLOCK_SIDE, columns, BLOCK_SIDE)
    return squares.swapaxes(2, 3).ravel()
