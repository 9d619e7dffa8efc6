"""One frame to one reading, without any earlier state: checks before, words after."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import InputError
from fringeforce.contacts.friction_cone import admissible
from fringeforce.estimation.bad_pixels import isolated
from fringeforce.estimation.bounds import covariance as noise_covariance
from fringeforce.estimation.residual_test import reduced_chi_square
from fringeforce.estimation.strip import Strip
from fringeforce.models.strip import SensorModel
from fringeforce.reading.calibration_uncertainty import CalibrationDoubt
from fringeforce.reading.hypothesis_selection import Interpretation
from fringeforce.reading.illumination_drift import interpret_in_own_light
from fringeforce.reading.reading import Reading, Status

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class SingleFrameReader:
    """Reads frames of one sensor, each for itself.

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

    @property
    def influence(self) -> Array:
        """Influence matrix at the pixels of a frame, shape (P, 2n) [rad/N]."""
        return self.model.frame_influence

    def read(self, frame: ArrayLike, mask: ArrayLike | None = None) -> Reading:
        """Read one frame without any earlier state.

        Parameters
        ----------
        frame : array_like, shape (n_pixels,) or (n_channels, n_pixels)
            Grey levels.
        mask : array_like of bool, same shape, optional
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
        used = self.usable(mask)
        if isinstance(levels := self.checked(frame, used), Reading):
            return levels
        return self.search(levels.astype(float), used)

    def search(self, levels: Array, used: Mask) -> Reading:
        """Read a frame that was checked."""
        return self.stated(*self.explained(levels, used))

    def explained(
        self, levels: Array, used: Mask, noise: float = 1.0
    ) -> tuple[Interpretation, Mask]:
        """Interpretation of a frame that was checked, and the pixels that it is made from.

        Parameters
        ----------
        levels : ndarray, shape (P,)
            Grey levels, of one frame or the mean of several.
        used : ndarray of bool, shape (P,)
            Pixels to use.
        noise : float
            Variance of their noise, relative to that of one frame.
        """
        response, doubt = self.model.response, self.doubt
        if noise != 1:
            response = replace(response, variance=noise * response.variance)
            doubt = doubt and replace(doubt, response=response)
        sound = used & ~isolated(levels, response)
        found = interpret_in_own_light(
            levels,
            sound,
            self.influence,
            response,
            self.strip,
            self.model.sensor.camera.full_scale,
            self.model_error,
            self.channels,
            self.drift,
            doubt,
        )
        return found, sound

    @cached_property
    def strip(self) -> Strip:
        """All usable pixels, in the light of the calibration, for the compiled loops."""
        return Strip.of(self.influence, self.model.response, self._usable, self.channels)

    @property
    def channels(self) -> int:
        """Channels of a frame, which see the same strip along the same pixels."""
        return len(self.model.sensor.polariscope.pictures)

    @cached_property
    def doubt(self) -> CalibrationDoubt | None:
        """What the calibration leaves uncertain, if there was one."""
        imaging = self.model.imaging
        if imaging is None or not len(imaging.amplitude_modes):
            return None
        return CalibrationDoubt.of(imaging, self.influence, self.model.response)

    @property
    def drift(self) -> tuple[float, float]:
        """Standard deviations of the light's gain and offset from frame to frame."""
        return (0.0, 0.0) if self.model.imaging is None else self.model.imaging.drift

    @cached_property
    def silent_covariance(self) -> Array:
        """Covariance of the loads where nothing touches, shape (2n, 2n) [N^2]."""
        used = self.usable(None)
        spread = noise_covariance(
            np.zeros(int(used.sum())),
            self.influence[used],
            self.model.response.at(used),
        )
        return spread + self.calibration_covariance(np.zeros(len(spread)), used, spread)

    def checked(self, frame: ArrayLike, used: Mask) -> NDArray[Any] | Reading:
        """A frame's grey levels in one row if they can be used, or a reading that says why not."""
        try:
            levels = np.asarray(frame)
            if levels.dtype.kind not in "uif":
                levels = levels.astype(float)
        except (TypeError, ValueError):
            return self._bad(f"It holds {type(frame).__name__}, not grey levels.")
        if levels.shape != (shape := self.model.frame_shape):
            return self._bad(f"It has the shape {levels.shape}; this sensor's frames have {shape}.")
        levels = levels.ravel()
        problem = self._problem(levels, used)
        return self._bad(problem) if problem else levels

    @cached_property
    def _usable(self) -> Mask:
        imaging = self.model.imaging
        return np.ones(len(self.influence), bool) if imaging is None else imaging.usable

    @cached_property
    def _complete(self) -> bool:
        return bool(self._usable.all())

    def complete(self, used: Mask) -> bool:
        """Whether all pixels are used; known without a look where there is no mask."""
        return self._complete if used is self._usable else bool(used.all())

    def always_in_range(self, levels: NDArray[Any]) -> bool:
        """Whether all grey levels of this type are in the converter's range."""
        return levels.dtype.str in self._types_in_range

    @cached_property
    def _types_in_range(self) -> list[str]:
        types = (np.dtype(kind) for kind in ("u1", "u2"))
        most = self.model.sensor.camera.full_scale
        return [kind.str for kind in types if np.iinfo(kind).max <= most]

    def usable(self, mask: ArrayLike | None) -> Mask:
        """Pixels of a frame to use, in one row, under a mask of those to leave out."""
        usable, shape = self._usable, self.model.frame_shape
        if mask is None:
            return usable
        masked = np.asarray(mask, dtype=bool)
        if masked.shape != shape or (usable & ~masked.ravel()).sum() <= 2 * self.influence.shape[1]:
            raise InputError(
                f"A mask of shape {masked.shape} with {int((~masked).sum())} pixels to use does "
                f"not fit; this sensor's frames have the shape {shape} and need more than "
                f"{2 * self.influence.shape[1]} of them."
            )
        return usable & ~masked.ravel()

    def _problem(self, levels: NDArray[Any], used: Mask) -> str:
        camera = self.model.sensor.camera
        seen = levels if self.complete(used) else levels[used]
        if self.always_in_range(levels) and seen[0] != seen[-1]:
            return ""  # without a look at all pixels
        darkest, brightest = float(seen.min()), float(seen.max())
        if not isfinite(darkest + brightest):
            return f"{int((~np.isfinite(seen)).sum())} pixels are not a number."
        if darkest < 0 or brightest > camera.full_scale:
            return (
                f"Grey levels from {darkest:g} to {brightest:g} exceed the converter's 0 to "
                f"{camera.full_scale}."
            )
        if darkest == brightest and camera.noise > 0.5:
            return f"All pixels are {darkest:g}."
        return ""

    def stated(self, found: Interpretation, used: Mask) -> Reading:
        """The reading of an interpretation."""
        covariance = found.covariance + self.calibration_covariance(found.loads, used, found.noise)
        loads, n = found.loads, len(found.loads) // 2
        limited = np.zeros(n, dtype=bool)
        if self.friction is not None:
            loads, limited = admissible(loads, covariance, self.friction)
        return Reading(
            forces=loads.reshape(n, 2),
            covariance=covariance,
            phase=self.model.phase(loads.reshape(n, 2)),
            chi2=reduced_chi_square(found.residuals, len(loads)),
            status=found.status,
            detail="",
            alternatives=np.reshape(found.rivals, (-1, n, 2)),
            limited=limited,
        )

    def calibration_covariance(self, loads: Array, used: Mask, spread: Array) -> Array:
        """Covariance of loads that the calibration's own errors cause, shape (2n, 2n) [N^2].

        Parameters
        ----------
        loads : ndarray, shape (2n,)
            Loads [N].
        used : ndarray of bool, shape (n_pixels,)
            Pixels that were used.
        spread : ndarray, shape (2n, 2n)
            Covariance from noise alone, which says how far errors of the levels move them [N^2].
        """
        if self.doubt is None:
            return np.zeros_like(spread)
        return self.doubt.covariance(loads, used, spread)

    def _bad(self, detail: str) -> Reading:
        pixels, unknowns = self.model.sensor.camera.pixels, self.influence.shape[1]
        return Reading(
            forces=np.full((unknowns // 2, 2), np.nan),
            covariance=np.full((unknowns, unknowns), np.nan),
            phase=np.full(pixels, np.nan),
            chi2=np.nan,
            status=Status.BAD_FRAME,
            detail=detail,
            alternatives=np.empty((0, unknowns // 2, 2)),
            limited=np.zeros(unknowns // 2, dtype=bool),
        )
