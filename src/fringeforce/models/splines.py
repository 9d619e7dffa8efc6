"""Splines of fifth degree through even samples, as matrices."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from fringeforce.base.linear_map import LinearMap

Array = NDArray[np.float64]
Single = NDArray[np.float32]
DEGREE = 5
"""Degree of the splines through places, along which the influence of a load is smooth."""
KEPT = 32
"""Matrices of `basis` that are kept: all influences of the contacts of a frame ask for two."""


def coefficients(samples: Array) -> Array:
    """From values at the samples to coefficients of the spline through them, shape (n, n)."""
    return np.asarray(np.linalg.inv(basis(samples, samples)), dtype=np.float64)


def basis(samples: Array, points: Array) -> Array:
    """From coefficients to values at points between the samples, shape (len(points), n).

    It cannot be written to: all that ask for the same share it.
    """
    return _basis(np.asarray(samples, dtype=float).tobytes(), np.asarray(points, float).tobytes())


@lru_cache(maxsize=KEPT)
def _basis(samples: bytes, points: bytes) -> Array:
    at = np.frombuffer(samples)
    inside = np.clip(np.frombuffer(points), at[0], at[-1])
    found = BSpline.design_matrix(inside, _knots(at), DEGREE).toarray()
    found.setflags(write=False)
    return found


def _knots(samples: Array) -> Array:
    """Knots of the spline through values at samples, as SciPy's `make_interp_spline` has them.

    The samples next to the ends are none; SciPy says so only together with coefficients.
    """
    first, last = np.repeat(samples[[0, -1], None], DEGREE + 1, axis=1)
    beside = (DEGREE + 1) // 2
    return np.concatenate([first, samples[beside:-beside], last])


def slopes(samples: Array) -> Array:
    """From values at the samples to the spline's derivatives there, shape (n, n)."""
    knots = _knots(samples)
    derivatives = BSpline(knots, np.eye(len(samples)), DEGREE).derivative()(samples)
    return np.asarray(derivatives @ coefficients(samples), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Band(LinearMap):
    """A matrix from coefficients to values, of which each row has few neighbours that are not zero.

    Attributes
    ----------
    count : int
        Number of coefficients.
    first : ndarray of int, shape (m,)
        The first coefficient that is used, of every row.
    weights : ndarray, shape (m, DEGREE + 1)
        What it and the next add.
    """

    count: int
    first: NDArray[np.intp]
    weights: Single

    @classmethod
    def of(cls, samples: Array, points: Array) -> Band:
        """That of `basis`."""
        dense = basis(samples, points)
        first = np.minimum((dense != 0).argmax(axis=1), len(samples) - DEGREE - 1)
        weights = np.take_along_axis(dense, first[:, None] + np.arange(DEGREE + 1), axis=1)
        return cls(len(samples), first, weights.astype(np.float32))

    @property
    def shapes(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Shapes of a row of coefficients and of values; k of them, and c beside each other."""
        return (1, self.count, 1), (1, len(self.first), 1)

    def forward(self, values: Single) -> Single:
        """From coefficients, shape (k, count, c), to values, shape (k, m, c)."""
        found = np.empty((len(values), len(self.first), values.shape[2]), np.float32)
        _spread(values, self.first, self.weights, found)
        return found

    def adjoint(self, values: Single) -> Single:
        """From values to coefficients."""
        found = np.zeros((len(values), self.count, values.shape[2]), np.float32)
        _gather(values, self.first, self.weights, found)
        return found


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, nogil=True)
def _spread(coefficients, first, weights, values) -> None:
    for k in range(len(values)):
        for i in range(len(first)):
            values[k, i] = 0
            for j in range(weights.shape[1]):
                _add(values[k, i], weights[i, j], coefficients[k, first[i] + j])


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, nogil=True)
def _gather(values, first, weights, coefficients) -> None:
    for k in range(len(values)):
        for i in range(len(first)):
            for j in range(weights.shape[1]):
                _add(coefficients[k, first[i] + j], weights[i, j], values[k, i])


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, nogil=True)
def _add(target, share, source) -> None:
    for i in range(len(target)):
        target[i] += share * source[i]
