"""Fixed pattern of the camera: what every pixel adds to a smooth amplitude and offset.

Two unknowns for every pixel, normally distributed about zero.  Given all others they are
independent from pixel to pixel, so that they are estimated and eliminated one pixel at a time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fringeforce.base.arrays import Array

NONE = 1e-6
"""Standard deviation that stands for no pattern at all, grey levels."""


@dataclass(frozen=True, eq=False)
class FixedPatternNoise:
    """Deviations of single pixels from the smooth lighting.

    Attributes
    ----------
    levels : ndarray, shape (2, P)
        Differences of the amplitude, then of the offset, grey levels.
    known : ndarray, shape (2, P)
        What is known of them from elsewhere, such as the offset's from frames in the dark.
    precision : ndarray, shape (2, P)
        Inverse variances of that.
    """

    levels: Array
    known: Array
    precision: Array

    @classmethod
    def unseen(
        cls,
        pixels: int,
        sizes: tuple[float, float],
        dark: Array | None,
        variance: Array | float,
    ) -> FixedPatternNoise:
        """One of which only its size is known, and its offset if there are frames in the dark.

        Parameters
        ----------
        pixels : int
            How many there are.
        sizes : pair of float
            Standard deviations of amplitude and offset from pixel to pixel, grey levels.
        dark : ndarray, shape (P,)
            Measured deviations of the offset, grey levels.
        variance : float or ndarray, shape (P,)
            Variance of `dark`, squared grey levels.
        """
        precision = np.outer(1 / np.maximum(sizes, NONE) ** 2, np.ones(pixels))
        known = np.zeros((2, pixels))
        if dark is not None:
            precision[1] += 1 / np.asarray(variance)
            known[1] = dark / (variance * precision[1])
        return cls(known, known, precision)

    def improved(self, gradient: Array, information: Array) -> FixedPatternNoise:
        """The likeliest pattern given what the frames say.

        Parameters
        ----------
        gradient : ndarray, shape (2, P)
            Half that of the frames' loss by the pattern.
        information : ndarray, shape (2, 2, P)
            Half its second derivatives.
        """
        whole = self.information(information)
        gradients = gradient + self.precision * (self.levels - self.known)
        step = np.linalg.solve(whole, gradients.T[..., None])[..., 0].T
        return replace(self, levels=self.levels - step)

    def information(self, frames: Array) -> Array:
        """Information of frames, (2, 2, P), and of what was known, together, (P, 2, 2)."""
        diagonal = np.eye(2)[:, :, None] * self.precision
        return np.moveaxis(frames + diagonal, 2, 0)
