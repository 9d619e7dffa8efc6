"""Errors of shape of the influence matrix: whether a frame shows them, and what they do to loads.

If every column of the influence matrix has a smooth relative error of its own, of size e, the
residuals carry the covariance e^2 K with K = (sum_j c_j c_j') o k, where c_j is the column's part
of the frame and k a Gaussian in the distance of two pixels, less what the fitted loads absorb; and
what the loads absorb moves them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from fringeforce.estimation.residual_test import group_sums

Array = NDArray[np.float64]

SMOOTH = 1 / 16
"""Correlation length of errors of shape, as a share of the frame."""


@dataclass(frozen=True, eq=False)
class ModelDiscrepancy:
    """What one frame says of errors of shape.

    Attributes
    ----------
    chance : float
        That noise alone leaves as much; tiny if the model is wrong.
    size : float
        Estimated relative size e of the errors; none where the residuals are below expectation.
    bias : ndarray, shape (m, m)
        Covariance of the loads' errors for e = 1 [N^2].
    """

    chance: float
    size: float
    bias: Array


def model_discrepancy(
    residuals: Array,
    slope: Array,
    influence: Array,
    loads: Array,
    covariance: Array,
    known: Array | None = None,
) -> ModelDiscrepancy:
    """Look for errors of shape in what is left of a frame.

    The statistic r' K r is the locally most powerful test; for pure noise it is a sum of squares
    whose tail is that of a scaled chi-square with the same two moments (Satterthwaite, Biometrics
    Bulletin 2, 110-114, 1946), and its excess over the trace estimates e^2.

    Parameters
    ----------
    residuals : ndarray, shape (P,)
        Residuals in units of the noise, in the order of the pixels.
    slope : ndarray, shape (P,)
        Derivative of the grey level by the phase, in units of the noise.
    influence : ndarray, shape (P, m)
        Influence matrix [rad/N].
    loads : ndarray, shape (m,)
        Fitted loads [N].
    covariance : ndarray, shape (m, m)
        Of the fitted loads, from noise alone [N^2].
    known : ndarray, shape (P // GROUP, k), optional
        Group sums of independent errors of unit variance that the levels are known to have besides
        noise, in units of the noise.
    """
    tangent = group_sums(slope[:, None] * influence)
    left = group_sums(residuals[:, None])[:, 0]
    parts = tangent * loads
    place = np.arange(len(left)) / len(left)
    distance = np.subtract.outer(place, place)
    kernel = (parts @ parts.T) * np.exp(-0.5 * (distance / SMOOTH) ** 2)
    absorbed = covariance @ tangent.T
    bias = absorbed @ kernel @ absorbed.T
    basis = np.linalg.qr(tangent)[0]
    kernel -= basis @ (basis.T @ kernel)
    kernel -= (kernel @ basis) @ basis.T
    square, weighed = (kernel**2).sum(), kernel
    if known is not None:
        weighed = kernel + (kernel @ known) @ known.T
    mean, spread = np.trace(weighed), (weighed * weighed.T).sum()
    if len(left) <= len(loads) or mean <= 0:  # the loads absorb whatever errors could leave
        return ModelDiscrepancy(1.0, 0.0, bias)
    found = left @ kernel @ left
    chance = float(chdtrc(mean**2 / spread, found * mean / spread))
    return ModelDiscrepancy(chance, float(np.sqrt(max(found - mean, 0) / square)), bias)
