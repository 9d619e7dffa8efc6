"""What a calibration leaves uncertain of the grey levels, fast enough for every reading.

Modes are smooth along the strip: what they change in matrix and light is kept as means over blocks
of pixels, while the phase, which is not smooth, is taken at every pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.bounds import systematic_covariance
from fringeforce.estimation.likelihood import Response
from fringeforce.models.imaging import Imaging
from fringeforce.models.strip import SensorModel

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Mask = NDArray[np.bool_]

BLOCKS = 256
"""Into which the strip is cut, each much shorter than it is thick."""


@dataclass(frozen=True, eq=False)
class CalibrationUncertainty:
    """Modes of a calibration, of unit variance each; k modes, of which d change the matrix.

    Attributes
    ----------
    influence : ndarray, shape (P, 2n)
        Influence matrix [rad/N].
    response : Response
        Of the camera.
    matrix : ndarray, shape (d, B, 2n)
        Changes of the matrix in every block [rad/N].
    light : ndarray, shape (2, k, B)
        Changes of amplitude and offset, grey levels.
    width : int
        Pixels of a block.
    """

    influence: Array
    response: Response
    matrix: Single
    light: Single
    width: int

    @classmethod
    def left_in(cls, model: SensorModel) -> CalibrationUncertainty | None:
        """What the calibration of a model leaves uncertain, if there was one."""
        imaging = model.imaging
        if imaging is None or not len(imaging.amplitude_modes):
            return None
        return cls.of(imaging, model.frame_influence, model.response)

    @classmethod
    def of(cls, imaging: Imaging, influence: Array, response: Response) -> CalibrationUncertainty:
        """Doubt that an imaging states; the influence matrix is that at its pixels, (P, 2n)."""
        usable, modes = imaging.usable, imaging.influence_modes
        width = -(-len(usable) // BLOCKS)
        starts = np.arange(0, len(usable), width)
        count = np.maximum(np.add.reduceat(usable.astype(float), starts), 1)

        def means(values: Array) -> Single:
            """Means over the usable pixels of every block, from (k, P, m) to (k, B, m)."""
            sums = np.add.reduceat(values * usable[:, None], starts, axis=1)
            return (sums / count[:, None]).astype(np.float32)

        light = np.stack([imaging.amplitude_modes, imaging.offset_modes], axis=2)
        return cls(
            influence,
            response,
            means(modes.reshape(*modes.shape[:2], influence.shape[1])),
            np.ascontiguousarray(np.moveaxis(means(light), 2, 0)),
            width,
        )

    def covariance(self, loads: Array, pixels: Mask, spread: Array) -> Array:
        """Covariance that the modes add to loads, shape (2n, 2n) [N^2].

        Parameters
        ----------
        loads : ndarray, shape (2n,)
            Loads [N].
        pixels : ndarray of bool, shape (P,)
            Pixels that were used.
        spread : ndarray, shape (2n, 2n)
            Covariance of the loads from noise alone [N^2].
        """
        slope, brightness = self._seen(loads)
        pulled = self.influence * (slope * pixels)[:, None]
        by_light = self._sums(pulled * brightness[:, None]), self._sums(pulled)
        pulls = self.light[0] @ by_light[0] + self.light[1] @ by_light[1]
        turned = self.matrix @ loads.astype(np.float32)
        pulls[: len(turned)] += turned @ self._sums(pulled * slope[:, None])
        return systematic_covariance(pulls.astype(float), spread, self.response.variance)

    def _seen(self, loads: Array) -> tuple[Array, Array]:
        """Slope of the grey levels over the phase, and normalised intensity, shape (P,) each."""
        phase = self.influence @ loads
        return self.response.slope(phase), self.response.brightness(phase)

    def _sums(self, values: Array) -> Single:
        """Sums over the pixels of every block, from shape (P, m) to (B, m)."""
        return np.add.reduceat(values, np.arange(0, len(values), self.width)).astype(np.float32)
