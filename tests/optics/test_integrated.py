"""Light through stacks of retarders against closed forms, Jones products, finite differences."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from fringeforce.base.errors import InputError
from fringeforce.optics.integrated import (
    double_pass,
    double_pass_adjoint,
    equivalent_retarder,
    jones_matrix,
    turn,
    turn_back,
    turn_modes,
    turn_modes_back,
)
from fringeforce.optics.jones import retarder

# one worker compiles the loops for double precision, which only tests of these take
pytestmark = pytest.mark.xdist_group("integrated")

Array = NDArray[np.float64]

STATED = 2.5e-4
"""What merged slices change of light at most."""


def stack(seed: int, slices: int = 7, pixels: int = 5, size: float = 0.6) -> Array:
    return np.random.default_rng(seed).normal(size=(slices, 2, pixels)) * size


def jones_product(slices: Array) -> NDArray[np.complex128]:
    """Down through the stack, a mirror, up again, by products of the house's own retarders."""
    total = np.broadcast_to(np.eye(2, dtype=complex), (slices.shape[2], 2, 2))
    for A, B in slices:
        single = np.array(
            [retarder(np.hypot(a, b), np.arctan2(b, a) / 2) for a, b in zip(A, B, strict=True)]
        )
        total = single @ total @ single
    return total


def differences(slices: Array, pull: Array, step: float = 1e-6) -> Array:
    """Derivative of the products of matrices by every slice, by finite differences."""
    found = np.empty_like(slices)
    for n, side in np.ndindex(*slices.shape[:2]):
        moved = np.zeros_like(slices)
        moved[n, side] = step
        change = (jones_product(slices + moved) - jones_product(slices - moved)) / (2 * step)
        light = np.array([change[:, 0, 0].imag, change[:, 0, 1].imag, change[:, 0, 0].real])
        found[n, side] = (pull * light).sum(axis=0)
    return found


def test_a_stack_is_the_product_of_its_jones_matrices() -> None:
    slices = stack(0)
    np.testing.assert_allclose(jones_matrix(double_pass(slices)), jones_product(slices), atol=1e-13)


def test_slices_of_up_to_a_wave_are_right() -> None:
    angle, size = np.linspace(0, 3, 40), np.linspace(0, 2 * np.pi, 40)
    slices = size * np.array([[np.cos(angle), np.sin(angle)]])
    np.testing.assert_allclose(jones_matrix(double_pass(slices)), jones_product(slices), atol=5e-8)
    pull = np.random.default_rng(8).normal(size=(3, 40))
    found = double_pass_adjoint(slices, double_pass(slices), pull)
    np.testing.assert_allclose(found, differences(slices, pull), atol=2e-6)


@pytest.mark.parametrize("largest", [8.0, 40.0, 1000.0])
def test_light_stays_on_the_sphere_and_right_whatever_a_slice_retards(largest: float) -> None:
    angle = np.linspace(0, 3, 600)
    size = np.array([[0.7], [1.0], [0.2]]) * np.linspace(0, largest, 600)
    slices = size[:, None] * np.array([np.cos(angle), np.sin(angle)])
    light, torque, found = np.empty((3, 600)), np.empty((3, 600)), np.empty_like(slices)
    turn(slices, light)
    np.testing.assert_allclose(jones_matrix(light), jones_product(slices), atol=2e-7)
    pull = np.random.default_rng(9).normal(size=(3, 600))
    torque[:] = np.cross(light, pull, axis=0)
    turn_back(slices, torque, found)
    np.testing.assert_allclose(found, differences(slices, pull), atol=1e-5)
    # single precision resolves a large angle less finely, and no more than that
    single = np.empty((3, 600), dtype=np.float32)
    turn(slices.astype(np.float32), single)
    np.testing.assert_allclose((single**2).sum(axis=0), 1, atol=1e-5)
    np.testing.assert_allclose(single, light, atol=2e-5 + 4e-7 * largest)


def test_a_uniform_layer_is_a_retarder_of_twice_its_single_pass() -> None:
    angle, single = 0.3, 1.1
    direction = np.array([np.cos(2 * angle), np.sin(2 * angle)])
    slices = np.repeat(single / 6 * direction[None, :, None], 6, axis=0)
    light = double_pass(slices)
    np.testing.assert_allclose(jones_matrix(light)[0], retarder(2 * single, angle), atol=1e-14)
    np.testing.assert_allclose(equivalent_retarder(light)[:, 0], 2 * single * direction)


def test_axes_that_twist_at_a_constant_rate_follow_the_closed_form() -> None:
    retardance, twist, slices = 2.3, 1.2, 400
    # in axes that turn with the stack the rate is constant: one matrix exponential
    s1, spin = np.diag([1.0, -1.0]), np.array([[0.0, -1.0], [1.0, 0.0]])
    turn = np.array([[np.cos(twist), -np.sin(twist)], [np.sin(twist), np.cos(twist)]])
    single = turn @ expm(0.5j * retardance * s1 - twist * spin)
    angle = (np.arange(slices) + 0.5) / slices * twist
    # from the mirror outwards, which is from the end of the first pass backwards
    vector = retardance / slices * np.stack([np.cos(2 * angle), np.sin(2 * angle)], axis=1)
    found = jones_matrix(double_pass(vector[::-1, :, None]))[0]
    np.testing.assert_allclose(found, single.T @ single, atol=1e-5)


def test_a_double_pass_turns_the_poincare_sphere_as_its_equivalent_retarder_does() -> None:
    """Mueller matrices of retarders are rotations of the Stokes parameters, by SciPy's."""
    slices = stack(1, size=1.5)
    whole = equivalent_retarder(double_pass(slices))
    for pixel, (A, B) in enumerate(whole.T):
        turns = [Rotation.from_rotvec([-a, -b, 0.0]) for a, b in slices[:, :, pixel]]
        both = Rotation.identity()
        for one in turns:  # from the mirror outwards, a slice before and behind
            both = one * both * one
        found = Rotation.from_rotvec([-A, -B, 0.0])
        np.testing.assert_allclose(found.as_matrix(), both.as_matrix(), atol=1e-12)
        # no optical activity: the axis lies in the plane of the linear states
        np.testing.assert_allclose(both.as_rotvec()[2], 0, atol=1e-12)


def test_every_slice_turns_the_point_of_the_double_pass_by_its_retardance() -> None:
    slices = stack(2, size=1.5)
    for pixel, light in enumerate(double_pass(slices).T):
        point = np.array([0.0, 0.0, 1.0])
        for A, B in slices[:, :, pixel]:
            point = Rotation.from_rotvec([-B, A, 0.0]).apply(point)
        np.testing.assert_allclose(light, point, atol=1e-13)


def test_depth_integrals_are_right_to_the_third_order_in_the_retardance() -> None:
    slices = stack(3, pixels=40)
    sizes = 0.2 ** np.arange(2, 4)
    errors = [
        np.abs(equivalent_retarder(double_pass(s * slices)) - 2 * (s * slices).sum(axis=0)).max()
        for s in sizes
    ]
    order = np.log(errors[0] / errors[1]) / np.log(sizes[0] / sizes[1])
    assert order == pytest.approx(3, abs=0.05)


def test_derivatives_are_those_of_finite_differences() -> None:
    slices, step = stack(4, slices=4, pixels=3, size=0.9), 1e-6
    pull = np.random.default_rng(5).normal(size=(3, 3))
    found = double_pass_adjoint(slices, double_pass(slices), pull)
    for index in np.ndindex(*slices.shape):
        moved = np.zeros_like(slices)
        moved[index] = step
        change = double_pass(slices + moved) - double_pass(slices - moved)
        assert found[index] == pytest.approx((pull * change).sum() / (2 * step), abs=1e-8)


def test_derivatives_of_no_stress_at_all_are_finite_and_right() -> None:
    slices, pull = np.zeros((3, 2, 2)), np.ones((3, 2))
    found = double_pass_adjoint(slices, double_pass(slices), pull)
    np.testing.assert_allclose(found, 1)  # v = (A, B) to first order


def test_single_precision_follows_double_precision() -> None:
    slices = stack(6, slices=12, pixels=700)
    light = double_pass(slices)
    single = double_pass(slices.astype(np.float32))
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, light, atol=5e-6)
    exact = double_pass_adjoint(slices, light, light)
    quick = double_pass_adjoint(slices.astype(np.float32), single, single)
    np.testing.assert_allclose(quick, exact, atol=2e-5)


def test_a_slice_of_more_than_a_wave_is_refused() -> None:
    with pytest.raises(InputError, match="more slices"):
        double_pass(np.full((1, 2, 1), 5.0))
    with pytest.raises(InputError, match="check the stress"):
        double_pass(np.full((1, 2, 1), np.nan))


@pytest.mark.parametrize("pixels", [1, 512, 700])
def test_light_of_sums_of_modes_is_that_of_the_slices_they_add_up_to(pixels: int) -> None:
    rng = np.random.default_rng(7)
    modes, profile = rng.normal(size=(2, 6, pixels)) * 0.3, rng.normal(size=(7, 6))
    slices = np.einsum("nk,skp->nsp", profile, modes)
    light, gradient = np.empty((3, pixels)), np.empty_like(modes)
    turn_modes(modes, profile, light)
    np.testing.assert_allclose(light, double_pass(slices), atol=1e-13)
    pull = rng.normal(size=(3, pixels))
    turn_modes_back(modes, profile, light, pull, gradient)
    by_slices = double_pass_adjoint(slices, light, pull)
    np.testing.assert_allclose(gradient, np.einsum("nk,nsp->skp", profile, by_slices), atol=1e-12)


def test_places_of_little_retardance_take_fewer_slices_as_exactly_as_stated() -> None:
    rng, slices = np.random.default_rng(8), 32
    depth = np.linspace(-1, 1, slices)
    profile = np.ascontiguousarray(np.polynomial.legendre.legvander(depth, 2)) / slices
    sizes = np.repeat([0.05, 0.18, 0.35, 0.65, 2.0], 128)
    # half as much turns over the depth as is the same at all depths
    modes = rng.normal(size=(2, 3, len(sizes))) * np.array([1.0, 0.5, 0.25])[:, None]
    single = np.hypot(*np.einsum("nk,skp->snp", profile, modes)).sum(axis=0)
    modes *= sizes / single
    stack = np.einsum("nk,skp->nsp", profile, modes)
    light, gradient = np.empty((3, len(sizes))), np.empty_like(modes)
    turn_modes(modes, profile, light)
    exact = double_pass(stack)
    off = np.abs(light - exact).max(axis=0).reshape(5, -1).max(axis=1)
    assert (off[:4] > 1e-12).all()
    assert (off < STATED).all()
    assert off[4] < 1e-13
    pull = rng.normal(size=light.shape)
    turn_modes_back(modes, profile, light, pull, gradient)
    by_slices = double_pass_adjoint(stack, exact, pull)
    by_modes = np.einsum("nk,nsp->skp", profile, by_slices)
    assert np.abs(gradient - by_modes).max() < 0.01 * np.abs(by_modes).max()
