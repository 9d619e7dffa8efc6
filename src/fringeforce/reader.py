"""From a model and a frame to a reading that never fails: checks before, words after."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.errors import InputError
from fringeforce.force.admissible import admissible
from fringeforce.force.goodness import reduced_chi_square
from fringeforce.force.likelihood import Response
from fringeforce.imaging import Imaging, camera_response
from fringeforce.interpretation import Interpretation, interpret
from fringeforce.model import SensorModel
from fringeforce.reading import Reading, Status

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

THINNED = 4
"""Every so many pixels tell what a calibration leaves uncertain."""


@dataclass(frozen=True, eq=False)
class Reader:
    """Reads frames of one sensor.

    Attributes
    ----------
    model : SensorModel
        The characterised sensor.
    friction : float or None
        If given, forces are limited to N >= 0 and |T| <= friction N.
    model_error : float
        Relative size of smooth errors in the shape of the influence matrix, such as 0.03 for a
        sensor that was characterised from its drawing and never calibrated; it widens the
        deviations.  Without it a frame that shows such errors reads MODEL_MISMATCH.
    """

    model: SensorModel
    friction: float | None = None
    model_error: float = 0.0

    def __post_init__(self) -> None:
        if self.friction is not None and not self.friction > 0:
            raise InputError(
                f"friction = {self.friction}: must be greater than 0; leave it out for no limits."
            )
        if not 0 <= self.model_error < 1:
            raise InputError(
                f"model_error = {self.model_error}: must be from 0 to below 1, such as 0.03."
            )

    @cached_property
    def response(self) -> Response:
        """What the sensor's camera makes of a phase."""
        camera, imaging = self.model.sensor.camera, self.model.imaging
        if imaging is None:
            return camera_response(camera)
        return camera_response(camera, imaging.amplitude, imaging.offset)

    @cached_property
    def influence(self) -> Array:
        """Influence matrix at the pixels, shape (n_pixels, 2n) [rad/N]."""
        psi = self.model.pixel_influence
        return np.ascontiguousarray(psi.reshape(len(psi), -1))

    def read(self, frame: ArrayLike, mask: ArrayLike | None = None) -> Reading:
        """Read one frame without any earlier state.

        Parameters
        ----------
        frame : array_like, shape (n_pixels,)
            Grey levels.
        mask : array_like of bool, shape (n_pixels,), optional
            Pixels to leave out, where true.

        Returns
        -------
        Reading
            Never an error for a bad frame: its status says what to do.

        Raises
        ------
        InputError
            If the mask does not fit the sensor.
        """
        used = self._usable(mask)
        try:
            levels = np.asarray(frame, dtype=float)
        except (TypeError, ValueError):
            return self._bad(f"It holds {type(frame).__name__}, not grey levels.")
        if problem := self._problem(levels, used):
            return self._bad(problem)
        sound = used & ~_dead(levels, self.response)
        full_scale = self.model.sensor.camera.full_scale
        found = interpret(
            levels,
            sound,
            self.influence,
            self.response,
            full_scale,
            self.model_error,
            self._doubt,
        )
        return self._stated(found)

    def _usable(self, mask: ArrayLike | None) -> Mask:
        pixels, imaging = len(self.influence), self.model.imaging
        usable = np.ones(pixels, dtype=bool) if imaging is None else imaging.usable
        if mask is None:
            return usable
        masked = np.asarray(mask, dtype=bool)
        if masked.shape != (pixels,) or (usable & ~masked).sum() <= 2 * self.influence.shape[1]:
            raise InputError(
                f"A mask of shape {masked.shape} with {int((~masked).sum())} pixels to use does "
                f"not fit; this sensor has {pixels} pixels and needs more than "
                f"{2 * self.influence.shape[1]} of them."
            )
        return usable & ~masked

    def _problem(self, levels: Array, used: Mask) -> str:
        camera = self.model.sensor.camera
        if levels.shape != used.shape:
            return f"It has the shape {levels.shape}; this sensor's frames have {used.shape}."
        seen = levels[used]
        if not np.isfinite(seen).all():
            return f"{int((~np.isfinite(seen)).sum())} pixels are not a number."
        if seen.min() < 0 or seen.max() > camera.full_scale:
            return (
                f"Grey levels from {seen.min():g} to {seen.max():g} exceed the converter's 0 to "
                f"{camera.full_scale}."
            )
        if np.ptp(seen) == 0 and camera.noise > 0.5:
            return f"All pixels are {seen[0]:g}."
        return ""

    def _stated(self, found: Interpretation) -> Reading:
        covariance = found.covariance
        loads, n = found.loads, len(found.loads) // 2
        limited = np.zeros(n, dtype=bool)
        if self.friction is not None:
            loads, limited = admissible(loads, covariance, self.friction)
        return Reading(
            forces=loads.reshape(2, n),
            covariance=covariance,
            phase=self.influence @ loads,
            chi2=reduced_chi_square(found.residuals, len(loads)),
            status=found.status,
            detail="",
            alternatives=np.reshape(found.rivals, (-1, 2, n)),
            limited=limited,
        )

    @cached_property
    def _thinned(self) -> tuple[Imaging, Array] | None:
        """Imaging and influence of some pixels, whose modes are smooth enough to tell of all."""
        imaging, some = self.model.imaging, np.arange(0, len(self.influence), THINNED)
        return None if imaging is None else (imaging.at(some), self.influence[some])

    def _doubt(self, loads: Array) -> Array:
        """Modes of the grey levels that the calibration leaves uncertain, shape (k, P)."""
        pixels = len(self.influence)
        if self._thinned is None:
            return np.empty((0, pixels))
        imaging, influence = self._thinned
        modes = imaging.level_modes(loads, influence @ loads)
        return np.repeat(modes, THINNED, axis=1)[:, :pixels]

    def _bad(self, detail: str) -> Reading:
        pixels, unknowns = self.influence.shape
        return Reading(
            forces=np.full((2, unknowns // 2), np.nan),
            covariance=np.full((unknowns, unknowns), np.nan),
            phase=np.full(pixels, np.nan),
            chi2=np.nan,
            status=Status.BAD_FRAME,
            detail=detail,
            alternatives=np.empty((0, 2, unknowns // 2)),
            limited=np.zeros(unknowns // 2, dtype=bool),
        )


def _dead(levels: Array, response: Response) -> Mask:
    """Single pixels that stand out from both of their neighbours as no fringe does."""
    middle = (levels[:-2] + levels[2:]) / 2
    apart = np.abs(levels[2:] - levels[:-2])
    alone = np.abs(levels[1:-1] - middle)
    inner = response.at(slice(1, -1))
    limit = np.maximum(8 * np.sqrt(inner.variance), inner.amplitude / 4)
    return np.pad((alone > limit) & (alone > 3 * apart), 1)
