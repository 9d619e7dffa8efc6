"""The double series against half-space solutions, plane strain, and the laws of elasticity."""

import numpy as np
import pytest
from numpy.typing import NDArray

import fringeforce as ff
from fringeforce.design.strip import PhotoelasticLayer
from fringeforce.mechanics.fourier import stress_field
from fringeforce.mechanics.solid.block import Block, Patches
from fringeforce.mechanics.solid.fourier import stress_influence, stress_of_loads

Array = NDArray[np.float64]
NU = 0.3
NORMAL, ALONG, ACROSS = range(3)
"""Components of a force: N presses towards -z, T_x points to +x, T_y to +y."""


@pytest.fixture(scope="module")
def pad() -> Block:
    strip = ff.load_sensor("saad").transducer
    return Block(25e-3, 18e-3, strip.compliant, strip.photoelastic, "roller")


@pytest.fixture(scope="module")
def half_space() -> Block:
    """One material, two metres wide and deep, under a cover of four centimetres."""

    def layer(thickness: float) -> PhotoelasticLayer:
        return PhotoelasticLayer(
            thickness=thickness, youngs_modulus=1e6, poissons_ratio=NU, strain_optic_coefficient=0.1
        )

    return Block(2.0, 2.0, layer(0.04), layer(2.0), "roller")


def _boussinesq(x: Array, y: Array, depth: Array) -> tuple[Array, Array]:
    """sigma_x - sigma_y and tau_xy under a unit normal force (Poulos and Davis 1974, 2.2)."""
    r = np.sqrt(x**2 + y**2 + depth**2)
    bracket = 3 * depth / r**5 - (1 - 2 * NU) * (2 * r + depth) / ((r + depth) ** 2 * r**3)
    return -(x**2 - y**2) * bracket / (2 * np.pi), -x * y * bracket / (2 * np.pi)


def _cerruti(x: Array, y: Array, depth: Array) -> tuple[Array, Array]:
    """The same under a unit force along x (Poulos and Davis 1974, 2.2)."""
    r = np.sqrt(x**2 + y**2 + depth**2)
    soft = (1 - 2 * NU) / (r + depth) ** 2
    lead = -1 / (2 * np.pi * r**3)
    sigma_x = 3 * x**2 / r**2 - soft * (r**2 - y**2 - 2 * r * y**2 / (r + depth))
    sigma_y = 3 * y**2 / r**2 - soft * (3 * r**2 - x**2 - 2 * r * x**2 / (r + depth))
    tau = 3 * x**2 / r**2 - soft * (x**2 - r**2 + 2 * r * x**2 / (r + depth))
    return lead * x * (sigma_x - sigma_y), lead * y * tau


def test_point_forces_on_a_deep_block_act_as_on_a_half_space(half_space: Block) -> None:
    near = np.linspace(-0.09, 0.08, 6)
    patches = Patches(np.zeros((1, 2)))
    # the upper half of a Gauss rule lies within a metre; keep what is near
    found = stress_influence(half_space, patches, near, near + 0.005, slices=40)
    close = found.z > -0.1
    x, y, depth = np.meshgrid(found.x, found.y, -found.z[close], indexing="ij")
    along_y = tuple(s * f for s, f in zip((-1, 1), _cerruti(y, x, depth), strict=True))
    for component, (difference, shear) in {
        NORMAL: _boussinesq(x, y, depth),
        ALONG: _cerruti(x, y, depth),
        ACROSS: along_y,
    }.items():
        peak = abs(difference).max()
        for field, exact in ((found.difference, difference), (found.shear, shear)):
            error = abs(field[:, :, close, 0, component] - exact).max()
            assert error < 2e-3 * peak


def test_a_load_that_does_not_vary_across_gives_plane_strain(pad: Block) -> None:
    strip = ff.load_sensor("saad").replace(
        **{"transducer.edges": "roller", "transducer.plane": "strain", "transducer.width": "18 mm"}
    )
    rows = 60
    y = (np.arange(rows) + 0.5) / rows * pad.width - pad.width / 2
    places = np.column_stack([np.full(rows, 1e-3), y])
    x = np.linspace(-10e-3, 10e-3, 9)
    # points side by side, closer by far than the cover is thick, from wall to wall
    found = stress_influence(pad, Patches(places, 0.0), x, np.array([2e-3]), slices=4)
    line = found.difference.mean(axis=-2)[:, 0]
    sigma_x, sigma_z, _ = stress_field(strip.transducer, [1e-3], x, found.z)[..., 0, :]
    nu = pad.photoelastic.poissons_ratio
    plane = sigma_x - nu * (sigma_x + sigma_z)
    np.testing.assert_allclose(line[..., :2], plane, atol=1e-4 * abs(plane).max())
    shear = found.shear.mean(axis=-2)[:, 0, :, :2]
    np.testing.assert_allclose(shear, 0, atol=1e-4 * abs(plane).max())


def test_turning_block_and_force_turns_the_stress(pad: Block) -> None:
    turned = Block(pad.width, pad.length, pad.compliant, pad.photoelastic, "roller")
    place, x, y = np.array([[3e-3, -1e-3]]), np.array([1e-3, 4e-3]), np.array([-2e-3, 0.0, 5e-3])
    one = stress_influence(pad, Patches(place, 1e-3), x, y, slices=3)
    other = stress_influence(turned, Patches(place[:, ::-1], 1e-3), y, x, slices=3)
    swapped = [NORMAL, ACROSS, ALONG]
    np.testing.assert_allclose(
        one.difference, -other.difference.swapaxes(0, 1)[..., swapped], atol=1e-9
    )
    np.testing.assert_allclose(one.shear, other.shear.swapaxes(0, 1)[..., swapped], atol=1e-9)


def test_a_large_patch_is_the_mean_of_the_points_in_it(pad: Block) -> None:
    x = np.array([-2e-3, 0.0, 3e-3])
    points, weights = np.polynomial.legendre.leggauss(8)
    nodes = np.stack(np.meshgrid(points, points, indexing="ij"), axis=-1).reshape(-1, 2)
    share = np.outer(weights, weights).ravel() / 4
    patch = stress_influence(pad, Patches(np.zeros((1, 2)), 2e-3), x, x, slices=3)
    spread = stress_influence(pad, Patches(nodes * 1e-3, 0.0), x, x, slices=3)
    for whole, parts in ((patch.difference, spread.difference), (patch.shear, spread.shear)):
        np.testing.assert_allclose(whole[..., 0, :], share @ parts, atol=1e-5 * abs(whole).max())


def test_patches_that_mirror_each_other_strain_the_block_as_each_does_alone(pad: Block) -> None:
    """Of patches that are symmetric about the centre a quarter is solved; one alone is its own."""
    x, y = np.linspace(-6e-3, 6e-3, 5), np.linspace(-4e-3, 4e-3, 4)
    places = np.array([[along, across] for along in (-2e-3, 0.0, 2e-3) for across in (-1e-3, 1e-3)])
    together = stress_influence(pad, Patches(places, 1e-3), x, y, slices=3)
    for number, place in enumerate(places):
        alone = stress_influence(pad, Patches(place[None], 1e-3), x, y, slices=3)
        for all_of_them, one in (
            (together.difference, alone.difference),
            (together.shear, alone.shear),
        ):
            found = all_of_them[..., number, :]
            np.testing.assert_allclose(found, one[..., 0, :], atol=1e-12 * abs(one).max())


def test_rectangles_have_sides_of_their_own(pad: Block) -> None:
    x = np.array([-2e-3, 0.0, 3e-3])
    places, sides = np.array([[1e-3, 0.0], [-2e-3, 1e-3]]), np.array([[2e-3, 1e-3], [1e-3, 3e-3]])
    found = stress_influence(pad, Patches(places, sides), x, x, slices=3)
    for number, (place, (long, wide)) in enumerate(zip(places, sides, strict=True)):
        # a rectangle is the squares in it
        small = 0.5e-3
        grid = np.meshgrid(*((np.arange(s / small) + 0.5) * small - s / 2 for s in (long, wide)))
        squares = Patches(place + np.stack(grid, axis=-1).reshape(-1, 2), small)
        parts = stress_influence(pad, squares, x, x, slices=3)
        for whole, part in ((found.difference, parts.difference), (found.shear, parts.shear)):
            one = whole[..., number, :]
            np.testing.assert_allclose(one, part.mean(axis=-2), atol=1e-9 * abs(one).max())


def test_many_loads_at_once_cause_the_sum_of_what_each_causes(pad: Block) -> None:
    rng, x, y = np.random.default_rng(1), np.array([-2e-3, 0.0, 3e-3]), np.array([-1e-3, 4e-3])
    loads = [
        (Patches(rng.uniform(-5e-3, 5e-3, (4, 2)), size), rng.normal(size=(4, 3)))
        for size in (1e-3, 2e-3)
    ]
    difference, shear = stress_of_loads(pad, loads, x, y, slices=3)
    each = [(stress_influence(pad, patches, x, y, slices=3), forces) for patches, forces in loads]
    expected = sum(np.einsum("xysnc,nc->syx", one.difference, forces) for one, forces in each)
    np.testing.assert_allclose(difference, expected, atol=1e-9 * abs(difference).max())
    expected = sum(np.einsum("xysnc,nc->syx", one.shear, forces) for one, forces in each)
    np.testing.assert_allclose(shear, expected, atol=1e-9 * abs(shear).max())
