"""Displacements against the exact solution, scikit-fem, uniform strain and Betti's theorem."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse.linalg import splu
from skfem import (
    Basis,
    ElementQuad1,
    ElementQuad2,
    ElementQuadP,
    ElementVector,
    MeshQuad,
    condense,
)
from skfem.models.elasticity import lame_parameters, linear_elasticity, plane_stress

import fringeforce as ff
from fringeforce.design.strip import Transducer
from fringeforce.mechanics import fourier
from fringeforce.mechanics.elasticity import Displacement, unit_displacements, unit_solutions
from fringeforce.mechanics.elements import interpolation
from fringeforce.mechanics.mesh import Mesh, strip_mesh
from fringeforce.mechanics.stress import integrated_stress
from fringeforce.mechanics.substructure import factorise

Array = NDArray[np.float64]
STATES = ["stress", "strain"]
X = np.array([-12.5, -9.0, -6.5, -4.0, -2.0, 0.0, 1.0, 3.0, 6.0, 9.5, 12.5]) * 1e-3
Z = np.array([-3.5, -2.2, -1.1, -0.5, -0.2, 0.0]) * 1e-3
LOADS = np.array([-4e-3, 0.0, 1e-3, 6e-3])


def _strip(sensor: ff.Sensor, edges: str, plane: str) -> Transducer:
    return sensor.replace(**{"transducer.edges": edges, "transducer.plane": plane}).transducer


def _values(displacement: Displacement, x: Array, z: Array) -> Array:
    """Displacements at single points, shape (2, points, ...)."""
    mesh = displacement.mesh
    along_x = interpolation(mesh.order, mesh.x, x)[0].toarray()
    along_z = interpolation(mesh.order, mesh.z, z)[0].toarray()
    return np.einsum("px,pz,cxz...->cp...", along_x, along_z, displacement.coefficients)


def _by_scikit_fem(strip: Transducer, mesh: Mesh, loads: Array, x: Array, z: Array) -> Array:
    """The same quantity from a two-dimensional mesh, a sparse matrix and SuperLU."""
    element = {1: ElementQuad1, 2: ElementQuad2}.get(mesh.order, partial(ElementQuadP, mesh.order))
    quads = MeshQuad.init_tensor(mesh.x, mesh.z)
    basis = Basis(quads, ElementVector(element()), intorder=2 * mesh.order)
    in_cover = quads.p[1, quads.t].mean(axis=0) > -strip.compliant.thickness
    matrix = 0
    for layer, here in ((strip.compliant, in_cover), (strip.photoelastic, ~in_cover)):
        lame = plane_stress if strip.plane == "stress" else lame_parameters
        form = linear_elasticity(*lame(layer.youngs_modulus, layer.poissons_ratio))
        matrix = matrix + form.assemble(basis.with_elements(np.flatnonzero(here)))
    fixed = basis.get_dofs(lambda p: np.isclose(p[1], mesh.z[0])).all()
    if strip.edges == "roller":
        sides = basis.get_dofs(lambda p: np.isclose(np.abs(p[0]), mesh.x[-1]))
        fixed = np.union1d(fixed, sides.all(["u^1"]))
    shapes = basis.probes(np.array([loads, np.zeros_like(loads)])).toarray() / strip.width
    along, down = shapes.reshape(2, len(loads), -1)
    forces = np.stack([-down, along], axis=-1).swapaxes(0, 1)
    free = np.setdiff1d(np.arange(basis.N), fixed)
    inner: Any = condense(matrix, D=fixed, expand=False)
    solution = np.zeros_like(forces)
    solution[free] = (
        splu(inner.tocsc()).solve(forces[free].reshape(len(free), -1)).reshape(len(free), -1, 2)
    )
    probed = basis.probes(np.array([x, z])) @ solution.reshape(basis.N, -1)
    return probed.reshape(2, len(x), -1, 2)


@pytest.mark.parametrize("plane", STATES)
@pytest.mark.parametrize("edges", ["free", "roller"])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_displacements_are_those_of_scikit_fem_on_the_same_mesh(
    sensor: ff.Sensor, order: int, edges: str, plane: str
) -> None:
    strip, mesh = _strip(sensor, edges, plane), Mesh(X, Z, order)
    x, z = np.random.default_rng(order).uniform([[-12.5e-3], [-3.5e-3]], [[12.5e-3], [0]], (2, 60))
    places = np.append(LOADS, [-6.9e-3, 0.3e-3, 12.5e-3])  # some of them inside elements
    displacement = Displacement(strip, mesh, unit_solutions(strip, places, mesh))
    found = _values(displacement, x, z)
    expected = _by_scikit_fem(strip, mesh, places, x, z)
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("edges", ["free", "roller"])
@pytest.mark.parametrize("loads", [[0.0], [-3e-3, 3e-3], [-6e-3, -3e-3, 0.0, 3e-3, 6e-3]])
@pytest.mark.parametrize("order", [1, 2, 5])
def test_a_strip_that_is_solved_by_halves_is_that_of_scikit_fem_too(
    sensor: ff.Sensor, order: int, loads: list[float], edges: str
) -> None:
    sides = np.array([-12.5, -9.0, -6.0, -3.0, -1.0, 0.0, 1.0, 3.0, 6.0, 9.0, 12.5]) * 1e-3
    strip, mesh = _strip(sensor, edges, "stress"), Mesh(sides, Z, order)
    x, z = np.random.default_rng(order).uniform([[-12.5e-3], [-3.5e-3]], [[12.5e-3], [0]], (2, 60))
    found = _values(unit_displacements(strip, loads, mesh), x, z)
    expected = _by_scikit_fem(strip, mesh, np.array(loads), x, z)
    np.testing.assert_allclose(found, expected, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("order", "factors"), [(1, (8, 16)), (2, (6, 12)), (3, (3, 6)), (4, (3, 6))]
)
def test_the_stress_integral_converges_at_the_rate_of_its_order(
    sensor: ff.Sensor, order: int, factors: tuple[int, int]
) -> None:
    strip = sensor.replace(
        transducer={"edges": "roller", "compliant": {"thickness": "1 mm"}}
    ).transducer
    coarse = Mesh(np.linspace(-12.5e-3, 12.5e-3, 21), np.array([-4, -3, -2, -1, 0]) * 1e-3, order)
    loads, pixels = [-2.5e-3, 0.0, 5e-3], sensor.pixel_positions
    anywhere, stations = [], []
    for mesh in map(coarse.refined, factors):
        displacement = unit_displacements(strip, loads, mesh)
        for errors, x in ((anywhere, pixels), (stations, mesh.stations)):
            exact = fourier.integrated_stress(strip, loads, x)
            error = integrated_stress(displacement, x) - exact
            errors.append(np.linalg.norm(error) / np.linalg.norm(exact))
    rates = [np.log(e[0] / e[1]) / np.log(factors[1] / factors[0]) for e in (anywhere, stations)]
    assert rates[0] == pytest.approx(order, abs=0.25)  # a derivative's usual rate
    assert rates[1] > order + 0.75  # one more at the Gauss points


@pytest.mark.parametrize("plane", STATES)
def test_uniform_pressure_between_rollers_squeezes_each_layer_evenly(
    sensor: ff.Sensor, plane: str
) -> None:
    strip, mesh = _strip(sensor, "roller", plane), Mesh(X, Z, 1)
    stiffness = []
    for layer in (strip.photoelastic, strip.compliant):
        e, nu = layer.youngs_modulus, layer.poissons_ratio
        c11 = e / (1 - nu**2) if plane == "stress" else e * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
        stiffness.append((c11, nu * c11 if plane == "stress" else nu / (1 - nu) * c11))
    c11, c12 = np.array([stiffness[int(z > -0.5e-3)] for z in (Z[:-1] + Z[1:]) / 2]).T
    held = np.zeros((len(X), 2, len(Z) - 1), dtype=bool)
    held[[0, -1], 0] = True
    loads = np.zeros((len(X), 2, len(Z) - 1, 1))
    loads[1:, 1, -1, 0] -= np.diff(X) / 2
    loads[:-1, 1, -1, 0] -= np.diff(X) / 2
    system = factorise(1, np.diff(X), np.diff(Z), c11, c12, held)
    u, w = system.solve(loads, np.zeros((len(X) - 1, 2, 0, 1)))[..., 0]
    sinking = -np.append(0, np.cumsum(np.diff(mesh.z) / c11))
    np.testing.assert_allclose(w, np.broadcast_to(sinking, w.shape), rtol=1e-11)
    np.testing.assert_allclose(u, 0, atol=1e-12 * np.abs(sinking).max())


@pytest.mark.parametrize("edges", ["free", "roller"])
def test_the_work_of_one_load_on_anothers_displacement_is_mutual(
    sensor: ff.Sensor, edges: str
) -> None:
    strip, tactels = _strip(sensor, edges, "stress"), sensor.tactels.positions
    displacement = unit_displacements(strip, tactels, strip_mesh(strip, tactels))
    u, w = _values(displacement, tactels, np.zeros(len(tactels)))
    compliance = np.stack([-w, u], axis=1).reshape(22, 22)  # Betti's theorem
    np.testing.assert_allclose(compliance, compliance.T, atol=1e-9 * np.abs(compliance).max())
    assert np.linalg.eigvalsh(compliance)[0] > 0


def test_a_push_dents_the_surface_and_a_drag_moves_it_to_plus_x(strip: Transducer) -> None:
    displacement = unit_displacements(strip, [2e-3], strip_mesh(strip, [2e-3]))
    u, w = _values(displacement, np.array([2e-3]), np.zeros(1))[:, 0, 0]
    assert w[0] < 0 < u[1]
    assert abs(w[0]) > abs(u[0])
    assert abs(u[1]) > abs(w[1])


@pytest.mark.parametrize("edges", ["free", "roller"])
def test_the_mirror_image_of_a_load_has_the_mirror_image_of_its_stress(
    sensor: ff.Sensor, edges: str
) -> None:
    strip, tactels = _strip(sensor, edges, "stress"), sensor.tactels.positions
    x = np.linspace(-12.5e-3, 12.5e-3, 101)
    displacement = unit_displacements(strip, tactels, strip_mesh(strip, tactels))
    stress = integrated_stress(displacement, x)
    mirrored = stress[::-1, ::-1] * [1, -1]
    # on the boundary between two elements the slope is the left one's, which the mirror exchanges
    between = np.abs(x[:, None] - displacement.mesh.x).min(axis=1) > 1e-9
    scale = np.abs(stress).max()
    np.testing.assert_allclose(stress[between], mirrored[between], atol=1e-8 * scale)


def test_a_drag_compresses_what_lies_ahead_and_stretches_what_lies_behind(
    strip: Transducer,
) -> None:
    displacement = unit_displacements(strip, [0.0], strip_mesh(strip, [0.0]))
    behind, ahead = integrated_stress(displacement, [-2e-3, 2e-3])[:, 0, 1]
    assert ahead < 0 < behind


def test_a_load_inside_an_element_is_refused(strip: Transducer) -> None:
    with pytest.raises(ff.FringeforceError, match=r"0\.0003 m.*strip_mesh"):
        unit_displacements(strip, [0.3e-3], Mesh(X, Z, 2))
