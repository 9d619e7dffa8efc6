"""Element matrices: rigid motions cost nothing, uniform strains what the textbook says."""

import numpy as np
import pytest

from fringeforce.mechanics.elements import (
    element_stiffness,
    gauss_interpolation,
    interpolation,
    interval,
    shape_functions,
)

C11, C12, WIDTH, HEIGHT = 7.0, 3.0, 2.0, 0.5


def linear_field(order: int, ux: float, uz: float, wx: float, wz: float) -> np.ndarray:
    """Coefficients of u = ux x + uz z, w = wx x + wz z on one element."""
    ones, line = np.ones(order + 1), np.linspace(0, 1, order + 1)
    values = shape_functions(order, line)[0].T
    constant, slope = np.linalg.solve(values, ones), np.linalg.solve(values, line)
    x, z = np.outer(WIDTH * slope, constant), np.outer(constant, HEIGHT * slope)
    return np.stack([ux * x + uz * z, wx * x + wz * z]).ravel()


@pytest.mark.parametrize("order", [1, 2, 5, 7])
@pytest.mark.parametrize(
    ("gradient", "density"),
    [
        ((0, 1, -1, 0), 0.0),  # a rotation
        ((1, 0, 0, 0), C11 / 2),
        ((0, 0, 0, 1), C11 / 2),
        ((1, 0, 0, 1), C11 + C12),
        ((0, 1, 1, 0), (C11 - C12) / 2 / 2 * 4),
    ],
)
def test_the_energy_of_a_uniform_strain(order, gradient, density) -> None:
    stiffness = element_stiffness(
        order, np.array([HEIGHT / WIDTH]), np.array([C11]), np.array([C12])
    )[0]
    field = linear_field(order, *gradient)
    assert field @ stiffness @ field / 2 == pytest.approx(density * WIDTH * HEIGHT, abs=1e-12)


@pytest.mark.parametrize("order", [1, 3, 7])
def test_only_rigid_motions_cost_nothing(order: int) -> None:
    stiffness = element_stiffness(order, np.array([0.3]), np.array([C11]), np.array([C12]))[0]
    energies = np.linalg.eigvalsh(stiffness)
    assert (np.abs(energies[:3]) < 1e-10).all()
    assert energies[3] > 1e-6


@pytest.mark.parametrize("order", [1, 2, 4, 7])
def test_slopes_are_the_derivatives_of_shapes(order: int) -> None:
    s, h = np.linspace(0.1, 0.9, 9), 1e-6
    numeric = (shape_functions(order, s + h)[0] - shape_functions(order, s - h)[0]) / (2 * h)
    np.testing.assert_allclose(shape_functions(order, s)[1], numeric, atol=1e-7)


def test_linear_elements_have_the_textbook_matrices() -> None:
    line = interval(1)
    np.testing.assert_allclose(line.mass, [[1 / 3, 1 / 6], [1 / 6, 1 / 3]])
    np.testing.assert_allclose(line.stiffness, [[1, -1], [-1, 1]])
    np.testing.assert_allclose(line.mean, [0.5, 0.5])


@pytest.mark.parametrize("order", [2, 5])
def test_interpolation_keeps_polynomials(order: int) -> None:
    breaks, points = np.array([-1.0, 0.5, 2.0]), np.linspace(-1, 2, 31)
    gauss = (np.polynomial.legendre.leggauss(order)[0] + 1) / 2
    stations = (breaks[:-1, None] + np.diff(breaks)[:, None] * gauss).ravel()
    carried = gauss_interpolation(order, breaks, points) @ stations ** (order - 1)
    np.testing.assert_allclose(carried, points ** (order - 1), atol=1e-11)


def test_values_and_slopes_of_a_line_are_those_of_its_function() -> None:
    breaks, points = np.array([0.0, 1.0, 3.0]), np.array([0.0, 0.25, 1.0, 1.7, 3.0])
    coefficients = np.array([0.0, 1, 2.0, 4, 6.0])  # of 2 x, at the nodes of quadratic elements
    values, slopes = interpolation(2, breaks, points)
    np.testing.assert_allclose(values @ coefficients, 2 * points)
    np.testing.assert_allclose(slopes @ coefficients, 2)
