"""The exact solution against printed values, Flamant's line load and equilibrium."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.mechanics import fourier
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

# x [mm], then psi [rad/N] of tactel 6 (N, T) and tactel 1 (N, T) and p [rad] for 1 N at 10 degrees
# on all: the paper's design between rollers, from an independent solution with 1500 terms
TABLE = np.array(
    [
        [-12.5, -0.042818, 0.209988, -0.187091, 0.952413, -0.081923],
        [-7.5, -0.098373, 0.499384, -0.781578, 2.261451, -0.704301],
        [-5.0, -0.233821, 1.066723, 0.150011, 0.049519, -1.662716],
        [0.0, 0.159152, 0.0, -0.233821, -1.045694, -6.448162],
        [2.5, -0.761470, -2.160516, -0.094846, -0.472147, -7.505832],
        [5.0, -0.233821, -1.066723, -0.045712, -0.222273, -5.573922],
        [12.5, -0.042818, -0.209988, -0.009656, -0.046356, -1.301024],
    ]
)


def psi(sensor: ff.Sensor, x: np.ndarray) -> np.ndarray:
    strip, tactels = sensor.transducer, sensor.tactels.positions
    constant = stress_optic_constant(strip.photoelastic, sensor.polariscope.wavelength)
    return phase_lead(fourier.integrated_stress(strip, tactels, x, terms=1500), constant)


def test_the_influence_matrix_has_its_reference_values(sensor: ff.Sensor) -> None:
    matrix = psi(sensor, TABLE[:, 0] * 1e-3)
    found = np.stack([matrix[:, 0, 5], matrix[:, 1, 5], matrix[:, 0, 0], matrix[:, 1, 0]], axis=1)
    np.testing.assert_allclose(found, TABLE[:, 1:5], atol=6e-7)
    load = ff.polar(1.0, 10, n=11)
    np.testing.assert_allclose(np.tensordot(matrix, load, 2), TABLE[:, 5], atol=6e-7)


def test_the_lowest_phase_is_where_it_should_be(sensor: ff.Sensor) -> None:
    x = np.linspace(2.4e-3, 2.6e-3, 2001)
    phase = np.tensordot(psi(sensor, x), ff.polar(1.0, 10, n=11), 2)
    assert phase.min() == pytest.approx(-7.506630, abs=2e-6)
    assert x[phase.argmin()] == pytest.approx(2.5113e-3, abs=1e-7)


def test_the_condition_number_on_the_pixels(sensor: ff.Sensor) -> None:
    matrix = psi(sensor, sensor.pixel_positions).reshape(2048, -1)
    assert np.linalg.cond(matrix) == pytest.approx(121.75, abs=0.01)


def thick_strip(sensor: ff.Sensor) -> ff.Sensor:
    """One material, so long and deep that it is nearly a half-plane."""
    same = {"youngs_modulus": 1e7, "poissons_ratio": 0.3}
    return sensor.replace(
        transducer={
            "length": 1.0,
            "width": 1.0,
            "compliant": {"thickness": 2e-3, **same},
            "photoelastic": {"thickness": 0.5, **same},
        }
    )


def test_stresses_under_a_line_load_are_flamants(sensor: ff.Sensor) -> None:
    strip = thick_strip(sensor).transducer
    x, z = np.array([-4e-3, 3e-3]), np.array([-3e-3, -6e-3])
    field = fourier.stress_field(strip, [0.0], x, z, terms=6000)[..., 0]
    px, pz = x[:, None], -z[None]
    squared = px**2 + pz**2
    pressing = -2 / (np.pi * squared**2) * np.array([px**2 * pz, pz**3 + 0 * px, -px * pz**2])
    dragging = -2 / (np.pi * squared**2) * np.array([px**3 + 0 * pz, px * pz**2, -(px**2) * pz])
    for found, exact in ((field[..., 0], pressing), (field[..., 1], dragging)):
        np.testing.assert_allclose(found, exact, atol=0.02 * np.abs(exact).max())


def test_the_depth_integral_under_a_line_load_is_flamants(sensor: ff.Sensor) -> None:
    """All depths carry -P/pi for every x; below the depth a it is x^2/(x^2 + a^2) of that.

    The distant walls add a pressure that is the same for all x nearby, so differences are compared.
    """
    strip = thick_strip(sensor).transducer
    x = np.array([5e-3, -10e-3])
    found = fourier.integrated_stress(strip, [0.0], x, terms=6000)[:, 0, 0]
    below = x**2 / (x**2 + strip.compliant.thickness**2)
    assert found[0] - found[1] == pytest.approx((below[1] - below[0]) / np.pi, rel=0.01)


def test_layers_pull_equally_on_each_other(sensor: ff.Sensor) -> None:
    strip, x = sensor.transducer, np.linspace(-0.01, 0.01, 7)
    a = strip.compliant.thickness
    field = fourier.stress_field(strip, [1e-3], x, np.array([-a * (1 - 1e-9), -a * (1 + 1e-9)]))
    np.testing.assert_allclose(field[1:, :, 0], field[1:, :, 1], rtol=1e-5, atol=1e-3)


def test_the_base_carries_the_load(sensor: ff.Sensor) -> None:
    strip, half = sensor.transducer, sensor.transducer.length / 2
    x = np.linspace(-half, half, 2001)
    base = np.array([-strip.compliant.thickness - strip.photoelastic.thickness])
    field = fourier.stress_field(strip, [2e-3], x, base)[..., 0]
    pressure = strip.width * np.trapezoid(field[1, :, 0, 0], x)
    assert pressure == pytest.approx(-1.0, abs=1e-6)
