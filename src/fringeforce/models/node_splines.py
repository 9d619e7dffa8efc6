"""Cubic B-splines on the nodes of a `FrameModel`, nearest to samples in the least-squares sense."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky_banded
from scipy.sparse import csr_array

from fringeforce.estimation.compiling import sums_entry
from fringeforce.estimation.frame_model import node_weights

Array = NDArray[np.float64]


def coefficients(values: Array, count: int) -> Array:
    """Coefficients of the splines nearest to values at samples.

    Parameters
    ----------
    values : ndarray, shape (..., s)
        At evenly spaced places from the second node to the last but one.
    count : int
        Number of nodes m.

    Returns
    -------
    ndarray, shape (..., m)
    """
    samples = values.shape[-1]
    # a column for each profile; samples come first where a spline was evaluated at them
    columns = np.moveaxis(values, -1, 0).reshape(samples, -1)
    return fitted(sampled(samples, count) @ columns, samples).reshape(*values.shape[:-1], count)


def fitted(sides: Array, samples: int) -> Array:
    """Coefficients of splines from the right-hand sides of their normal equations.

    Parameters
    ----------
    sides : ndarray, shape (m, c)
        `sampled` times values at samples; overwritten.
    samples : int
        Number of samples.

    Returns
    -------
    ndarray, shape (c, m)
    """
    _substitute(_factor(samples, len(sides)), sides)
    return np.ascontiguousarray(sides.T)


@cache
def sampled(samples: int, count: int) -> csr_array:
    """Values of each node's spline at so many samples, which are few, shape (m, s)."""
    first, weights = node_weights(np.linspace(1, count - 2, samples), count)
    nodes = first[:, None] + np.arange(4)
    places = np.repeat(np.arange(samples), 4)
    return csr_array((weights.ravel(), (nodes.ravel(), places)), shape=(count, samples))


@cache
def _factor(samples: int, count: int) -> Array:
    """Lower Cholesky factor of the normal equations by its bands, shape (4, m)."""
    splines = sampled(samples, count)
    gram = splines @ splines.T
    bands = np.zeros((4, count))
    for k in range(4):
        bands[k, : count - k] = gram.diagonal(-k)
    return np.asarray(cholesky_banded(bands, lower=True))


@sums_entry
def _substitute(factor, sides):
    """Solve with a banded Cholesky factor in place, all columns side by side.

    LAPACK takes one column after the other, ten times as long.
    """
    width, size = factor.shape
    for i in range(size):
        own = sides[i]
        for k in range(1, min(width, i + 1)):
            share, other = factor[k, i - k], sides[i - k]
            for c in range(len(own)):
                own[c] -= share * other[c]
        for c in range(len(own)):
            own[c] /= factor[0, i]
    for i in range(size - 1, -1, -1):
        own = sides[i]
        for k in range(1, min(width, size - i)):
            share, other = factor[k, i], sides[i + k]
            for c in range(len(own)):
                own[c] -= share * other[c]
        for c in range(len(own)):
            own[c] /= factor[0, i]
