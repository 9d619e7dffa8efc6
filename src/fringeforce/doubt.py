"""What a calibration leaves uncertain of the grey levels, fast enough for every reading.

Modes are smooth along the strip: what they change in matrix and light is kept as means over blocks
of pixels, while the phase, which is not smooth, is taken at every pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.force.likelihood import Response
from fringeforce.imaging import Imaging

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Mask = NDArray[np.bool_]

BLOCK = 8
"""Pixels of a block, much shorter than the strip is thick."""


@dataclass(frozen=True, eq=False)
class CalibrationDoubt:
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
    """

    influence: Array
    response: Response
    matrix: Single
    light: Single

    @classmethod
    def of(cls, imaging: Imaging, influence: Array, response: Response) -> CalibrationDoubt:
        """Doubt that an imaging states; the influence matrix is that at its pixels, (P, 2n)."""
        modes = imaging.influence_modes
        matrix = modes.reshape(*modes.shape[:2], influence.shape[1])
        light = np.stack([imaging.amplitude_modes, imaging.offset_modes])
        usable = imaging.usable
        return cls(
            influence,
            response,
            np.ascontiguousarray(np.swapaxes(_means(np.swapaxes(matrix, 1, 2), usable), 1, 2)),
            _means(light, usable),
        )

    def __call__(self, loads: Array, pixels: Mask) -> Array:
        """Modes of the grey levels of some pixels under given loads, shape (k, p)."""
        phase, lit = self.influence[pixels] @ loads, self.response.at(pixels)
        turned = self.matrix @ loads.astype(np.float32)
        blocks = np.flatnonzero(pixels) // BLOCK
        brightness = (lit.level(phase) - lit.offset) / lit.amplitude
        levels = self.light[0][:, blocks] * brightness.astype(np.float32)
        levels += self.light[1][:, blocks]
        levels[: len(turned)] += turned[:, blocks] * lit.slope(phase).astype(np.float32)
        return np.asarray(levels, dtype=float)

    def covariance(self, loads: Array, pixels: Mask, spread: Array) -> Array:
        """Covariance that the modes add to loads, as `systematic_covariance` states it.

        Parameters
        ----------
        loads : ndarray, shape (2n,)
            Loads [N].
        pixels : ndarray of bool, shape (P,)
            Pixels that were used.
        spread : ndarray, shape (2n, 2n)
            Covariance of the loads from noise alone [N^2].
        """
        phase = self.influence @ loads
        slope = np.where(pixels, self.response.slope(phase), 0.0)
        brightness = (self.response.level(phase) - self.response.offset) / self.response.amplitude
        pulled = self.influence * slope[:, None]
        shapes = np.stack([pulled * brightness[:, None], pulled], axis=0)
        by_light = _sums(shapes).astype(np.float32)
        by_matrix = _sums(pulled * slope[:, None]).astype(np.float32)
        turned = self.matrix @ loads.astype(np.float32)
        pulls = np.asarray((self.light @ by_light).sum(axis=0), dtype=float)
        pulls[: len(turned)] += turned @ by_matrix
        moved = pulls @ spread / self.response.variance
        return np.asarray(moved.T @ moved, dtype=float)


def _sums(values: Array) -> Array:
    """Sums over the pixels of every block, from shape (..., P, m) to (..., B, m)."""
    return np.add.reduceat(values, np.arange(0, values.shape[-2], BLOCK), axis=-2)


def _means(values: Array, usable: Mask) -> Single:
    """Means over the usable pixels of every block, from shape (..., P) to (..., B)."""
    starts = np.arange(0, len(usable), BLOCK)
    count = np.maximum(np.add.reduceat(usable.astype(float), starts), 1)
    return (np.add.reduceat(values * usable, starts, axis=-1) / count).astype(np.float32)
