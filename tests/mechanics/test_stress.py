"""Stresses against the exact solution, at free surfaces, and against their own integral."""

from itertools import pairwise

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.mechanics import fourier
from fringeforce.mechanics.elasticity import Displacement, unit_displacements
from fringeforce.mechanics.mesh import strip_mesh
from fringeforce.mechanics.stress import integrated_stress, stress_field


def solved(sensor: ff.Sensor, **changes: str) -> Displacement:
    strip = sensor.replace(transducer=changes).transducer
    tactels = sensor.tactels.positions
    return unit_displacements(strip, tactels, strip_mesh(strip, tactels))


@pytest.mark.parametrize(("plane", "in_cover"), [("stress", 1e-3), ("strain", 0.03)])
def test_stresses_are_exact_below_the_cover_and_close_within(sensor, plane, in_cover) -> None:
    """The cover holds the singular loads; in plane strain it is nearly incompressible besides."""
    found = solved(sensor, edges="roller", plane=plane)
    x, z = np.linspace(-12e-3, 12e-3, 47), np.array([-0.25e-3, -0.4e-3, -0.8e-3, -2e-3, -3.3e-3])
    ours = stress_field(found, x, z)
    exact = fourier.stress_field(found.transducer, sensor.tactels.positions, x, z, terms=1500)
    for depth in range(len(z)):
        error = np.abs(ours[:, :, depth] - exact[:, :, depth]).max()
        allowed = in_cover if z[depth] > -0.5e-3 else 1e-4
        assert error < allowed * np.abs(exact[:, :, depth]).max()


def test_free_edges_carry_no_stress(sensor: ff.Sensor) -> None:
    found = solved(sensor, edges="free").superposed(ff.polar(1.0, 10, n=11))
    z = np.linspace(-3e-3, -0.8e-3, 12)
    field = stress_field(found, np.array([-12.5e-3, 0.0, 12.5e-3]), z)
    assert np.abs(field[[0, 2]][:, [0, 2]]).max() < 2e-3 * np.abs(field[[0, 2]][:, 1]).max()


@pytest.mark.parametrize(("plane", "factor"), [("stress", None), ("strain", 0.42)])
def test_the_integral_is_the_integral_of_the_field(sensor, plane, factor) -> None:
    found = solved(sensor, edges="free", plane=plane).superposed(ff.polar(1.0, 10, n=11))
    x, (gauss, weight) = np.linspace(-11e-3, 11e-3, 23), np.polynomial.legendre.leggauss(8)
    layer = found.mesh.z[found.mesh.z < -0.5e-3 + 1e-9]
    total = np.zeros(len(x))
    for low, high in pairwise(layer):
        inside = (low + high) / 2 + (high - low) / 2 * gauss
        sigma_x, sigma_z, _ = stress_field(found, x, inside)
        seen = sigma_x if factor is None else sigma_x - factor * (sigma_x + sigma_z)
        total += seen @ weight * (high - low) / 2
    np.testing.assert_allclose(integrated_stress(found, x), total, rtol=1e-7, atol=1e-6)
