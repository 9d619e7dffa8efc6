"""The default mesh keeps its promise: every column of psi to 1e-4, on every design."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.design import shipped_designs
from fringeforce.mechanics import fourier, mesh
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant
from fringeforce.reproduction import relative_error

FOUR = {"tactels.count": 4, "tactels.pitch": "2.7 mm"}
NEARLY_INCOMPRESSIBLE = {
    "transducer.plane": "strain",
    "transducer.compliant.poissons_ratio": 0.49,
    "transducer.photoelastic.poissons_ratio": 0.49,
}
VARIANTS = {"four tactels": FOUR, "plane strain at 0.49": NEARLY_INCOMPRESSIBLE}
DESIGNS = [*sorted(shipped_designs()), *VARIANTS]


def design(name: str, edges: str) -> ff.Sensor:
    sensor = ff.load_sensor("saad").replace(**VARIANTS[name]) if name in VARIANTS else None
    return (sensor or ff.load_sensor(name)).replace(**{"transducer.edges": edges})


@pytest.mark.parametrize("name", DESIGNS)
def test_between_rollers_psi_is_exact_to_1e_4(name: str) -> None:
    sensor = design(name, "roller")
    strip, x = sensor.transducer, sensor.pixel_positions
    constant = stress_optic_constant(strip.photoelastic, sensor.polariscope.wavelength)
    exact = fourier.integrated_stress(strip, sensor.tactels.positions, x, terms=1500)
    found = ff.characterize(sensor).pixel_influence
    assert relative_error(found, phase_lead(exact, constant)) < 1e-4


@pytest.mark.parametrize("name", DESIGNS)
def test_with_free_edges_psi_is_converged_to_1e_4(name, monkeypatch) -> None:
    sensor = design(name, "free")
    found = ff.characterize(sensor).pixel_influence
    finer = {"CORNER": 1e-5, "LOAD_X": 0.7, "LOAD_Z": 0.15, "LARGEST": 0.6}
    for constant, value in finer.items():
        monkeypatch.setattr(mesh, constant, value)
    fine = mesh.strip_mesh(sensor.transducer, sensor.tactels.positions, order=10)
    reference = ff.characterize(sensor, fine)
    assert relative_error(found, reference.pixel_influence) < 1e-4


def test_case_1_has_its_reference_values(model: ff.SensorModel) -> None:
    x = np.linspace(-12.5e-3, 12.5e-3, 5001)
    phase = model.phase(ff.polar(1.0, 10, n=11), x)
    assert np.abs(phase[[0, -1]]).max() < 2e-3
    assert phase.min() == pytest.approx(-7.4358, abs=2e-4)
    assert x[phase.argmin()] == pytest.approx(1.53e-3, abs=1e-5)
    psi = model.influence(x)
    assert 0.4 * np.abs(psi[:, 0, 0]).max() == pytest.approx(0.48, abs=0.005)
    assert 0.2 * np.abs(psi[:, 1, 0]).max() == pytest.approx(0.48, abs=0.005)


def test_the_cases_differ_at_the_edges_and_not_in_the_middle(model, roller_model) -> None:
    load = ff.polar(1.0, 10, n=11)
    free, roller = model.phase(load), roller_model.phase(load)
    assert abs(free[-1] - roller[-1]) > 1.0
    assert abs(free[1024] - roller[1024]) < 0.05
