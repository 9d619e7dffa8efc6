"""The frames' loss to second order in corrections of the columns and in all that goes with them.

The phase is linear in the columns, so that Gauss and Newton's method on grey levels needs, of F
frames and P pixels, only the information on the matrix of every pixel, shape (P, 2n, 2n).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from fringeforce.base.arrays import Array
from fringeforce.calibration.columns.prior import Shapes
from fringeforce.calibration.design_jacobian import DesignJacobian
from fringeforce.calibration.light.fixed_pattern_noise import FixedPatternNoise, eliminated
from fringeforce.calibration.measurements import Measurements, Unknowns
from fringeforce.calibration.normal_equations import NormalEquations, linearised


@dataclass(frozen=True, eq=False)
class Quadratic:
    """Half the loss to second order in U unknowns u and all coefficients c of the columns.

    The unknowns are the m shared ones and every frame's own gain and offset; the pixels' pattern
    is free.

    Attributes
    ----------
    normal : NormalEquations
        The frames without the columns.
    gradient, hessian : ndarray, shapes (U,) and (U, U)
        By the unknowns.
    column_gradient : ndarray, shape (4n K,)
        Gradient by the coefficients.
    cross : ndarray, shape (U, 4n K)
        Mixed Hessian.
    information : ndarray, shape (4n K, 4n K)
        Hessian by the coefficients.
    """

    normal: NormalEquations
    gradient: Array
    hessian: Array
    column_gradient: Array
    cross: Array
    information: Array

    def gain(self, step: Array, change: Array) -> float:
        """Squared length of a step (U,), (4n K,) in units of what the frames can tell."""
        own = step @ self.hessian @ step + change @ self.information @ change
        return float(own + 2 * step @ self.cross @ change)


def expanded(
    measured: Measurements, at: Unknowns, jacobian: DesignJacobian, possible: Shapes, weight: Array
) -> Quadratic:
    """Expand half the loss about unknowns and corrected columns.

    Parameters
    ----------
    measured : Measurements
        Frames to use.
    at : Unknowns
        Where to expand.
    jacobian : DesignJacobian
        With the corrected columns.
    possible : Shapes
        Corrections.
    weight : ndarray, shape (P,)
        Weights of the pixels.
    """
    normal = linearised(measured, at, jacobian, weight)
    by_pixel = _by_pixel(measured, normal)
    if measured.pattern is not None:
        by_pixel = _without_pattern(by_pixel, measured.pattern)
    columns = possible.at(at.positions(measured.sensor))
    doubled = np.tile(np.arange(measured.loads.shape[1]), 2)  # a column's height and its place
    information = by_pixel.information[:, doubled][:, :, doubled]
    return replace(
        by_pixel,
        column_gradient=columns.adjoint(by_pixel.column_gradient).ravel(),
        cross=np.array([columns.adjoint(rows).ravel() for rows in by_pixel.cross]),
        information=_information(
            information * columns.sizes[:, :, None] * columns.sizes[:, None, :],
            columns.splines,
            possible.count,
        ),
    )


def pattern_after(
    measured: Measurements, normal: NormalEquations, step: Array, correction: Array, share: float
) -> Measurements:
    """The measurements with a share of the step of its pattern that goes with one of all else.

    Parameters
    ----------
    measured : Measurements
        Before.
    normal : NormalEquations
        The frames that the step is made from.
    step : ndarray, shape (U,)
        Step of the other unknowns.
    correction : ndarray, shape (P, 2n)
        Correction of the matrix [rad/N].
    share : float
        Share of the step.
    """
    pattern = measured.pattern
    if pattern is None:
        return measured
    by_matrix = normal.by_matrix(normal.jacobian.lit)
    moved = np.einsum("pua,u->ap", normal.coupling, step)
    moved += np.einsum("apj,pj->ap", by_matrix, correction)
    aim = pattern.improved(normal.pixel_gradient + moved, normal.pixels).levels
    levels = pattern.levels + share * (aim - pattern.levels)
    return replace(measured, pattern=replace(pattern, levels=levels))


def _by_pixel(measured: Measurements, normal: NormalEquations) -> Quadratic:
    """Derivatives by the matrix of every pixel instead of coefficients, with the pattern fixed.

    Shapes of the last three: (P, 2n), (U, P, 2n) and (P, 2n, 2n).
    """
    jacobian, predicted = normal.jacobian, normal.predicted
    loads, heavy = jacobian.loads, normal.weights * jacobian.turn
    pairs = (loads[:, :, None] * loads[:, None, :]).reshape(len(loads), -1)
    information = ((heavy * jacobian.turn).T @ pairs).reshape(-1, *[loads.shape[1]] * 2)
    cross = [np.einsum("pij,pj->pi", information, change) for change in jacobian.changes]
    cross += [
        rows * shape[:, None]
        for rows in normal.by_matrix(jacobian.lit)
        for shape in measured.basis.T
    ]
    cross += [
        np.outer(heavy[frame] * shift[frame], loads[frame])
        for frame in range(predicted.shifts.shape[1])
        for shift in predicted.shifts
    ]
    # frames' own light is where it is likeliest already
    still = np.zeros(normal.side.shape[1])
    return Quadratic(
        normal=normal,
        gradient=np.concatenate([normal.gradient, still]),
        hessian=normal.whole,
        column_gradient=normal.by_matrix(predicted.residuals),
        cross=np.array(cross),
        information=information,
    )


def _without_pattern(fixed: Quadratic, pattern: FixedPatternNoise) -> Quadratic:
    """Derivatives by the matrix of every pixel with the pattern free."""
    normal = fixed.normal
    pixels = pattern.information(normal.pixels)
    pixel_gradients = normal.pixel_gradient + pattern.precision * (pattern.levels - pattern.known)
    by_matrix = np.swapaxes(normal.by_matrix(normal.jacobian.lit), 0, 1)
    told = np.linalg.solve(pixels, by_matrix)
    wanted = np.linalg.solve(pixels, pixel_gradients.T[..., None])[..., 0]
    return replace(
        fixed,
        gradient=fixed.gradient - np.einsum("pua,pa->u", normal.coupling, wanted),
        hessian=eliminated(fixed.hessian, normal.coupling, pixels),
        column_gradient=fixed.column_gradient - np.einsum("paj,ap->pj", told, pixel_gradients),
        cross=fixed.cross - np.moveaxis(normal.coupling @ told, 1, 0),
        information=fixed.information - np.swapaxes(by_matrix, 1, 2) @ told,
    )


def _information(matrix: Array, splines: csr_array, count: int) -> Array:
    """Sum over pixels of the matrix (P, m, m) times all products of two of K splines (P, K)."""
    pixels, columns, _ = matrix.shape
    width = splines.nnz // pixels
    near = np.asarray(splines.indices).reshape(pixels, width)
    values = np.asarray(splines.data).reshape(pixels, width)
    products = (values[:, :, None] * values[:, None, :]).ravel()
    places = (near[:, :, None] * count + near[:, None, :]).ravel()
    starts = np.arange(0, len(places) + 1, width**2)
    both = csr_array((products, places, starts), shape=(pixels, count**2))
    total = (both.T @ matrix.reshape(pixels, -1)).reshape(count, count, columns, columns)
    return total.transpose(2, 0, 3, 1).reshape(columns * count, -1)
