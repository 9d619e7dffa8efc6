"""The covariance that agrees with the variance of the phase that it causes, by SciPy alone."""

import numpy as np
from scipy.optimize import least_squares

from fringeforce.estimation.likelihood import Response

NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(40)


def agreed(influence: np.ndarray, loads: np.ndarray, response: Response) -> np.ndarray:
    """Inverse of the mean information over phases that scatter as the inverse itself says.

    The mean over a normal phase is Gauss-Hermite quadrature of the squared slope of equation (13);
    the equation C = J(C)^-1 is left to SciPy's solver, in units of a typical variance.
    """
    phase, unit, size = influence @ loads, 1e-4, len(loads)

    def off(flat: np.ndarray) -> np.ndarray:
        covariance = unit * flat.reshape(size, size)
        variance = np.einsum("ki,ij,kj->k", influence, covariance, influence)
        drawn = phase[:, None] + np.sqrt(np.maximum(variance, 0))[:, None] * NODES
        slopes = response.amplitude / 2 * np.sin(drawn)
        weight = slopes**2 @ WEIGHTS / WEIGHTS.sum() / response.variance
        information = (influence * weight[:, None]).T @ influence
        return (covariance @ information - np.eye(size)).ravel()

    found = least_squares(off, np.eye(size).ravel(), method="lm")
    assert found.success
    assert np.abs(found.fun).max() < 1e-9
    return unit * found.x.reshape(size, size)
