"""The exact solution against printed numbers, Flamant's half-plane and the laws of elasticity."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

import fringeforce as ff
from fringeforce.design.strip import Sensor, Transducer
from fringeforce.mechanics.fourier import integrated_stress, stress_field, stress_under_forces
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

Array = NDArray[np.float64]

# "Reference values" of docs/theory/errata.md: Case 2 of the design of Saad et al., Tables I and II,
# by an independent Fourier series of 1,500 terms.  x [mm], then rad/N for the centre tactel and the
# leftmost, normal and tangential, then the phase for 1 N at 10 degrees on all [rad].
TABLE = [
    (-12.5, -0.042818, +0.209988, -0.187091, +0.952413, -0.081923),
    (-7.5, -0.098373, +0.499384, -0.781578, +2.261451, -0.704301),
    (-5.0, -0.233821, +1.066723, +0.150011, +0.049519, -1.662716),
    (0.0, +0.159152, 0.0, -0.233821, -1.045694, -6.448162),
    (2.5, -0.761470, -2.160516, -0.094846, -0.472147, -7.505832),
    (5.0, -0.233821, -1.066723, -0.045712, -0.222273, -5.573922),
    (12.5, -0.042818, -0.209988, -0.009656, -0.046356, -1.301024),
]
STATES = ["stress", "strain"]


def _psi(sensor: Sensor, x: Array) -> Array:
    constant = stress_optic_constant(sensor.transducer.photoelastic, sensor.polariscope.wavelength)
    stress = integrated_stress(sensor.transducer, sensor.tactels.positions, x, terms=1500)
    return phase_lead(stress, constant)


def _strip(sensor: Sensor, plane: str) -> Transducer:
    return sensor.replace(**{"transducer.edges": "roller", "transducer.plane": plane}).transducer


@pytest.mark.parametrize("row", TABLE, ids=lambda row: f"x = {row[0]} mm")
def test_influence_and_phase_are_the_published_ones(sensor: Sensor, row: tuple) -> None:
    psi = _psi(sensor, np.array([row[0] * 1e-3]))[0]
    phase = (psi * ff.polar(1.0, 10, 11)).sum()
    found = [psi[5, 0], psi[5, 1], psi[0, 0], psi[0, 1], phase]
    np.testing.assert_allclose(found, row[1:], atol=0.51e-6, rtol=0)


@pytest.mark.parametrize("plane", STATES)
def test_stress_under_many_loads_is_the_sum_of_that_under_each(sensor: Sensor, plane: str) -> None:
    strip, rng = _strip(sensor, plane), np.random.default_rng(0)
    places, forces = rng.uniform(-1e-2, 1e-2, 30), rng.normal(size=(30, 2))
    x = np.linspace(-1.2e-2, 1.2e-2, 50)
    expected = np.einsum("mnc,nc->m", integrated_stress(strip, places, x), forces)
    found = stress_under_forces(strip, places, forces, x)
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


def test_the_phase_is_lowest_where_it_was_published(sensor: Sensor) -> None:
    """The values of the same series as the table's."""
    forces = ff.polar(1.0, 10, 11)
    lowest: Any = minimize_scalar(  # its result is not typed
        lambda mm: (_psi(sensor, np.array([mm * 1e-3])) * forces).sum(),
        bounds=(2.2, 2.8),
        options={"xatol": 1e-7},
    )
    assert lowest.fun == pytest.approx(-7.506630, abs=0.51e-6)
    assert lowest.x == pytest.approx(2.5113, abs=2e-4)


def test_the_influence_matrix_has_the_published_condition(sensor: Sensor) -> None:
    """The value of the same series as the table's, at the centres of 2,048 pixels."""
    psi = _psi(sensor, sensor.pixel_positions).reshape(2048, -1)
    assert np.linalg.cond(psi) == pytest.approx(121.75, abs=0.005)


@pytest.fixture(scope="module")
def half_plane(sensor: Sensor) -> Transducer:
    """One material, a metre deep and two long, under a cover of a millimetre."""
    layer = {"thickness": "1 mm", "youngs_modulus": "110 MPa", "poissons_ratio": 0.42}
    return sensor.replace(
        transducer={
            "length": "2 m",
            "width": "2 mm",
            "compliant": layer,
            "photoelastic": layer | {"thickness": "1 m"},
        }
    ).transducer


def _flamant(x: Array, z: Array) -> Array:
    """Stresses of unit line loads on a half-plane (Timoshenko and Goodier, sections 36 and 37)."""
    r4 = (x**2 + z**2) ** 2
    waves = np.array([[x**2, z**2, x * z], [x**2, z**2, x * z]])
    push, drag = 2 / np.pi * z / r4, -2 / np.pi * x / r4
    return waves * np.array([push, drag])[:, None]


def test_near_its_line_load_a_deep_strip_is_flamants_half_plane(half_plane: Transducer) -> None:
    angles = np.radians([-75, -50, -20, 10, 45, 70])
    errors = []
    for radius in (16e-3, 8e-3, 4e-3):  # points in the cover and below, much nearer than the base
        x, z = radius * np.sin(angles), -radius * np.cos(angles)
        grid = stress_field(half_plane, [0.0], x, z, terms=6000)[..., 0, :]
        found = np.array([grid[:, i, i] for i in range(len(x))]).transpose(2, 1, 0)
        exact = _flamant(x, z) / half_plane.width
        errors.append(np.linalg.norm(found - exact) / np.linalg.norm(exact))
    assert errors[-1] < 0.01
    # what the far boundaries add is finite, so beside 1/r it fades in proportion to r
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 2, rtol=0.05)


def test_the_depth_integral_beside_a_line_load_is_flamants(half_plane: Transducer) -> None:
    a, x = half_plane.compliant.thickness, np.array([2e-3, 5e-3, 10e-3, 20e-3])
    found = integrated_stress(half_plane, [0.0], np.append(0.0, x), terms=8000)[:, 0]
    step = (found[1:] - found[0]) * half_plane.width  # without what the far base adds everywhere
    push = -1 / np.pi * x**2 / (x**2 + a**2)  # far from the load, but near beside the depth: -P/pi
    drag = (np.arctan(a / x) + x * a / (x**2 + a**2)) / np.pi - 0.5
    np.testing.assert_allclose(step[:, 0], push, rtol=2e-3)
    np.testing.assert_allclose(step[:, 1], drag, rtol=3e-2)


@pytest.mark.parametrize("plane", STATES)
def test_stresses_are_in_equilibrium_and_compatible(sensor: Sensor, plane: str) -> None:
    strip, h = _strip(sensor, plane), 1e-6
    for depth in (-0.35e-3, -1.4e-3):
        x = np.array([0.7e-3, -3.3e-3])
        around = [
            stress_field(strip, sensor.tactels.positions, x + i * h, [depth + j * h], terms=800)
            for i, j in ((1, 0), (-1, 0), (0, 1), (0, -1), (0, 0))
        ]
        east, west, up, down, here = np.array(around)[:, :, :, 0]
        along_x, along_z = (east - west) / (2 * h), (up - down) / (2 * h)
        scale = np.abs(along_x).max()
        np.testing.assert_allclose(along_x[0] + along_z[2], 0, atol=1e-4 * scale)
        np.testing.assert_allclose(along_x[2] + along_z[1], 0, atol=1e-4 * scale)
        # without body forces the mean stress is harmonic, in either plane state
        curvature = (east + west + up + down - 4 * here) / h**2
        bend = np.abs((up + down - 2 * here) / h**2).max()
        np.testing.assert_allclose(curvature[0] + curvature[1], 0, atol=1e-3 * bend)


def test_every_level_carries_the_whole_push(sensor: Sensor) -> None:
    strip = _strip(sensor, "stress")
    x = ((np.arange(2000) + 0.5) / 2000 - 0.5) * strip.length
    sigma_z = stress_field(strip, [0.0, 3e-3], x, [-0.3e-3, -1e-3, -3.5e-3])[1]
    carried = sigma_z.mean(axis=0) * strip.length * strip.width
    np.testing.assert_allclose(carried[..., 0], -1, rtol=1e-10)
    np.testing.assert_allclose(carried[..., 1], 0, atol=1e-10)


def test_the_mean_pressure_is_squeezed_sideways_by_poissons_ratio(sensor: Sensor) -> None:
    x = ((np.arange(2000) + 0.5) / 2000 - 0.5) * 25e-3
    for plane, expected in (("stress", -0.42 * 3e-3 / (25e-3 * 2e-3)), ("strain", 0.0)):
        mean = integrated_stress(_strip(sensor, plane), [1e-3], x).mean(axis=0)
        np.testing.assert_allclose(mean[0], [expected, 0], atol=1e-9)


@pytest.mark.parametrize("plane", STATES)
def test_tractions_and_stretch_cross_the_interface_unbroken(sensor: Sensor, plane: str) -> None:
    strip = _strip(sensor, plane)
    soft, clear = strip.compliant, strip.photoelastic
    x = np.linspace(-12.5e-3, 12.5e-3, 41)
    z = -soft.thickness * np.array([1 - 1e-9, 1.0])
    field = stress_field(strip, sensor.tactels.positions, x, z)
    above, below = field[:, :, 0], field[:, :, 1]
    scale = np.abs(field).max()
    np.testing.assert_allclose(above[1:], below[1:], atol=1e-6 * scale)
    assert np.abs(above[0] - below[0]).max() > 0.1 * scale

    def stretch(stress: Array, nu: float, e: float) -> Array:
        ratio, modulus = (nu, e) if plane == "stress" else (nu / (1 - nu), e / (1 - nu**2))
        return (stress[0] - ratio * stress[1]) / modulus

    upper = stretch(above, soft.poissons_ratio, soft.youngs_modulus)
    lower = stretch(below, clear.poissons_ratio, clear.youngs_modulus)
    np.testing.assert_allclose(upper, lower, atol=1e-6 * np.abs(lower).max())


def test_the_bonded_base_does_not_stretch(sensor: Sensor) -> None:
    x = np.linspace(-12.5e-3, 12.5e-3, 41)
    for plane, ratio in (("stress", 0.42), ("strain", 0.42 / 0.58)):
        field = stress_field(_strip(sensor, plane), sensor.tactels.positions, x, [-3.5e-3])
        np.testing.assert_allclose(field[0], ratio * field[1], atol=1e-8 * np.abs(field).max())


@pytest.mark.parametrize("plane", STATES)
def test_the_integral_is_that_of_the_stresses(sensor: Sensor, plane: str) -> None:
    strip = _strip(sensor, plane)
    points, weights = np.polynomial.legendre.leggauss(40)
    x, z = np.linspace(-12.5e-3, 12.5e-3, 33), -0.5e-3 + 3e-3 * (points - 1) / 2
    sigma_x, sigma_z, _ = stress_field(strip, sensor.tactels.positions, x, z)
    sigma_y = 0.42 * (sigma_x + sigma_z) if plane == "strain" else 0.0
    expected = np.einsum("q,xq...->x...", 1.5e-3 * weights, sigma_x - sigma_y)
    found = integrated_stress(strip, sensor.tactels.positions, x)
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())
