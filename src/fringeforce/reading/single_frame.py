"""One frame of a strip to one reading, without any earlier state."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.blas_threads import one_blas_thread
from fringeforce.base.errors import InputError
from fringeforce.contacts.friction_cone import within_friction_cone
from fringeforce.contacts.loads import checked_loads
from fringeforce.estimation.bad_pixels import isolated
from fringeforce.estimation.bounds import covariance as noise_covariance
from fringeforce.estimation.bounds import cramer_rao_bound
from fringeforce.estimation.residual_test import reduced_chi_square
from fringeforce.estimation.strip import Strip
from fringeforce.models.strip import SensorModel
from fringeforce.reading.calibration_uncertainty import CalibrationUncertainty
from fringeforce.reading.cold_start import cold_start
from fringeforce.reading.frame_reader import FrameReader
from fringeforce.reading.hypothesis_selection import Hypothesis
from fringeforce.reading.reading import Reading

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class SingleFrameReader(FrameReader):
    """Reads frames of one strip, each for itself."""

    model: SensorModel

    @property
    def influence(self) -> Array:
        """Influence matrix at the pixels of a frame, shape (P, 2n) [rad/N]."""
        return self.model.frame_influence

    @one_blas_thread()
    def search(self, levels: NDArray[Any], used: Mask, start: Array | None = None) -> Reading:
        """Read a frame that was checked; strips need no start, and take none."""
        if start is not None:
            raise InputError("start is for pads; a strip is searched as fast without it.")
        return self.stated(*self.explained(levels.astype(float), used))

    def bound(self, forces: ArrayLike) -> Array:
        """Smallest deviations that an unbiased reading can have, shape (n, 2) [N]."""
        loads, used = checked_loads(forces, self.model.sensor.tactels.count), self.usable(None)
        phase = self.influence[used] @ loads.reshape(-1)
        std = cramer_rao_bound(phase, self.influence[used], self.model.response.at(used))
        return std.reshape(self.forces_shape)

    def phase(self, forces: Array) -> Array:
        """Phase lead at the pixels, shape (n_pixels,) [rad]."""
        return self.model.phase(forces)

    def trial_forces(self) -> Array:
        """A newton on every tactel, shape (n, 2) [N]."""
        return np.tile([1.0, 0.0], (self.model.sensor.tactels.count, 1))

    @one_blas_thread()
    def explained(
        self, levels: Array, used: Mask, noise: float = 1.0, start: Array | None = None
    ) -> tuple[Hypothesis, Mask]:
        """Hypothesis of a frame that was checked, and the pixels that it is made from.

        Parameters
        ----------
        levels : ndarray, shape (P,)
            Grey levels, of one frame or the mean of several.
        used : ndarray of bool, shape (P,)
            Pixels to use.
        noise : float
            Variance of their noise, relative to that of one frame.
        start : ndarray, shape (2n,), optional
            Loads that may be nearly right, to start from besides [N].
        """
        response, calibration_uncertainty = self.model.response, self.calibration_uncertainty
        if noise != 1:
            response = replace(response, variance=noise * response.variance)
            calibration_uncertainty = calibration_uncertainty and replace(
                calibration_uncertainty, response=response
            )
        sound = used & ~isolated(levels, response)
        found = cold_start(
            levels,
            sound,
            self.influence,
            response,
            self.strip,
            self.model.sensor.camera.full_scale,
            self.channels,
            calibration_uncertainty,
            start,
        )
        return found, sound

    @cached_property
    def strip(self) -> Strip:
        """All usable pixels, in the light of the calibration, for the compiled loops."""
        return Strip.of(self.influence, self.model.response, self.usable_pixels, self.channels)

    @property
    def channels(self) -> int:
        """Channels of a frame, which see the same strip along the same pixels."""
        return len(self.model.sensor.polariscope.pictures)

    @cached_property
    def calibration_uncertainty(self) -> CalibrationUncertainty | None:
        """What the calibration leaves uncertain, if there was one."""
        return CalibrationUncertainty.left_in(self.model)

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

    @cached_property
    def usable_pixels(self) -> Mask:
        """Pixels that the calibration left in, in one row."""
        imaging = self.model.imaging
        return np.ones(len(self.influence), bool) if imaging is None else imaging.usable

    def stated(self, found: Hypothesis, used: Mask) -> Reading:
        """The reading of an interpretation."""
        covariance = found.covariance + self.calibration_covariance(found.loads, used, found.noise)
        loads, n = found.loads, len(found.loads) // 2
        limited = np.zeros(n, dtype=bool)
        if self.friction is not None:
            loads, limited = within_friction_cone(loads, covariance, self.friction)
        forces = loads.reshape(n, 2)
        return Reading.of(
            forces=forces,
            covariance=covariance,
            phase=partial(self.model.phase, forces),
            chi2=reduced_chi_square(found.residuals, len(loads)),
            status=found.status,
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
        if self.calibration_uncertainty is None:
            return np.zeros_like(spread)
        return self.calibration_uncertainty.covariance(loads, used, spread)
