"""Explanations of one frame against each other: their weights, and what several come to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def posterior_weights(masses: Array) -> Array:
    """Posterior weights of explanations, shape (k,); they add up to one.

    Parameters
    ----------
    masses : ndarray, shape (k,)
        Logarithms of their posterior masses, less a common constant.
    """
    shares = np.exp(masses - masses.max())
    return np.asarray(shares / shares.sum())


def mixture(weights: Array, means: Array, covariances: Array) -> tuple[Array, Array]:
    """Mean and covariance of several normal explanations together.

    Parameters
    ----------
    weights : ndarray, shape (k,)
        Of the explanations; they add up to one.
    means : ndarray, shape (k, m)
        Of the unknowns.
    covariances : ndarray, shape (k, m, m) or (m, m)
        Of each, or one of all.
    """
    mean = weights @ means
    apart = means - mean
    common = np.broadcast_to(covariances, (len(weights), *covariances.shape[-2:]))
    within = np.einsum("k,kij->ij", weights, common)
    return mean, np.asarray(within + (apart * weights[:, None]).T @ apart)
