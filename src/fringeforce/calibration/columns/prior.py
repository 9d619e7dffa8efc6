"""Smooth corrections of influence columns, and how large the frames themselves say they are.

A column may be wrong in height and in place: it is corrected by itself times one smooth function,
and by its slope times another.  Far from its tactel, where it vanishes, nothing is invented.  The
functions are Gaussian processes along the strip, written in cubic B-splines; their size, their
length and which of the two there are, are those under which the frames are most probable (MacKay,
Neural Computation 4, 415-447, 1992).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import BSpline, CubicSpline
from scipy.optimize import minimize_scalar
from scipy.sparse import csr_array

from fringeforce.base.arrays import Array
from fringeforce.base.linear_map import LinearMap
from fringeforce.calibration.design_jacobian import DesignJacobian
from fringeforce.design.strip import Sensor

DEGREE = 3
PER_DEPTH = 4
"""Splines per thickness of the strip, over which stresses are smooth."""
LENGTHS = np.geomspace(0.25, 8.0, 11)
"""Correlation lengths that are tried, in units of the strip's thickness."""
MIDDLE = (4, 0)
"""Length and kind that are tried first."""
KINDS = ((0,), (0, 1), (1,))
"""Which errors are tried: of height, of both, and of place."""
SIZES = np.geomspace(1e-5, 1.0, 51)
"""Relative errors that are tried first."""
NEGLIGIBLE = 1e-7
"""Share of the prior's variance in directions that are left out."""


@dataclass(frozen=True, eq=False)
class ColumnCorrection(LinearMap):
    """From coefficients (4n, K) of the splines to what they add to the columns, (m, 2n) [rad/N].

    Attributes
    ----------
    sizes : ndarray, shape (m, 4n)
        What the splines multiply: the columns, then their slopes [rad/N].
    splines : sparse array, shape (m, K)
        Values of the splines.
    """

    sizes: Array
    splines: csr_array

    @property
    def shapes(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Shapes of the coefficients and of the columns."""
        (m, doubled), k = self.sizes.shape, self.splines.shape[1]  # pyright: ignore[reportOptionalSubscript]
        return (doubled, k), (m, doubled // 2)

    def forward(self, values: Array) -> Array:
        """What coefficients (..., 4n, K) add to the columns, shape (..., m, 2n)."""
        errors = values @ self.splines.T.toarray()
        both = self.sizes * np.swapaxes(errors, -1, -2)
        return both.reshape(*both.shape[:-1], 2, -1).sum(axis=-2)

    def adjoint(self, values: Array) -> Array:
        """Derivatives by the coefficients, from those by the columns (m, 2n)."""
        return (self.splines.T @ (self.sizes * np.tile(values, 2))).T


@dataclass(frozen=True, eq=False)
class Shapes:
    """The corrections that are possible.

    Attributes
    ----------
    parts : CubicSpline
        Every column along the strip and its slope scaled to the same size, (m, 2, 2n) [rad/N].
    knots : ndarray
        Knots of the cubic splines [m].
    depth : float
        Thickness of the strip [m].
    """

    parts: CubicSpline
    knots: Array
    depth: float

    @property
    def count(self) -> int:
        """Splines along the strip, K."""
        return len(self.knots) - DEGREE - 1

    def at(self, x: ArrayLike) -> ColumnCorrection:
        """What coefficients do at some places; those beyond the strip count as its ends."""
        inside = np.clip(x, self.knots[0], self.knots[-1])
        sizes = np.asarray(self.parts(inside), dtype=float)
        splines = BSpline.design_matrix(inside, self.knots, DEGREE)
        return ColumnCorrection(sizes.reshape(len(sizes), -1), csr_array(splines))

    def correction(self, coefficients: Array, x: ArrayLike) -> Array:
        """What coefficients (..., 4n, K) add to the columns, shape (..., m, 2n) [rad/N]."""
        return self.at(x).forward(coefficients)

    def root(self, length: float) -> Array:
        """A root L of the splines' prior covariance L L' for unit size, shape (K, r)."""
        centres = np.convolve(self.knots[1:-1], np.ones(DEGREE) / DEGREE, "valid")
        distance = np.sqrt(5) * np.abs(np.subtract.outer(centres, centres)) / length
        # Matern's kernel of order 5/2: smooth, but not blind to waves shorter than its length
        kernel = (1 + distance + distance**2 / 3) * np.exp(-distance)
        variances, directions = np.linalg.eigh(kernel)
        kept = variances > NEGLIGIBLE * variances[-1]
        return directions[:, kept] * np.sqrt(variances[kept])


def shapes(sensor: Sensor, jacobian: DesignJacobian, design: Array) -> Shapes:
    """The corrections of a design's columns.

    Parameters
    ----------
    sensor : Sensor
        The drawing.
    jacobian : DesignJacobian
        The matrix about a design near the one in question.
    design : ndarray, shape (d,)
        Logarithms of its values over those of the drawing.
    """
    transducer, grid = sensor.transducer, jacobian.spline.x
    depth = transducer.compliant.thickness + transducer.photoelastic.thickness
    columns, slopes = (jacobian.matrix(design, grid, slope=slope) for slope in (False, True))
    slopes = slopes * np.sqrt((columns**2).sum(axis=0) / (slopes**2).sum(axis=0))
    intervals = int(np.ceil(PER_DEPTH * transducer.length / depth))
    knots = np.linspace(grid[0], grid[-1], intervals + 1)
    ends = np.full(DEGREE, grid[0]), np.full(DEGREE, grid[-1])
    parts = CubicSpline(grid, np.stack([columns, slopes], axis=1))
    return Shapes(parts, np.concatenate([ends[0], knots, ends[1]]), depth)


@dataclass(frozen=True, eq=False)
class Posterior:
    """The corrections after the frames were seen.

    Attributes
    ----------
    choice : (int, int)
        Numbers of the length and of the kind of error among those that are tried.
    size : float
        Relative size of the columns' errors; zero if the frames show none.
    length : float
        Over which the errors are smooth [m].
    evidence : float
        Logarithm of the frames' probability over that without errors.
    mean : ndarray, shape (4n, K)
        Coefficients.
    modes : ndarray, shape (r, 4n, K)
        Modes of the coefficients, whose covariance is the sum of the modes' outer products.
    """

    choice: tuple[int, int]
    size: float
    length: float
    evidence: float
    mean: Array
    modes: Array


def most_probable(
    shapes: Shapes,
    information: Array,
    information_vector: Array,
    first: tuple[int, int],
    explore: bool,
) -> Posterior:
    """Corrections under the prior that makes the frames most probable.

    With c = e R z and z standard normal, frames of information S and pull t on c have the evidence
    sum_i [ e^2 y_i^2 / (1 + e^2 s_i) - ln(1 + e^2 s_i) ] / 2, where s_i are the eigenvalues of
    R' S R and y_i the components of R' t along its eigenvectors.

    Parameters
    ----------
    shapes : Shapes
        Possible corrections.
    information : ndarray, shape (4n K, 4n K)
        Hessian of half the loss, all other unknowns eliminated.
    information_vector : ndarray, shape (4n K,)
        Such that half the loss is c' S c / 2 - t' c.
    first : (int, int)
        Numbers of the length and of the kind that are tried first.
    explore : bool
        Whether to go on to neighbouring lengths and kinds for as long as they are more probable.
    """
    known: dict[tuple[int, int], Posterior] = {}

    def posterior(choice: tuple[int, int]) -> Posterior:
        if choice not in known:
            known[choice] = _posterior(shapes, information, information_vector, choice)
        return known[choice]

    at = first
    while explore:
        near = [at, (at[0] - 1, at[1]), (at[0] + 1, at[1]), (at[0], at[1] - 1), (at[0], at[1] + 1)]
        near = [p for p in near if 0 <= p[0] < len(LENGTHS) and 0 <= p[1] < len(KINDS)]
        best = max(near, key=lambda choice: posterior(choice).evidence)
        if posterior(best).evidence <= posterior(at).evidence:
            break
        at = best
    return posterior(at)


def _posterior(
    shapes: Shapes, information: Array, information_vector: Array, choice: tuple[int, int]
) -> Posterior:
    """The most probable size of one kind of error of one length, and the corrections with it."""
    length, count = float(LENGTHS[choice[0]] * shapes.depth), shapes.count
    rows, root = len(information_vector) // count, shapes.root(length)
    chosen = np.concatenate([np.arange(rows // 2) + kind * rows // 2 for kind in KINDS[choice[1]]])
    blocks = information.reshape(rows, count, rows, count)[chosen][:, :, chosen]
    turned = (information_vector.reshape(rows, count)[chosen] @ root).ravel()
    reduced = np.matmul(root.T, np.matmul(blocks.swapaxes(1, 2), root))
    some = reduced.swapaxes(1, 2).reshape(len(turned), -1)
    values, vectors = np.linalg.eigh(some)
    values, along = np.maximum(values, 0.0), vectors.T @ turned
    size, evidence = _size(values, along)
    mean, modes = np.zeros((rows, count)), np.zeros((len(turned), rows, count))
    if size == 0:
        return Posterior(choice, 0.0, length, 0.0, mean, modes[:0])
    shrink, width = 1 + size**2 * values, root.shape[1]
    mean[chosen] = (vectors @ (size**2 * along / shrink)).reshape(-1, width) @ root.T
    spread = (size * vectors / np.sqrt(shrink)).T.reshape(len(turned), -1, width)
    modes[:, chosen] = spread @ root.T
    return Posterior(choice, size, length, evidence, mean, modes)


def _size(values: Array, along: Array) -> tuple[float, float]:
    """Relative error of the greatest evidence, and that evidence."""

    def evidence(size: float) -> float:
        shrink = 1 + size**2 * values
        return float((size**2 * along**2 / shrink - np.log(shrink)).sum()) / 2

    tried = [evidence(size) for size in SIZES.tolist()]
    top = int(np.argmax(tried))
    if tried[top] <= 0:
        return 0.0, 0.0
    around = np.log(SIZES[max(top - 1, 0)]), np.log(SIZES[min(top + 1, len(SIZES) - 1)])
    found = minimize_scalar(lambda s: -evidence(np.exp(s)), bounds=around, method="bounded")
    return float(np.exp(found.x)), -float(found.fun)
