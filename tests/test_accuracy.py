"""The promise of the default mesh: every column of psi within 1e-4, for all designs."""

import numpy as np
import pytest
from numpy.typing import NDArray

import fringeforce as ff
from fringeforce.design.shipped import shipped_designs
from fringeforce.mechanics import fourier
from fringeforce.mechanics.mesh import Mesh, strip_mesh
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

pytestmark = pytest.mark.slow

Array = NDArray[np.float64]
PROMISE = 1e-4
EXTRA = {
    "four tactels": {"tactels.count": 4},
    "plane strain": {"transducer.plane": "strain"},
    "nearly incompressible, plane strain": {
        "transducer.plane": "strain",
        "transducer.photoelastic.poissons_ratio": 0.49,
    },
}
NAMES = [*(name for name in shipped_designs() if ff.load_sensor(name).skin is None), *EXTRA]


def _design(name: str) -> ff.Sensor:
    return ff.load_sensor("saad").replace(**EXTRA[name]) if name in EXTRA else ff.load_sensor(name)


def _worst_column(found: Array, reference: Array) -> float:
    """Largest relative L2 error over the 2 n columns."""
    return float(
        (np.linalg.norm(found - reference, axis=0) / np.linalg.norm(reference, axis=0)).max()
    )


def _graded(breaks: Array, marks: list[float]) -> Array:
    """Boundaries with three more on either side of each mark, ever closer to it."""
    more = list(breaks)
    for mark in marks:
        i = int(np.abs(breaks - mark).argmin())
        for j in (i - 1, i + 1):
            if 0 <= j < len(breaks):
                more += [breaks[i] + (breaks[j] - breaks[i]) * 0.15**k for k in range(1, 4)]
    return np.unique(more)


@pytest.mark.parametrize("name", NAMES)
def test_roller_edges_meet_the_exact_solution(name: str) -> None:
    sensor = _design(name).replace(**{"transducer.edges": "roller"})
    strip, x = sensor.transducer, sensor.pixel_positions
    constant = stress_optic_constant(strip.photoelastic, sensor.polariscope.wavelength)
    stress = fourier.integrated_stress(strip, sensor.tactels.positions, x, terms=800)
    exact = phase_lead(stress, constant)
    assert _worst_column(ff.characterize(sensor).influence(x), exact) < PROMISE


@pytest.mark.parametrize("name", NAMES)
def test_free_edges_meet_a_reference_of_higher_order_and_finer_corners(name: str) -> None:
    sensor = _design(name)
    strip, x = sensor.transducer, sensor.pixel_positions
    assert strip.edges == "free"
    half, a = strip.length / 2, strip.compliant.thickness
    mesh = strip_mesh(strip, sensor.tactels.positions)
    corners = [-a - strip.photoelastic.thickness, -a]
    fine = Mesh(_graded(mesh.x, [-half, half]), _graded(mesh.z, corners), order=9)
    reference = ff.characterize(sensor, fine).influence(x)
    assert _worst_column(ff.characterize(sensor).influence(x), reference) < PROMISE


def test_case_1_has_its_published_phase(model: ff.SensorModel) -> None:
    """Of the design of Saad et al. with free edges, by independent finite elements."""
    x = np.linspace(-12.5e-3, 12.5e-3, 5001)
    phase = model.phase(ff.polar(1.0, 10, 11), x)
    np.testing.assert_allclose(phase[[0, -1]], 0, atol=5e-3)
    assert phase.min() == pytest.approx(-7.4358, abs=1e-4)
    assert x[phase.argmin()] == pytest.approx(1.53e-3, abs=0.01e-3)


def test_case_2_has_its_published_phase(roller_model: ff.SensorModel) -> None:
    """The last column of "Reference values" in docs/theory/errata.md, an exact Fourier series."""
    x = np.array([-12.5, -7.5, -5.0, 0.0, 2.5, 5.0, 12.5]) * 1e-3
    published = [-0.081923, -0.704301, -1.662716, -6.448162, -7.505832, -5.573922, -1.301024]
    phase = roller_model.phase(ff.polar(1.0, 10, 11), x)
    np.testing.assert_allclose(phase, published, atol=2e-4)


def test_figure_7_has_its_peaks(model: ff.SensorModel) -> None:
    """The loads of Figure 7 of Saad et al.; the peaks by independent finite elements."""
    x = np.linspace(-12.5e-3, 12.5e-3, 5001)
    first = model.influence(x)[:, 0] * [0.4, 0.2]  # N on the leftmost tactel
    np.testing.assert_allclose(np.abs(first).max(axis=0), [0.48, 0.48], atol=0.005)
    assert np.abs(x[np.abs(first).argmax(axis=0)] + 5e-3).max() < 2e-3
