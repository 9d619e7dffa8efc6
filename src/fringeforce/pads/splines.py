"""Splines of fifth degree through even samples, as matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline

Array = NDArray[np.float64]
DEGREE = 5


def coefficients(samples: Array) -> Array:
    """From values at the samples to coefficients of the spline through them, shape (n, n)."""
    return np.asarray(np.linalg.inv(basis(samples, samples)), dtype=np.float64)


def basis(samples: Array, points: Array) -> Array:
    """From coefficients to values at points between the samples, shape (len(points), n)."""
    knots = make_interp_spline(samples, np.zeros(len(samples)), DEGREE).t
    inside = np.clip(points, samples[0], samples[-1])
    return BSpline.design_matrix(inside, knots, DEGREE).toarray()
