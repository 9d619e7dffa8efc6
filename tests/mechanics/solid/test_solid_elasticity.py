"""Bricks against scikit-fem, uniform strain, plane strain, the double Fourier series, Betti."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse.linalg import splu
from skfem import Basis, ElementHex2, ElementVector, MeshHex, condense
from skfem.models.elasticity import lame_parameters, linear_elasticity

import fringeforce as ff
from fringeforce.design.strip import Layer, PhotoelasticLayer, Transducer
from fringeforce.mechanics import fourier
from fringeforce.mechanics.elements import along, interpolation
from fringeforce.mechanics.solid.block import Block, Patches, Sides
from fringeforce.mechanics.solid.elasticity import Loads, symmetric_parts
from fringeforce.mechanics.solid.influence import light_stresses, pad_influence
from fringeforce.mechanics.solid.mesh import BoxMesh, box_mesh
from fringeforce.mechanics.solid.strip import STRIP
from fringeforce.mechanics.solid.symmetry import mirrored_interpolation

pytestmark = pytest.mark.slow

Array = NDArray[np.float64]
COVER = Layer(thickness=0.5e-3, youngs_modulus=11e6, poissons_ratio=0.49)
CLEAR = PhotoelasticLayer(
    thickness=2e-3, youngs_modulus=110e6, poissons_ratio=0.42, strain_optic_coefficient=0.05
)
MESH = BoxMesh(
    np.array([0, 0.8e-3, 1.7e-3, 3e-3]),
    np.array([0, 1.1e-3, 2e-3]),
    np.array([-2.5e-3, -1.2e-3, -0.5e-3, 0]),
    order=2,
)
PLACES = np.array([[0.8e-3, -1.1e-3], [0.0, 0.0], [-0.8e-3, -1.1e-3]])


def _block(sides: Sides, across: Sides | None = None) -> Block:
    return Block(6e-3, 4e-3, COVER, CLEAR, sides, across)


def _displacement(block: Block, loads: Loads, mesh: BoxMesh, points: Array) -> Array:
    """At single points (3, m), for every load, shape (3, m, n, components)."""
    total = np.zeros((3, points.shape[1], len(loads.places), loads.components))
    at_z = interpolation(mesh.order, mesh.z, points[2])[0].toarray()
    for part in symmetric_parts(block, loads, mesh):
        image, signs = loads.images(part.mirrors)
        for i in range(3):
            at_x, at_y = (
                mirrored_interpolation(mesh.order, b, points[m.axis], m.of(i))[0].toarray()
                for b, m in zip((mesh.x, mesh.y), part.mirrors, strict=True)
            )
            values = np.einsum("mx,my,mz,xyz...->m...", at_x, at_y, at_z, part.coefficients[i])
            total[i] += values[..., image, :] * signs
    return total


def _by_scikit_fem(block: Block, mesh: BoxMesh, places: Array, points: Array) -> Array:
    """The same from all of the block, a sparse matrix and SuperLU."""
    whole = [np.concatenate([-b[:0:-1], b]) for b in (mesh.x, mesh.y)]
    hexes = MeshHex.init_tensor(whole[0], whole[1], mesh.z)
    basis = Basis(hexes, ElementVector(ElementHex2()), intorder=4)
    in_cover = hexes.p[2, hexes.t].mean(axis=0) > block.interface
    matrix = 0
    for layer, here in ((block.compliant, in_cover), (block.photoelastic, ~in_cover)):
        form = linear_elasticity(*lame_parameters(layer.youngs_modulus, layer.poissons_ratio))
        matrix = matrix + form.assemble(basis.with_elements(np.flatnonzero(here)))
    fixed = basis.get_dofs(lambda p: np.isclose(p[2], mesh.z[0])).all()
    for axis, side in enumerate((block.sides, block.across or block.sides)):
        edge = basis.get_dofs(lambda p, a=axis: np.isclose(np.abs(p[a]), whole[a][-1]))
        held = {"free": [], "roller": [f"u^{axis + 1}"], "bonded": ["u^1", "u^2", "u^3"]}[side]
        fixed = np.union1d(fixed, edge.all(held)) if held else fixed
    forces = np.zeros((basis.N, len(places), 3))
    for n, place in enumerate(places):
        node = np.linalg.norm(hexes.p.T - [*place, 0], axis=1).argmin()
        u, v, w = basis.get_dofs(nodes=np.array([node])).all()
        forces[w, n, 0], forces[u, n, 1], forces[v, n, 2] = -1, 1, 1
    free = np.setdiff1d(np.arange(basis.N), fixed)
    inner: Any = condense(matrix, D=fixed, expand=False)
    solution = np.zeros((basis.N, 3 * len(places)))
    solution[free] = splu(inner.tocsc()).solve(forces[free].reshape(len(free), -1))
    return (basis.probes(points) @ solution).reshape(3, points.shape[1], -1, 3)


@pytest.mark.parametrize(
    ("sides", "across"), [("free", None), ("roller", "free"), ("free", "bonded")]
)
def test_displacements_are_those_of_scikit_fem_on_the_same_bricks(
    sides: Sides, across: Sides | None
) -> None:
    block, loads = _block(sides, across), Loads(PLACES, (0.0, 0.0))
    low, high = [[-3e-3], [-2e-3], [-2.5e-3]], [[3e-3], [2e-3], [0]]
    points = np.random.default_rng(1).uniform(low, high, (3, 40))
    found = _displacement(block, loads, MESH, points)
    expected = _by_scikit_fem(block, MESH, PLACES, points)
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("order", [2, 3])
def test_even_pressure_between_rollers_squeezes_each_layer_evenly(order: int) -> None:
    block, mesh = _block("roller"), BoxMesh(MESH.x, MESH.y, MESH.z, order)
    points = np.random.default_rng(2).uniform(-1e-3, 1e-3, (3, 9)) - [[0], [0], [1e-3]]
    points = np.concatenate([points, [[0.3e-3], [0.1e-3], [0.0]]], axis=1)
    loads = Loads(np.zeros((1, 2)), (block.length, block.width), components=1)
    u, v, w = _displacement(block, loads, mesh, points)[..., 0, 0]
    stiffness = {
        layer: layer.youngs_modulus
        * (1 - layer.poissons_ratio)
        / ((1 + layer.poissons_ratio) * (1 - 2 * layer.poissons_ratio))
        for layer in (COVER, CLEAR)
    }
    pressure = 1 / (block.length * block.width)
    clear = np.minimum(points[2], -0.5e-3) + 2.5e-3
    cover = np.maximum(points[2] + 0.5e-3, 0)
    sinking = -pressure * (clear / stiffness[CLEAR] + cover / stiffness[COVER])
    np.testing.assert_allclose(w, sinking, rtol=1e-9)
    np.testing.assert_allclose([u, v], 0, atol=1e-10 * np.abs(sinking).max())


def test_line_loads_between_rollers_make_plane_strain(sensor: ff.Sensor) -> None:
    strip: Transducer = sensor.replace(
        transducer={"edges": "roller", "plane": "strain", "width": "4 mm"}
    ).transducer
    positions = np.array([-1e-3, 0.0, 2.5e-3])
    block = Block(strip.length, strip.width, strip.compliant, strip.photoelastic, "roller")
    loads = Loads(np.stack([positions, 0 * positions], axis=1), (0.0, strip.width), 2)
    mesh = box_mesh(block, positions, [], replace(STRIP, order=6, load=1.0, surface=0.2))
    places = np.linspace(-11e-3, 11e-3, 45), np.array([0.0, 1.3e-3])
    z, weights = block.depths(20)
    depth = interpolation(mesh.order, mesh.z, z)[0]
    exact = fourier.integrated_stress(strip, positions, places[0])
    found = np.zeros((2, *exact.shape))
    for part in symmetric_parts(block, loads, mesh):
        image, signs = loads.images(part.mirrors)
        for c in (0, 1):
            difference, shear = light_stresses(block, part, mesh, places, depth, c)
            lines = np.einsum("xyzr,z->yxr", difference, weights)
            found[..., c] += lines[..., image] * signs[:, c]
            assert np.abs(shear).max() < 1e-6 * np.abs(difference).max()
    error = np.linalg.norm(found - exact, axis=1) / np.linalg.norm(exact, axis=0)
    assert error.max() < 2e-3


def test_the_work_of_one_force_on_anothers_displacement_is_mutual() -> None:
    points = np.concatenate([PLACES.T, np.zeros((1, 3))])
    u, v, w = _displacement(_block("free"), Loads(PLACES, (0.0, 0.0)), MESH, points)
    compliance = np.stack([-w, u, v], axis=1).reshape(9, 9)  # Betti's theorem
    np.testing.assert_allclose(compliance, compliance.T, atol=1e-9 * np.abs(compliance).max())
    assert np.linalg.eigvalsh(compliance)[0] > 0


def test_a_load_beyond_the_block_is_refused() -> None:
    patches = Patches(np.array([[0.0, 1.9e-3]]), 0.5e-3)
    with pytest.raises(ff.FringeforceError, match=r"y = 1\.9 mm.*6 x 4 mm"):
        pad_influence(_block("free"), patches, [0.0], [0.0])


def test_an_order_that_no_slab_can_be_eliminated_with_is_refused() -> None:
    with pytest.raises(ff.FringeforceError, match="order = 1"):
        BoxMesh(*np.tile([0.0, 1.0], (3, 1)), order=1)


def test_a_matrix_along_an_axis_is_a_tensor_product() -> None:
    values = np.random.default_rng(3).normal(size=(3, 5, 2))
    matrix = interpolation(2, np.array([0.0, 1.0, 2.0]), np.array([0.3, 1.7]))[0]
    expected = np.einsum("ab,ibj->iaj", matrix.toarray(), values)
    np.testing.assert_allclose(along(matrix, values, 1), expected)
