"""Corrections of influence columns that no design value explains.

A column may be wrong in height and in place: it is corrected by itself times one smooth function,
and by its slope times another.  Far from its tactel, where it vanishes, nothing is invented.  The
functions are Gaussian processes along the strip with Matern's kernel of order 5/2 (Rasmussen and
Williams, Gaussian Processes for Machine Learning, 2006, equation 4.17), written in cubic B-splines;
stresses are smooth over the thickness of the strip, and so are their errors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, CubicSpline

from fringeforce.base.arrays import Array
from fringeforce.calibration.design_jacobian import PLACES
from fringeforce.models.strip import SensorModel

DEGREE = 3
PER_DEPTH = 4
"""Splines per thickness of the strip."""
NEGLIGIBLE = 1e-2
"""Share of the largest variance of a function below which it is left out: a tenth in deviation."""


@dataclass(frozen=True, eq=False)
class Columns:
    """The corrections that are possible, of unit size; n tactels, r functions.

    Attributes
    ----------
    parts : CubicSpline
        Every column along the strip, and its slope scaled to the same size, (s, 2, 2n) [rad/N].
    functions : BSpline
        Smooth functions along the strip, (s, r).
    depth : float
        Thickness of the strip, over which they are smooth [m].
    """

    parts: CubicSpline
    functions: BSpline
    depth: float

    @classmethod
    def of(cls, model: SensorModel) -> Columns:
        """Those of the columns of a model."""
        transducer = model.sensor.transducer
        half = transducer.length / 2
        depth = transducer.compliant.thickness + transducer.photoelastic.thickness
        grid = np.linspace(-half, half, PLACES)
        columns = CubicSpline(grid, model.influence(grid).reshape(PLACES, -1))
        heights, slopes = columns(grid), columns(grid, 1)
        slopes *= np.sqrt((heights**2).sum(axis=0) / (slopes**2).sum(axis=0))
        parts = CubicSpline(grid, np.stack([heights, slopes], axis=1))
        intervals = int(np.ceil(PER_DEPTH * transducer.length / depth))
        knots = np.pad(np.linspace(-half, half, intervals + 1), DEGREE, mode="edge")
        centres = np.convolve(knots[1:-1], np.ones(DEGREE) / DEGREE, "valid")
        distance = np.sqrt(5) * np.abs(np.subtract.outer(centres, centres)) / depth
        variances, directions = np.linalg.eigh((1 + distance + distance**2 / 3) * np.exp(-distance))
        kept = variances > NEGLIGIBLE * variances[-1]
        root = directions[:, kept] * np.sqrt(variances[kept])
        return cls(parts, BSpline(knots, root, DEGREE), depth)

    @property
    def tactels(self) -> int:
        """Number of tactels n."""
        return self.parts.c.shape[-1] // 2

    @property
    def count(self) -> int:
        """Coefficients of either kind of error, 2n r."""
        return self.parts.c.shape[-1] * self.functions.c.shape[1]

    def at(self, x: ArrayLike) -> tuple[Array, Array]:
        """What is multiplied (m, 2, 2n) [rad/N], and the functions (m, r); ends go on beyond."""
        inside = np.clip(x, self.parts.x[0], self.parts.x[-1])
        return np.asarray(self.parts(inside)), np.asarray(self.functions(inside))

    def correction(self, coefficients: Array, x: ArrayLike) -> Array:
        """What coefficients add to the columns at some places.

        Parameters
        ----------
        coefficients : ndarray, shape (..., 4n r)
            Those of heights, then those of slopes, column by column.
        x : array_like, shape (m,)
            Places along the strip [m].

        Returns
        -------
        ndarray, shape (..., m, 2n)
            In rad/N.
        """
        parts, functions = self.at(x)
        shape = (*coefficients.shape[:-1], *parts.shape[1:], functions.shape[1])
        errors = coefficients.reshape(shape) @ functions.T  # (..., 2, 2n, m)
        return np.einsum("...kcm,mkc->...mc", errors, parts)

    def rows(self, x: Array) -> Array:
        """What each coefficient adds to its own column, shape (4n r, m) [rad/N]."""
        parts, functions = self.at(x)
        return np.einsum("mkc,mr->kcrm", parts, functions).reshape(2 * self.count, len(x))
