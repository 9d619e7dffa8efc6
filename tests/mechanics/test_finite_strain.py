"""Large strain against closed forms, finite differences and the linear solution."""

from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.mechanics.finite_strain import FiniteStrip, finite_strip
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

Array = NDArray[np.float64]
Plane = Literal["stress", "strain"]
LAWS = {
    "neo-Hookean": {},
    "Mooney-Rivlin": {"mooney_rivlin": [0.7, 0.3]},
    "Yeoh": {"yeoh": [1.0, -0.1, 0.04]},
}
lawful = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
planes = pytest.mark.parametrize("plane", ["stress", "strain"])


def _strip(sensor: ff.Sensor, order: int = 5, **changes: Any) -> FiniteStrip:
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
    seen = one.light.integrated_stress(state, [0.0, 3.3e-3])
    np.testing.assert_allclose(seen, cauchy[0, 0] * height, rtol=1e-9)


@lawful
@planes
def test_internal_forces_are_the_gradient_of_the_energy(
    sensor: ff.Sensor, law: dict[str, Any], plane: Plane
) -> None:
    strip = _strip(sensor, order=3, plane=plane, compliant=law, photoelastic=law)
    state = strip.solved([[0.8, 0.2], [0.5, -0.1]])
    way = np.random.default_rng(0).standard_normal(state.shape) * np.abs(state).max() / 10
    step = 1e-4
    slope = (strip.energy(state + step * way) - strip.energy(state - step * way)) / (2 * step)
    assert slope == pytest.approx((strip.internal_forces(state) * way).sum(), rel=1e-5)


@lawful
@planes
def test_the_second_order_of_internal_forces_is_what_both_signs_of_small_moves_share(
    sensor: ff.Sensor, law: dict[str, Any], plane: Plane
) -> None:
    strip = _strip(sensor, order=3, plane=plane, compliant=law, photoelastic=law)
    state = strip.linear(
        strip.on_surface(strip.at_rest(strip.load(np.array([[0.8, 0.2], [0, 1]]))))
    )
    small = 0.02 * state
    even, less = (
        (strip.internal_forces(share * small) + strip.internal_forces(-share * small)) / share**2
        for share in (1.0, 0.5)
    )
    expected = (4 * less - even) / 6  # without the fourth order
    found = strip.quadratic_forces(small)
    np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


@lawful
@planes
def test_the_tangent_of_a_strip_is_the_derivative_of_its_internal_forces(
    sensor: ff.Sensor, law: dict[str, Any], plane: Plane
) -> None:
    strip = _strip(sensor, order=3, plane=plane, compliant=law, photoelastic=law)
    state, step = strip.solved([[0.8, 0.2], [0.5, -0.1]]), 1e-4
    way = np.random.default_rng(0).standard_normal(state.shape) * np.abs(state).max() / 10
    way[:, :, 0] = 0  # held by the base
    ahead, behind = (strip.internal_forces(state + s * step * way) for s in (1, -1))
    change = (ahead - behind).reshape(1, -1) / (2 * step)
    found = strip._solved(strip.tangent(state), change).reshape(state.shape)
    assert np.abs(found - way).max() < 1e-5 * np.abs(way).max()


@pytest.mark.parametrize(
    ("plane", "edges", "law"),
    [
        ("stress", "free", "neo-Hookean"),
        ("strain", "roller", "neo-Hookean"),
        ("stress", "free", "Mooney-Rivlin"),
        ("stress", "roller", "Yeoh"),
    ],
)
def test_small_loads_are_the_linear_ones(
    sensor: ff.Sensor, plane: str, edges: str, law: str
) -> None:
    paths = {"transducer.plane": plane, "transducer.edges": edges}
    paths |= {f"transducer.{layer}": LAWS[law] for layer in ("compliant", "photoelastic")}
    model = ff.characterize(
        sensor.replace(**{**paths, "tactels.contact_width": "0.5 mm", "camera.pixels": 512})
    )
    design, forces = model.sensor, 1e-3 * ff.polar(1.0, 10, n=11)
    order = 7 if plane == "strain" else 6  # pressure in the cover is stiff in plane strain
    widths = np.full(11, 5e-4)
    strip = finite_strip(design.transducer, design.tactels.positions, widths, order=order)
    stress = strip.light.integrated_stress(strip.solved(forces), model.pixel_positions)
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
