"""Phase of contacts as cubics along the strip, against SciPy's splines."""

import numpy as np
from scipy.interpolate import CubicSpline

from fringeforce.calibration.contact_phase import _cubics


def test_cubics_on_an_even_grid_are_those_of_scipy() -> None:
    grid = np.linspace(-2e-3, 3e-3, 31)
    values = np.random.default_rng(0).normal(size=(3, 31, 2, 4))
    found = _cubics(grid, values)
    for one, cubics in zip(values, found, strict=True):
        expected = CubicSpline(grid, one).c
        for power, coefficients in enumerate(expected):
            scale = np.abs(coefficients).max()
            np.testing.assert_allclose(cubics[power], coefficients, rtol=0, atol=1e-10 * scale)
