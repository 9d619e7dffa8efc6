"""Displacements against another library's elements, reciprocity, symmetry and rates."""

import numpy as np
import pytest
from skfem import Basis, ElementQuad2, ElementVector, MeshQuad, condense, solve
from skfem.models.elasticity import lame_parameters, linear_elasticity

import fringeforce as ff
from fringeforce.design import Layer, Transducer
from fringeforce.mechanics import fourier
from fringeforce.mechanics.elasticity import unit_displacements
from fringeforce.mechanics.mesh import Mesh, strip_mesh
from fringeforce.mechanics.stress import integrated_stress

TACTELS = np.array([-2e-3, 0.0, 3e-3])


def strip(sensor: ff.Sensor, edges: str, plane: str = "stress") -> Transducer:
    return sensor.replace(transducer={"edges": edges, "plane": plane}).transducer


def uneven_mesh(order: int) -> Mesh:
    x = np.concatenate([[-12.5, -9, -6, -4], [-2, -1, 0, 1, 3], [4.5, 7, 12.5]]) * 1e-3
    return Mesh(x, np.array([-3.5, -2.4, -1.2, -0.5, -0.2, 0.0]) * 1e-3, order)


def solved_by_scikit_fem(transducer: Transducer, mesh: Mesh, normal: bool, at: float):
    """Displacements at the corners of the elements, (2, x, z), for one unit force."""
    basis = Basis(MeshQuad.init_tensor(mesh.x, mesh.z), ElementVector(ElementQuad2()))
    px, pz = basis.mesh.p
    in_cover = basis.mesh.p[1, basis.mesh.t].mean(axis=0) > -transducer.compliant.thickness
    parts = []
    for layer, inside in ((transducer.compliant, in_cover), (transducer.photoelastic, ~in_cover)):
        form = linear_elasticity(*lame_parameters(*three_dimensional(layer, transducer.plane)))
        parts.append(form.assemble(basis.with_elements(np.nonzero(inside)[0])))
    half, bottom = transducer.length / 2, mesh.z[0]
    held = basis.get_dofs(lambda x: np.isclose(x[1], bottom)).all()
    if transducer.edges == "roller":
        sides = basis.get_dofs(lambda x: np.isclose(np.abs(x[0]), half))
        held = np.union1d(held, sides.all(["u^1"]))
    load = np.zeros(basis.N)
    node = np.argmin((px - at) ** 2 + pz**2)
    nodal = np.asarray(basis.nodal_dofs)
    load[nodal[int(normal), node]] = (-1.0 if normal else 1.0) / transducer.width
    found = solve(*condense(parts[0] + parts[1], load, D=held))
    order = np.lexsort((pz, px))
    return found[nodal[:, order]].reshape(2, len(mesh.x), len(mesh.z))


def three_dimensional(layer: Layer, plane: str) -> tuple[float, float]:
    """Moduli whose plane strain is the layer's plane state."""
    young, poisson = layer.youngs_modulus, layer.poissons_ratio
    if plane == "strain":
        return young, poisson
    return young * (1 + 2 * poisson) / (1 + poisson) ** 2, poisson / (1 + poisson)


@pytest.mark.parametrize("edges", ["free", "roller"])
@pytest.mark.parametrize("plane", ["stress", "strain"])
@pytest.mark.parametrize("normal", [True, False])
def test_displacements_are_those_of_scikit_fem(sensor, edges, plane, normal) -> None:
    transducer, mesh = strip(sensor, edges, plane), uneven_mesh(2)
    ours = unit_displacements(transducer, TACTELS, mesh).coefficients
    corners = ours[:, :: mesh.order, :: mesh.order, int(not normal), 2]
    theirs = solved_by_scikit_fem(transducer, mesh, normal, TACTELS[2])
    np.testing.assert_allclose(corners, theirs, atol=1e-9 * np.abs(theirs).max())


@pytest.mark.parametrize("edges", ["free", "roller"])
def test_work_is_reciprocal(sensor: ff.Sensor, edges: str) -> None:
    """What force j does on the displacement of force i, i does on that of j (Betti)."""
    mesh = strip_mesh(strip(sensor, edges), TACTELS, order=4)
    found = unit_displacements(strip(sensor, edges), TACTELS, mesh).coefficients
    columns = np.abs(mesh.x[:, None] - TACTELS).argmin(axis=0) * mesh.order
    surface = found[:, columns, -1].reshape(2, 3, 6)
    flexibility = np.concatenate([-surface[1], surface[0]])
    np.testing.assert_allclose(flexibility, flexibility.T, rtol=1e-6, atol=1e-12)
    assert (np.linalg.eigvalsh((flexibility + flexibility.T) / 2) > 0).all()


@pytest.mark.parametrize("edges", ["free", "roller"])
def test_a_pressed_surface_sinks_and_a_dragged_one_follows(sensor: ff.Sensor, edges: str) -> None:
    mesh = strip_mesh(strip(sensor, edges), TACTELS)
    found = unit_displacements(strip(sensor, edges), TACTELS, mesh).coefficients
    middle = np.abs(mesh.x).argmin() * mesh.order
    assert found[1, middle, -1, 0, 1] < 0
    assert found[0, middle, -1, 1, 1] > 0


@pytest.mark.parametrize("order", [1, 2, 3])
def test_the_integrated_stress_converges_at_the_rate_of_the_elements(sensor, order) -> None:
    """At the stations, away from the loads, errors fall at least as h^(order + 1)."""
    transducer = strip(sensor, "roller")
    x = np.linspace(-12.5e-3, 12.5e-3, 51)
    tactels = np.array([-10e-3, 10e-3])
    errors = []
    for cuts in (2, 4, 8):
        even = Mesh(x[::2], np.linspace(-3.5e-3, 0, 8), order).refined(cuts)
        inside = even.stations[np.abs(even.stations) < 6e-3]
        found = integrated_stress(unit_displacements(transducer, tactels, even), inside)
        exact = fourier.integrated_stress(transducer, tactels, inside, terms=1500)
        errors.append(np.linalg.norm(found - exact) / np.linalg.norm(exact))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (rates > order + 0.7).all(), (errors, rates)


def test_a_tactel_inside_an_element_is_refused(sensor: ff.Sensor) -> None:
    with pytest.raises(ff.FringeforceError, match=r"x = 0\.0005 m.*strip_mesh"):
        unit_displacements(sensor.transducer, [0.5e-3], uneven_mesh(2))
