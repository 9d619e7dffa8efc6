"""Large strain against closed forms, finite differences and the linear solution."""

from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.mechanics.finite_strain import FiniteStrip, finite_strip
from fringeforce.mechanics.hyperelasticity import Hyperelastic
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

Array = NDArray[np.float64]
Plane = Literal["stress", "strain"]
BULK = 80e6
MATERIALS = {
    "neo-Hookean": Hyperelastic((0.5e6,), BULK),
    "Mooney-Rivlin": Hyperelastic((0.4e6,), BULK, second=0.15e6),
    "Yeoh": Hyperelastic((0.5e6, -0.05e6, 0.02e6), BULK),
}
named = pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)
planes = pytest.mark.parametrize("plane", ["stress", "strain"])
ROTATION = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])


@named
@planes
def test_a_rotation_causes_no_stress(material: Hyperelastic, plane: Plane) -> None:
    found = material.plane(ROTATION, plane)
    np.testing.assert_allclose(found.stress, 0, atol=1e-7 * BULK)
    assert found.energy == pytest.approx(0, abs=1e-7 * BULK)


@named
@pytest.mark.parametrize("stretch", [0.7, 1.0, 1.6])
def test_uniaxial_stretch_is_that_of_the_textbook(material: Hyperelastic, stretch: float) -> None:
    incompressible = replace(material, bulk=1e4 * BULK)

    def pulled(other: float) -> float:
        return float(incompressible.plane(np.diag([stretch, other]), "stress").stress[1, 1])

    other: Any = brentq(pulled, 0.9 / np.sqrt(stretch), 1.1 / np.sqrt(stretch), xtol=1e-15)
    first, second = stretch**2 + 2 / stretch, 2 * stretch + stretch**-2
    assert second > 2.9
    rise = sum(i * c * (first - 3) ** (i - 1) for i, c in enumerate(material.coefficients, start=1))
    # Treloar: P = 2 (stretch - 1 / stretch^2) (dW/dI1 + dW/dI2 / stretch)
    expected = 2 * (stretch - stretch**-2) * (rise + material.second / stretch)
    found = incompressible.plane(np.diag([stretch, other]), "stress").stress[0, 0]
    assert found == pytest.approx(expected, rel=1e-4, abs=1.0)


@named
@planes
def test_stress_and_tangent_are_derivatives_of_the_energy(
    material: Hyperelastic, plane: Plane
) -> None:
    gradient = np.array([[1.2, 0.3], [-0.1, 0.8]])
    found, step = material.plane(gradient, plane), 1e-6
    for i, k in np.ndindex(2, 2):
        change = np.zeros((2, 2))
        change[i, k] = step
        up, down = (material.plane(gradient + s * change, plane) for s in (1, -1))
        slope = (up.energy - down.energy) / (2 * step)
        assert slope == pytest.approx(found.stress[i, k], rel=1e-6, abs=10)
        curve = (up.stress - down.stress) / (2 * step)
        np.testing.assert_allclose(curve, found.tangent[i, k], rtol=1e-6, atol=1e-6 * BULK)


def _strip(sensor: ff.Sensor, order: int = 5, **changes: str) -> FiniteStrip:
    paths = {f"transducer.{key}": value for key, value in changes.items()}
    transducer = sensor.replace(**paths).transducer
    return finite_strip(transducer, [-1e-3, 2e-3], [5e-4, 5e-4], order=order)


def test_a_homogeneous_stretch_is_carried_exactly(sensor: ff.Sensor) -> None:
    strip = _strip(sensor, order=3)
    one = replace(strip, compliant=strip.photoelastic)
    gradient = np.array([[0.95, 0.04], [-0.03, 1.02]])
    state = np.zeros(strip.shape)
    vertices = np.ix_([0, 1], range(0, strip.shape[1], 3), range(0, strip.shape[2], 3))
    places = np.array(np.meshgrid(one.mesh.x, one.mesh.z, indexing="ij"))
    state[vertices] = np.tensordot(gradient - np.eye(2), places, axes=1)
    found = one.gradients(state)
    assert np.abs(found - gradient[:, :, None, None]).max() < 1e-12
    forces = one.internal_forces(state)
    inside = forces[:, 1:-1, 1:-1]
    assert np.abs(inside).max() < 1e-10 * np.abs(forces).max()
    # Cauchy's stress and the height of the stretched layer in closed form
    flat = one.photoelastic.plane(gradient, "stress")
    cauchy = flat.stress @ gradient.T / (np.linalg.det(gradient) * flat.across)
    height = 3e-3 * np.linalg.det(gradient) / gradient[0, 0]
    seen = one.integrated_stress(state, [0.0, 3.3e-3])
    np.testing.assert_allclose(seen, cauchy[0, 0] * height, rtol=1e-9)


@planes
def test_internal_forces_are_the_gradient_of_the_energy(sensor: ff.Sensor, plane: Plane) -> None:
    strip = _strip(sensor, order=3, plane=plane)
    state = strip.solved([[0.8, 0.2], [0.5, -0.1]])
    way = np.random.default_rng(0).standard_normal(state.shape) * np.abs(state).max() / 10
    step = 1e-4
    slope = (strip.energy(state + step * way) - strip.energy(state - step * way)) / (2 * step)
    assert slope == pytest.approx((strip.internal_forces(state) * way).sum(), rel=1e-5)


@pytest.mark.parametrize(("plane", "edges"), [("stress", "free"), ("strain", "roller")])
def test_small_loads_are_the_linear_ones(sensor: ff.Sensor, plane: str, edges: str) -> None:
    paths = {"transducer.plane": plane, "transducer.edges": edges}
    model = ff.characterize(
        sensor.replace(**{**paths, "tactels.contact_width": "0.5 mm", "camera.pixels": 512})
    )
    design, forces = model.sensor, 1e-3 * ff.polar(1.0, 10, n=11)
    order = 7 if plane == "strain" else 6  # pressure in the cover is stiff in plane strain
    widths = np.full(11, 5e-4)
    strip = finite_strip(design.transducer, design.tactels.positions, widths, order=order)
    stress = strip.integrated_stress(strip.solved(forces), model.pixel_positions)
    constant = stress_optic_constant(design.transducer.photoelastic, 632.8e-9)
    linear = model.phase(forces)
    assert np.abs(phase_lead(stress, constant) - linear).max() < 1e-4 * np.abs(linear).max()


def test_dead_loads_are_carried_by_the_base(sensor: ff.Sensor) -> None:
    strip = _strip(sensor, order=3)
    forces = np.array([[0.8, 0.2], [0.5, -0.1]])
    # only vertices carry the shapes whose sum is one
    reaction = strip.internal_forces(strip.solved(forces))[:, ::3, 0].sum(axis=1)
    np.testing.assert_allclose(reaction, [-forces[:, 1].sum(), forces[:, 0].sum()], rtol=1e-8)


def test_what_has_no_solution_is_refused(sensor: ff.Sensor) -> None:
    with pytest.raises(InputError, match="contact_width"):
        finite_strip(sensor.transducer, [0.0], [0.0])
    with pytest.raises(InputError, match="beyond"):
        finite_strip(sensor.transducer, [12.4e-3], [1e-3])
    with pytest.raises(InputError, match="wider contacts"):
        _strip(sensor, order=3).solved([[60.0, 0.0], [0.0, 0.0]])
    with pytest.raises(InputError, match="shape"):
        _strip(sensor, order=3).solved([[np.nan, 0.0], [0.0, 0.0]])
