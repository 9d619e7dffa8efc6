"""Splines nearest to samples, against NumPy's least squares of SciPy's B-splines."""

import numpy as np
from scipy.interpolate import BSpline

from fringeforce.models.node_splines import coefficients

NODES, SAMPLES = 37, 8 * 34 + 1


def test_coefficients_are_those_of_least_squares() -> None:
    values = np.random.default_rng(0).normal(size=(3, 2, SAMPLES))
    places = np.linspace(1, NODES - 2, SAMPLES)
    splines = BSpline.design_matrix(places, np.arange(-2.0, NODES + 2), 3).toarray()
    expected = np.linalg.lstsq(splines, values.reshape(6, -1).T)[0].T
    found = coefficients(values, NODES)
    np.testing.assert_allclose(found, expected.reshape(3, 2, NODES), atol=1e-12)
    assert coefficients(values[:0], NODES).shape == (0, 2, NODES)
