"""Rectangular high-order elements whose matrices are products of one-dimensional ones.

On a tensor mesh every element is a rectangle, and its stiffness is built from three matrices on the
unit interval: mass, stiffness and their mixture.  The shape functions are scikit-fem's hierarchical
ones (integrated Legendre polynomials, Szabo and Babuska, Finite Element Analysis, section 6.1); for
order 2 they are Lagrange's, which span the same polynomials.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.polynomial.legendre import legder, legval, legvander
from scipy.sparse import csr_array
from skfem import ElementLineP2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine

from fringeforce.base.arrays import Array, Index
from fringeforce.mechanics.gauss_rule import gauss_rule

Side = Literal["left", "right"]


def shape_functions(order: int, s: Array) -> tuple[Array, Array]:
    """Hierarchical shape functions and their derivatives on the unit interval.

    Parameters
    ----------
    order : int
        Polynomial order, 1 or higher.
    s : ndarray, shape (m,)
        Coordinates in [0, 1].

    Returns
    -------
    values, derivatives : ndarray, shape (order + 1, m)
        Ordered from left to right: the left vertex, the order - 1 bubbles, the right vertex.
    """
    if order == 2:
        pairs = [ElementLineP2().lbasis(s[None], i) for i in (0, 2, 1)]
        return np.array([value for value, _ in pairs]), np.array([slope[0] for _, slope in pairs])
    values, slopes = np.empty((2, order + 1, len(s)))
    values[0], values[-1], slopes[0], slopes[-1] = 1 - s, s, -1.0, 1.0
    # integrals of Legendre's polynomials, whose squared derivatives integrate to 2
    legendre, n = legvander(2 * s - 1, order).T, np.arange(2, order + 1)[:, None]
    values[1:-1] = (legendre[2:] - legendre[:-2]) / np.sqrt(2 * (2 * n - 1))
    slopes[1:-1] = np.sqrt(2 * (2 * n - 1)) * legendre[1:-1]
    return values, slopes


def gauss_line(order: int, breaks: Array) -> tuple[Array, Array]:
    """Gauss points of elements of an order side by side, and their weights, shapes (m,) [m].

    Parameters
    ----------
    order : int
        Polynomial order; every element has one point more.
    breaks : ndarray, shape (elements + 1,)
        Boundaries of the elements, ascending [m].
    """
    nodes, weights = gauss_rule(order + 1)
    step = np.diff(breaks)[:, None]
    return (breaks[:-1, None] + step * (nodes + 1) / 2).ravel(), (step * weights / 2).ravel()


@dataclass(frozen=True)
class Interval:
    """Integrals of the shape functions over the unit interval; f is a shape, f' its derivative."""

    mass: Array  #: int f_i f_j, shape (order + 1, order + 1)
    stiffness: Array  #: int f_i' f_j'
    mixed: Array  #: int f_i' f_j
    mean: Array  #: int f_i, shape (order + 1,)


@cache
def interval(order: int) -> Interval:
    """The matrices of one order, integrated exactly."""
    points, weights = get_quadrature(RefLine, 2 * order)
    value, slope = shape_functions(order, points[0])
    return Interval(
        mass=(value * weights) @ value.T,
        stiffness=(slope * weights) @ slope.T,
        mixed=(slope * weights) @ value.T,
        mean=value @ weights,
    )


def element_stiffness(order: int, aspect: Array, c11: Array, c12: Array) -> Array:
    """Stiffness per unit width of rectangular elements: the weak form of plane elasticity.

    The energy is  c11 (eps_x^2 + eps_z^2) / 2 + c12 eps_x eps_z + shear gamma_xz^2 / 2, with
    eps_x = du/dx, eps_z = dw/dz and gamma_xz = du/dz + dw/dx.

    Parameters
    ----------
    order : int
        Polynomial order in both directions.
    aspect, c11, c12 : ndarray, shape (e,)
        Height over width, on which alone the geometry acts, and moduli [Pa] of every element.

    Returns
    -------
    ndarray, shape (e, 2 m, 2 m) with m = (order + 1)^2
        Unknowns run over (component u or w, shape along x, shape along z).
    """
    line, m = interval(order), (order + 1) ** 2
    shear = (c11 - c12) / 2
    along_x = np.kron(line.stiffness, line.mass)
    along_z = np.kron(line.mass, line.stiffness)
    cross = np.kron(line.mixed, line.mixed.T)
    aspect, stiff, coupling, shear = (c[:, None, None] for c in (aspect, c11, c12, shear))
    k = np.empty((len(c11), 2, m, 2, m))
    k[:, 0, :, 0] = stiff * aspect * along_x + shear / aspect * along_z
    k[:, 1, :, 1] = stiff / aspect * along_z + shear * aspect * along_x
    k[:, 0, :, 1] = coupling * cross + shear * cross.T
    k[:, 1, :, 0] = k[:, 0, :, 1].transpose(0, 2, 1)
    return k.reshape(len(c11), 2 * m, 2 * m)


def interpolation(
    order: int, breaks: Array, points: Array, side: Side = "left"
) -> tuple[csr_array, csr_array]:
    """Values and slopes of a line of elements, as matrices on its coefficients.

    Parameters
    ----------
    order : int
        Polynomial order.
    breaks : ndarray, shape (e + 1,)
        Element boundaries, ascending [m].
    points : ndarray, shape (m,)
        Where to evaluate [m].
    side : "left" or "right"
        The element to which a point on a boundary counts.

    Returns
    -------
    values, slopes : sparse array, shape (m, order * e + 1)
        Applied to coefficients they give the function and its derivative [1/m].
    """
    element, fraction = located(breaks, points, side)
    values, slopes = shape_functions(order, fraction)
    first, unknowns = element * order, order * (len(breaks) - 1) + 1
    return (
        _banded(first, values.T, unknowns),
        _banded(first, slopes.T / np.diff(breaks)[element, None], unknowns),
    )


def second_slopes(order: int, breaks: Array, points: Array) -> csr_array:
    """Second derivatives of a line of elements at points of it; as of `interpolation` [1/m^2]."""
    element, fraction = located(breaks, points)
    bends = np.zeros((order + 1, len(points)))
    if order == 2:
        bends[:] = [[4.0], [-8.0], [4.0]]
    else:
        n = np.arange(2, order + 1)
        # of the bubbles' slopes, which are Legendre's polynomials
        size = 2 * np.sqrt(2 * (2 * n - 1))
        rising = legval(2 * fraction - 1, legder(np.eye(order)))[1:]
        bends[1:-1] = size[:, None] * rising
    length = np.diff(breaks)[element, None]
    return _banded(element * order, bends.T / length**2, order * (len(breaks) - 1) + 1)


def gauss_interpolation(order: int, breaks: Array, points: Array) -> csr_array:
    """Carry values at each element's Gauss points to any point, by polynomials.

    Parameters
    ----------
    order : int
        Gauss points in every element; they define a polynomial of degree order - 1.
    breaks : ndarray, shape (e + 1,)
        Element boundaries, ascending [m].
    points : ndarray, shape (m,)
        Where to evaluate [m].

    Returns
    -------
    sparse array, shape (m, order * e)
        Applied to values at the Gauss points of all elements it gives those at the points.
    """
    element, fraction = located(breaks, points)
    return _banded(element * order, _from_gauss(order, fraction), order * (len(breaks) - 1))


def _from_gauss(order: int, fraction: Array) -> Array:
    """Weights of an element's values at Gauss points, at places within it, shape (m, order)."""
    at_gauss = legvander(gauss_rule(order)[0], order - 1)
    return legvander(2 * fraction - 1, order - 1) @ np.linalg.inv(at_gauss)


def each_at(order: int, breaks: Array, functions: Array, points: Array) -> tuple[Array, Array]:
    """Values and slopes of functions, each at points of its own.

    Parameters
    ----------
    order, breaks
        Of the line of elements, as of `interpolation`.
    functions : ndarray, shape (order * e + 1, k)
        Coefficients of each.
    points : ndarray, shape (m, k)
        Where to evaluate each [m].

    Returns
    -------
    values, slopes : ndarray, shape (m, k)
        Slopes per metre.
    """
    element, fraction = located(breaks, points)
    value, slope = (
        _gathered(functions, element * order, part.reshape(-1, *points.shape))
        for part in shape_functions(order, fraction.ravel())
    )
    return value, slope / np.diff(breaks)[element]


def each_from_gauss(order: int, breaks: Array, stations: Array, points: Array) -> Array:
    """Carry values at Gauss points of functions each to points of its own, shape (m, k).

    Parameters
    ----------
    order, breaks
        As of `gauss_interpolation`.
    stations : ndarray, shape (order * e, k)
        Values of each function.
    points : ndarray, shape (m, k)
        Where to evaluate each [m].
    """
    element, fraction = located(breaks, points)
    weights = _from_gauss(order, fraction.ravel()).T.reshape(-1, *points.shape)
    return _gathered(stations, element * order, weights)


def _gathered(functions: Array, first: Index, weights: Array) -> Array:
    """Sums of weights (w, m, k) times what stands in column k from row first (m, k) on."""
    column, found = np.arange(functions.shape[1]), np.zeros(first.shape)
    for i, weight in enumerate(weights):
        found += weight * functions[first + i, column]
    return found


def integrals(order: int, breaks: Array) -> Array:
    """Integrals of the shape functions over a line of elements, shape (order * e + 1,) [m].

    Parameters
    ----------
    order : int
        Polynomial order.
    breaks : ndarray, shape (e + 1,)
        Element boundaries, ascending [m].
    """
    result = np.zeros(order * (len(breaks) - 1) + 1)
    for element, length in enumerate(np.diff(breaks)):
        result[element * order : (element + 1) * order + 1] += length * interval(order).mean
    return result


def along(matrix: csr_array, values: Array, axis: int = 0) -> Array:
    """A matrix applied along one axis of an array of any dimension."""
    axis %= values.ndim
    before, after = range(axis), range(axis + 1, values.ndim)
    moved = values.transpose(axis, *before, *after)
    result = (matrix @ moved.reshape(len(moved), -1)).reshape(-1, *moved.shape[1:])
    return result.transpose(*range(1, axis + 1), 0, *after)


def _banded(first: Index, weights: Array, columns: int) -> csr_array:
    """Sparse matrix whose row i holds weights[i] from column first[i] on."""
    rows, width = weights.shape
    index = first[:, None] + np.arange(width)
    starts = np.arange(0, rows * width + 1, width)
    return csr_array((weights.ravel(), index.ravel(), starts), shape=(rows, columns))


def located(breaks: Array, points: Array, side: Side = "left") -> tuple[Index, Array]:
    """Element of each point and its place within, 0 to 1."""
    element = np.clip(np.searchsorted(breaks, points, side=side) - 1, 0, len(breaks) - 2)
    return element, (points - breaks[element]) / np.diff(breaks)[element]
