"""Shape functions and element matrices against polynomials and scikit-fem's own elements."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from skfem import Basis, ElementQuad2, ElementQuadP, ElementVector, MeshQuad
from skfem.models.elasticity import linear_elasticity

from fringeforce.mechanics.elements import (
    each_at,
    each_from_gauss,
    element_stiffness,
    gauss_interpolation,
    interpolation,
    interval,
    second_slopes,
    shape_functions,
)

Array = NDArray[np.float64]
ORDERS = [1, 2, 3, 4, 7, 10]
SHEAR, LAME = 0.7, 1.9
C11, C12 = np.array([LAME + 2 * SHEAR]), np.array([LAME])


def _coefficients(order: int, function: Polynomial) -> Array:
    """Of the shape functions, such that they add up to a polynomial of their degree."""
    s = np.linspace(0, 1, order + 1)
    weights = np.linalg.solve(shape_functions(order, s)[0].T, function(s))
    return np.asarray(weights, dtype=np.float64)


def _field(order: int, u: tuple, w: tuple) -> Array:
    """Element coefficients of displacements that are products of polynomials in x and z."""
    products = [np.outer(_coefficients(order, fx), _coefficients(order, fz)) for fx, fz in (u, w)]
    return np.array(products).ravel()


ONE, S = Polynomial([1.0]), Polynomial([0.0, 1.0])
NIL = (0 * ONE, ONE)


def _by_scikit_fem(order: int, width: float, height: float) -> Array:
    basis = Basis(
        MeshQuad.init_tensor(np.array([0, width]), np.array([0, height])),
        ElementVector(ElementQuad2() if order == 2 else ElementQuadP(order)),
        intorder=2 * order,
    )
    return linear_elasticity(LAME, SHEAR).assemble(basis).toarray()


@pytest.mark.parametrize("order", ORDERS)
def test_each_end_belongs_to_its_vertex_function_alone(order: int) -> None:
    ends = np.zeros((order + 1, 2))
    ends[0, 0] = ends[-1, 1] = 1
    np.testing.assert_allclose(shape_functions(order, np.array([0.0, 1.0]))[0], ends, atol=1e-14)


@pytest.mark.parametrize("order", ORDERS)
def test_some_of_the_shape_functions_share_one_everywhere(order: int) -> None:
    share = slice(None) if order == 2 else slice(None, None, order)  # order 2 has Lagrange's
    values, slopes = shape_functions(order, np.linspace(0, 1, 9))
    np.testing.assert_allclose(values[share].sum(axis=0), 1, atol=1e-14)
    np.testing.assert_allclose(slopes[share].sum(axis=0), 0, atol=1e-13)


@pytest.mark.parametrize("order", ORDERS)
def test_shape_functions_span_every_polynomial_of_their_order(order: int) -> None:
    function = Polynomial(np.random.default_rng(order).normal(size=order + 1))
    weights, s = _coefficients(order, function), np.linspace(0, 1, 23)
    values, slopes = shape_functions(order, s)
    np.testing.assert_allclose(weights @ values, function(s), rtol=1e-9)
    np.testing.assert_allclose(weights @ slopes, function.deriv()(s), rtol=1e-7, atol=1e-8)


@pytest.mark.parametrize("order", ORDERS)
def test_second_slopes_are_those_of_a_polynomial(order: int) -> None:
    function = Polynomial(np.random.default_rng(order).normal(size=order + 1))
    begin, length = 0.4, 0.25
    weights = np.zeros(2 * order + 1)
    weights[order:] = _coefficients(order, function)
    breaks, s = np.array([0.0, begin, begin + length]), np.linspace(0.05, 1, 7)
    found = second_slopes(order, breaks, begin + length * s) @ weights
    expected = function.deriv(2)(s) / length**2
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("order", ORDERS)
def test_interval_matrices_integrate_polynomials_exactly(order: int) -> None:
    rng = np.random.default_rng(order)
    f, g = Polynomial(rng.normal(size=order + 1)), Polynomial(rng.normal(size=order + 1))
    a, b, line = _coefficients(order, f), _coefficients(order, g), interval(order)
    found = [a @ line.mass @ b, a @ line.stiffness @ b, a @ line.mixed @ b, a @ line.mean]
    integrands = [f * g, f.deriv() * g.deriv(), f.deriv() * g, f]
    np.testing.assert_allclose(found, [i.integ()(1.0) for i in integrands], rtol=1e-8)


@pytest.mark.parametrize("order", [1, 2, 3, 5])
def test_an_elements_stiffness_is_scikit_fems(order: int) -> None:
    width, height = 0.8, 0.3
    found = element_stiffness(order, np.array([height / width]), C11, C12)[0]
    expected = np.linalg.eigvalsh(_by_scikit_fem(order, width, height))
    np.testing.assert_allclose(np.linalg.eigvalsh(found), expected, atol=1e-11 * expected[-1])


def test_an_elements_energy_is_the_integral_over_its_strains() -> None:
    width, height = 1.7, 0.6
    u, w = (S**2, 1 - S), (1 + S, S**3)
    x, weight = (
        (np.polynomial.legendre.leggauss(8)[0] + 1) / 2,
        (np.polynomial.legendre.leggauss(8)[1] / 2),
    )
    X, Z = np.meshgrid(x, x, indexing="ij")
    strain_x, strain_z = 2 * X * (1 - Z) / width, (1 + X) * 3 * Z**2 / height
    slide = -(X**2) / height + Z**3 / width
    density = C11 * (strain_x**2 + strain_z**2) + 2 * C12 * strain_x * strain_z + SHEAR * slide**2
    expected = width * height * weight @ density @ weight
    field = _field(3, u, w)
    stiffness = element_stiffness(3, np.array([height / width]), C11, C12)[0]
    assert field @ stiffness @ field == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("order", ORDERS)
def test_rigid_motions_and_they_alone_cost_no_energy(order: int) -> None:
    width, height = 2.0, 0.5
    stiffness = element_stiffness(order, np.array([height / width]), C11, C12)[0]
    rigid = [
        _field(order, (ONE, ONE), NIL),
        _field(order, NIL, (ONE, ONE)),
        _field(order, (ONE, height * S), (-width * S, ONE)),
    ]
    np.testing.assert_allclose(stiffness @ np.array(rigid).T, 0, atol=1e-11)
    values = np.linalg.eigvalsh(stiffness)
    np.testing.assert_allclose(stiffness, stiffness.T, atol=1e-13)
    assert values[2] < 1e-11 * values[-1] < 1e-6 * values[-1] < values[3]


@pytest.mark.parametrize("order", [1, 2, 3, 5])
def test_an_irregular_patch_carries_uniform_strain_without_inner_forces(order: int) -> None:
    breaks_x, breaks_z = np.array([0, 0.3, 1.0]), np.array([0, 0.9, 1.1])
    lines = 2 * order + 1
    grid = np.arange(2 * lines**2).reshape(2, lines, lines)
    forces, field = np.zeros(grid.size), np.zeros(grid.size)
    for i, width in enumerate(np.diff(breaks_x)):
        for j, height in enumerate(np.diff(breaks_z)):
            here = grid[:, i * order : (i + 1) * order + 1, j * order : (j + 1) * order + 1]
            x, z = breaks_x[i] + width * S, breaks_z[j] + height * S
            stretch, slide = _field(order, (x, ONE), NIL), _field(order, (ONE, z), NIL)
            local = 0.4 * stretch + 1.3 * slide - 0.2 * _field(order, NIL, (ONE, z))
            stiffness = element_stiffness(order, np.array([height / width]), C11, C12)[0]
            field[here.ravel()] = local
            forces[here.ravel()] += stiffness @ local
    inner = grid[:, 1:-1, 1:-1].ravel()
    assert np.abs(forces).max() > 0.1
    np.testing.assert_allclose(forces[inner], 0, atol=1e-12)


BREAKS = np.array([-1.0, -0.7, 0.4, 0.5])


@pytest.mark.parametrize("order", ORDERS)
def test_a_line_of_elements_reproduces_a_straight_line_and_its_slope(order: int) -> None:
    coefficients = np.zeros(order * 3 + 1)
    for i, (left, width) in enumerate(zip(BREAKS, np.diff(BREAKS), strict=False)):
        here = slice(i * order, (i + 1) * order + 1)
        coefficients[here] = _coefficients(order, 2 - 3 * (left + width * S))
    points = np.linspace(-1, 0.5, 31)
    values, slopes = interpolation(order, BREAKS, points)
    np.testing.assert_allclose(values @ coefficients, 2 - 3 * points, atol=1e-13)
    np.testing.assert_allclose(slopes @ coefficients, -3, atol=1e-11)


@pytest.mark.parametrize("order", ORDERS)
def test_gauss_points_carry_polynomials_of_one_degree_less_anywhere(order: int) -> None:
    function = Polynomial(np.random.default_rng(order).normal(size=order))
    gauss = (np.polynomial.legendre.leggauss(order)[0] + 1) / 2
    stations = (BREAKS[:-1, None] + np.diff(BREAKS)[:, None] * gauss).ravel()
    points = np.linspace(-1, 0.5, 31)
    found = gauss_interpolation(order, BREAKS, points) @ function(stations)
    np.testing.assert_allclose(found, function(points), atol=1e-11)


@pytest.mark.parametrize("order", ORDERS)
def test_functions_are_found_each_at_points_of_its_own(order: int) -> None:
    rng, width = np.random.default_rng(order), np.diff(BREAKS)
    degree = Polynomial(rng.normal(size=order + 1)), Polynomial(rng.normal(size=order + 1))
    lower = Polynomial(rng.normal(size=order)), Polynomial(rng.normal(size=order))
    points = rng.uniform(-1, 0.5, (31, 2))
    coefficients = np.zeros((order * 3 + 1, 2))
    for k, function in enumerate(degree):
        for i, left in enumerate(BREAKS[:-1]):
            own = function(Polynomial([left, width[i]]))
            coefficients[i * order : (i + 1) * order + 1, k] = _coefficients(order, own)
    gauss = (np.polynomial.legendre.leggauss(order)[0] + 1) / 2
    stations = (BREAKS[:-1, None] + width[:, None] * gauss).ravel()
    values, slopes = each_at(order, BREAKS, coefficients, points)
    carried = np.column_stack([function(stations) for function in lower])
    found = each_from_gauss(order, BREAKS, carried, points)
    for k in range(2):
        np.testing.assert_allclose(values[:, k], degree[k](points[:, k]), atol=1e-10)
        np.testing.assert_allclose(slopes[:, k], degree[k].deriv()(points[:, k]), atol=1e-8)
        np.testing.assert_allclose(found[:, k], lower[k](points[:, k]), atol=1e-11)
