"""Stresses against the exact solution, the free edge's own law, and their own integral."""

import numpy as np
import pytest
from numpy.typing import NDArray

import fringeforce as ff
from fringeforce.mechanics import fourier
from fringeforce.mechanics.elasticity import Displacement, unit_displacements
from fringeforce.mechanics.mesh import strip_mesh
from fringeforce.mechanics.stress import integrated_stress, stress_field

Array = NDArray[np.float64]
X = np.linspace(-12.5e-3, 12.5e-3, 121)
CLEAR = np.linspace(-3.5e-3, -0.5e-3, 16)
COVER = np.linspace(-0.4999e-3, -0.15e-3, 9)


def _solved(sensor: ff.Sensor, edges: str, plane: str, order: int = 7) -> Displacement:
    strip = sensor.replace(**{"transducer.edges": edges, "transducer.plane": plane}).transducer
    tactels = sensor.tactels.positions
    return unit_displacements(strip, tactels, strip_mesh(strip, tactels, order))


def _errors(found: Array, exact: Array) -> Array:
    """Relative L2 errors of sigma_x, sigma_z and tau_xz over all places and loads."""
    found, exact = found.reshape(3, -1), exact.reshape(3, -1)
    return np.linalg.norm(found - exact, axis=1) / np.linalg.norm(exact, axis=1)


@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize(
    ("z", "tolerance"), [(CLEAR, 3e-4), (COVER, 1e-2)], ids=["photoelastic layer", "cover"]
)
def test_stresses_between_rollers_are_the_exact_ones(
    sensor: ff.Sensor, plane: str, z: Array, tolerance: float
) -> None:
    if plane == "strain":  # at 0.49 the cover's pressure is too stiff for a sharp comparison
        sensor = sensor.replace(**{"transducer.compliant.poissons_ratio": 0.4})
    tactels, coarse = sensor.tactels.positions, _solved(sensor, "roller", plane)
    fine = _solved(sensor, "roller", plane, order=9)
    exact = fourier.stress_field(coarse.transducer, tactels, X, z, terms=1000)
    errors = _errors(stress_field(coarse, X, z), exact)
    assert (errors < tolerance).all(), errors
    assert (_errors(stress_field(fine, X, z), exact) < 0.75 * errors).all()


@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_nothing_pulls_at_a_free_edge(sensor: ff.Sensor, plane: str) -> None:
    displacement = _solved(sensor, "free", plane).superposed(ff.polar(1.0, 10, 11))
    z = np.concatenate([np.linspace(-3.2e-3, -0.8e-3, 25), np.linspace(-0.4e-3, -0.1e-3, 7)])
    inside = np.abs(stress_field(displacement, X[30:90], z)).max(axis=(1, 2))
    edge = np.abs(stress_field(displacement, X[[0, -1]], z)).max(axis=(1, 2))
    assert edge[0] < 3e-4 * inside[0]
    assert edge[2] < 3e-4 * inside[2]


def test_a_roller_edge_feels_a_push_but_no_shear(sensor: ff.Sensor) -> None:
    displacement = _solved(sensor, "roller", "stress").superposed(ff.polar(1.0, 10, 11))
    inside = np.abs(stress_field(displacement, X[30:90], CLEAR)).max(axis=(1, 2))
    edge = np.abs(stress_field(displacement, X[[0, -1]], CLEAR)).max(axis=(1, 2))
    assert edge[0] > 1e-3 * inside[0]
    assert edge[2] < 1e-5 * inside[2]


@pytest.mark.parametrize("edges", ["free", "roller"])
@pytest.mark.parametrize("plane", ["stress", "strain"])
def test_the_light_sees_the_depth_integral_of_the_stress_difference(
    sensor: ff.Sensor, edges: str, plane: str
) -> None:
    displacement = _solved(sensor, edges, plane)
    z = displacement.mesh.z
    z = z[z < -0.4999e-3]
    points, weights = np.polynomial.legendre.leggauss(8)  # exact for the elements' polynomials
    heights = (z[:-1, None] + np.diff(z)[:, None] * (points + 1) / 2).ravel()
    sigma_x, sigma_z, _ = stress_field(displacement, X, heights)
    sigma_y = 0.42 * (sigma_x + sigma_z) if plane == "strain" else 0.0
    quadrature = (np.diff(z)[:, None] * weights / 2).ravel()
    expected = np.einsum("q,xq...->x...", quadrature, sigma_x - sigma_y)
    found = integrated_stress(displacement, X)
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_plane_strain_is_plane_stress_of_a_stiffer_material(sensor: ff.Sensor) -> None:
    nu = {"transducer.compliant.poissons_ratio": 0.3, "transducer.photoelastic.poissons_ratio": 0.2}
    stiffer = {
        "transducer.compliant.poissons_ratio": 0.3 / 0.7,
        "transducer.photoelastic.poissons_ratio": 0.2 / 0.8,
        "transducer.compliant.youngs_modulus": 11e6 / (1 - 0.3**2),
        "transducer.photoelastic.youngs_modulus": 110e6 / (1 - 0.2**2),
    }
    strain = stress_field(_solved(sensor.replace(**nu), "free", "strain"), X, CLEAR)
    stress = stress_field(_solved(sensor.replace(**stiffer), "free", "stress"), X, CLEAR)
    np.testing.assert_allclose(strain, stress, atol=1e-9 * np.abs(stress).max())


def test_superposed_unit_forces_are_the_load(sensor: ff.Sensor) -> None:
    displacement = _solved(sensor, "free", "stress")
    forces = np.random.default_rng(3).normal(size=(11, 2))
    unit = stress_field(displacement, X, CLEAR)
    assert unit.shape == (3, len(X), len(CLEAR), 11, 2)
    found = stress_field(displacement.superposed(forces), X, CLEAR)
    expected = np.einsum("smqnd,nd->smq", unit, forces)
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())


def test_under_a_push_the_clear_layer_is_compressed(sensor: ff.Sensor) -> None:
    sigma_z = stress_field(_solved(sensor, "free", "stress"), [0.0], CLEAR)[1]
    assert (sigma_z[0, :, 5, 0] < 0).all()
