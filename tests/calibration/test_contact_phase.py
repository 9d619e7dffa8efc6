"""Phase of contacts as cubics along the strip, against SciPy's splines."""

import numpy as np
from scipy.interpolate import CubicSpline, PPoly

import fringeforce as ff
from fringeforce.calibration.bench_expectation import contact_size
from fringeforce.calibration.bench_loads import bench_loads
from fringeforce.calibration.calibrate import PARAMETERS
from fringeforce.calibration.contact_phase import _cubics, contact_phases
from fringeforce.models.node_splines import coefficients


def test_cubics_on_an_even_grid_are_those_of_scipy() -> None:
    grid = np.linspace(-2e-3, 3e-3, 31)
    values = np.random.default_rng(0).normal(size=(3, 31, 2, 4))
    found = _cubics(grid, values)
    for one, cubics in zip(values, found, strict=True):
        expected = CubicSpline(grid, one).c
        for power, row in enumerate(expected):
            scale = np.abs(row).max()
            np.testing.assert_allclose(cubics[power], row, rtol=0, atol=1e-10 * scale)


def test_phases_and_their_slopes_are_those_of_scipy_and_go_on_as_tangents(
    sensor: ff.Sensor,
) -> None:
    paths = tuple(PARAMETERS)
    places, design = np.array([-2e-3, 1e-3]), np.array([0.02, -0.01, 0.03])
    size = contact_size(sensor, bench_loads(places, np.ones((2, 2))))
    contacts = contact_phases(sensor, paths, np.zeros(3), places, size, 0.1)
    drawn = np.linspace(-1.01, 1.01, 8 * 250 + 1) * contacts.half
    x = 0.2e-3 + 1.01 * drawn
    near = np.clip(x, -contacts.half, contacts.half)

    def along(lead: np.ndarray) -> np.ndarray:
        cubics = PPoly(lead, contacts.grid)
        return cubics(near) + (x - near)[:, None, None, None] * cubics(near, 1)

    weights = np.concatenate([[1.0], design, design**2])
    lead = np.tensordot(weights, contacts.lead, 1)
    moved = PPoly(lead, contacts.grid)(near, 1)
    changes = [along(contacts.lead[1 + i] + 2 * design[i] * contacts.lead[4 + i]) for i in range(3)]
    changes += [moved, moved * drawn[:, None, None, None]]
    expected = [coefficients(np.moveaxis(change, 0, -1), 253) for change in (along(lead), *changes)]
    found = [
        contacts.profiles(design, x, 253),
        *contacts.slopes(design, x, drawn, 253),
    ]
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12 * np.abs(other).max())
