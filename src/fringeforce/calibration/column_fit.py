"""Corrections of the influence columns from all frames at once, on top of a fitted design.

The phase is linear in the columns, so that Gauss and Newton's method on grey levels needs, of F
frames and P pixels, only the information on the matrix of every pixel, shape (P, 2n, 2n).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fringeforce.calibration import checks
from fringeforce.calibration.column_prior import MIDDLE, Belief, Shapes, most_probable, shapes
from fringeforce.calibration.design_tangent import DesignTangent, followed
from fringeforce.calibration.frame_fit import (
    SHIFT,
    STAGES,
    Bench,
    Fit,
    Unknowns,
    calm,
    frame_weights,
    linearised,
    on_strip,
    phase_and_matrix,
    precision,
    residuals,
    start,
)

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

ROUNDS = 12
"""Largest number of steps."""
REACH = 1.0
"""Change of a phase up to which a step is followed [rad]."""
SETTLED = 0.1
"""Gain of twice the log-likelihood below which a step is the last."""


@dataclass(frozen=True, eq=False)
class ColumnFit:
    """A fit with corrected columns.

    Attributes
    ----------
    fit : Fit
        Design, camera and light; its tangent has the corrected columns.
    sound, kept : ndarray of bool, shapes (P,) and (F,)
        Pixels and frames that were used.
    shapes : Shapes
        What the coefficients mean.
    belief : Belief
        The corrections.
    responses : ndarray, shape (U, r)
        What the other unknowns do in each mode of the corrections.
    own : ndarray, shape (U, U)
        Covariance of the other unknowns for given corrections.
    """

    fit: Fit
    sound: Mask
    kept: Mask
    shapes: Shapes
    belief: Belief
    responses: Array
    own: Array

    def correction(self, x: Array) -> Array:
        """What is added to the columns at some places, shape (m, 2n) [rad/N]."""
        return self.shapes.correction(self.belief.mean, x)

    @property
    def origin(self) -> dict[str, str | int]:
        """How the columns came about, in words and numbers."""
        x = self.shapes.parts.x
        change, columns = self.correction(x), self.fit.tangent.at(x)[0]
        share = np.sqrt((change**2).sum() / (columns**2).sum())
        return {
            "method": "finite elements, calibrated, columns corrected",
            "column correction": f"{share:.2%}, smooth over {1e3 * self.belief.length:.2g} mm",
        }


@dataclass(frozen=True, eq=False)
class Quadratic:
    """Half the loss to second order in all unknowns u and all coefficients c.

    Attributes
    ----------
    slopes : ndarray, shape (F, P)
        Residuals in units of the noise.
    gradient, hessian : ndarray, shapes (U,) and (U, U)
        By the unknowns.
    pull : ndarray, shape (4n K,)
        Gradient by the coefficients.
    cross : ndarray, shape (U, 4n K)
        Mixed Hessian.
    information : ndarray, shape (4n K, 4n K)
        Hessian by the coefficients.
    """

    slopes: Array
    gradient: Array
    hessian: Array
    pull: Array
    cross: Array
    information: Array


def fit_columns(
    bench: Bench, paths: tuple[str, ...], fit: Fit, stuck: Mask, kept: Mask
) -> ColumnFit:
    """Correct the columns of a fitted design, and fit design, camera and light again with them.

    Parameters
    ----------
    bench : Bench
        All frames.
    paths : tuple of str
        Design values.
    fit : Fit
        Of the design.
    stuck : ndarray of bool, shape (P,)
        Pixels that do not follow the light at all.
    kept : ndarray of bool, shape (F,)
        Frames to start with.
    """
    at, tangent = fit.unknowns, fit.tangent
    possible = shapes(bench.sensor, tangent, at.design)
    coefficients = np.zeros((2 * bench.loads.shape[1], possible.count))
    bent, sound, choice = tangent, ~stuck, MIDDLE
    for number in range(ROUNDS):
        limit, explore = STAGES[min(number, len(STAGES) - 1)], number < len(STAGES)
        chosen = kept & calm(bench, at, bent, limit)
        weight = (sound & on_strip(at.positions(bench.sensor), bench.sensor)).astype(float)
        rows = bench.rows(chosen)
        quadratic = expanded(rows, at, bent, possible, weight)
        belief, aim, _, _ = _solved(bench, at, coefficients, quadratic, possible, choice, explore)
        choice = belief.choice
        step, change = aim.flat - at.flat, belief.mean - coefficients
        share = _share(rows, at, bent, possible, (step, change), weight > 0)
        gain = _gain(quadratic, step, change.ravel())
        at, coefficients = at.moved(share * step), coefficients + share * change
        tangent = followed(bench.sensor, paths, at.design, tangent)
        bent = tangent.plus(possible.correction(coefficients, tangent.spline.x))
        before = kept, sound
        if np.isinf(limit):
            left = residuals(bench, at, bent)
            seen = on_strip(at.positions(bench.sensor), bench.sensor)
            kept = ~checks.misfitting_frames(left[:, sound & seen])
            sound = ~stuck & ~(checks.misfitting_pixels(left[kept]) & seen)
            if gain < SETTLED and all(map(np.array_equal, before, (kept, sound))):
                break
    weight = (sound & on_strip(at.positions(bench.sensor), bench.sensor)).astype(float)
    quadratic = expanded(bench.rows(kept), at, bent, possible, weight)
    belief, _, responses, own = _solved(bench, at, coefficients, quadratic, possible, choice, False)
    belief = replace(belief, mean=coefficients)
    final = Fit(at, own + responses @ responses.T, quadratic.slopes, bent)
    return ColumnFit(final, sound, kept, possible, belief, responses, own)


def expanded(
    bench: Bench, at: Unknowns, tangent: DesignTangent, possible: Shapes, weight: Array
) -> Quadratic:
    """Expand half the loss about unknowns and corrected columns.

    Parameters
    ----------
    bench : Bench
        Frames to use.
    at : Unknowns
        Where to expand.
    tangent : DesignTangent
        With the corrected columns.
    possible : Shapes
        Corrections.
    weight : ndarray, shape (P,)
        Of the pixels.
    """
    slopes, gradient, hessian = linearised(bench, at, tangent, weight)
    response, loads = at.response(bench), bench.loads
    phase, parts = phase_and_matrix(bench, at, tangent)
    sigma = np.sqrt(response.variance)
    turn = response.slope(phase) / sigma
    weights = frame_weights(slopes)[:, None] * weight
    pairs = (loads[:, :, None] * loads[:, None, :]).reshape(len(loads), -1)
    count = loads.shape[1]
    matrix = ((weights * turn**2).T @ pairs).reshape(-1, count, count)
    positions = at.positions(bench.sensor)
    sizes, splines = possible.sizes(positions), possible.splines(positions)
    along = tangent.matrix(at.design, positions, slope=True)
    moving = [*parts[1:], along * SHIFT, along * bench.sensor.pixel_positions[:, None]]
    doubled = np.tile(np.arange(count), 2)  # a column's height and its place
    cross = [
        splines.T @ (sizes * np.einsum("pij,pj->pi", matrix, change)[:, doubled])
        for change in moving
    ]
    lit = (np.sin(phase / 2) ** 2 / sigma, np.full_like(phase, 1 / sigma))
    for light in lit:
        seen = sizes * ((weights * turn * light).T @ loads)[:, doubled]
        cross += [splines.T @ (seen * shape[:, None]) for shape in bench.basis.T]
    pull = splines.T @ (sizes * ((weights * turn * slopes).T @ loads)[:, doubled])
    return Quadratic(
        slopes,
        gradient,
        hessian,
        pull.T.ravel(),
        np.array([block.T.ravel() for block in cross]),
        _information(
            matrix[:, doubled][:, :, doubled] * sizes[:, :, None] * sizes[:, None, :],
            splines,
            possible.count,
        ),
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


def _solved(
    bench: Bench,
    at: Unknowns,
    coefficients: Array,
    quadratic: Quadratic,
    possible: Shapes,
    first: tuple[int, int],
    explore: bool,
) -> tuple[Belief, Unknowns, Array, Array]:
    """Belief in the corrections, the other unknowns with it, their responses and own covariance."""
    prior, origin = precision(bench, len(at.design)), start(bench, len(at.design)).flat
    own = np.asarray(np.linalg.inv(quadratic.hessian + np.diag(prior)), dtype=float)
    here = coefficients.ravel()
    wanted = quadratic.hessian @ at.flat + quadratic.cross @ here - quadratic.gradient
    wanted += prior * origin
    pull = quadratic.information @ here + quadratic.cross.T @ at.flat - quadratic.pull
    eliminated = own @ quadratic.cross
    belief = most_probable(
        possible,
        quadratic.information - quadratic.cross.T @ eliminated,
        pull - eliminated.T @ wanted,
        first,
        explore,
    )
    aim = own @ wanted - eliminated @ belief.mean.ravel()
    responses = -eliminated @ belief.modes.reshape(len(belief.modes), len(here)).T
    return belief, at.moved(aim - at.flat), responses, own


def _share(
    bench: Bench,
    at: Unknowns,
    tangent: DesignTangent,
    possible: Shapes,
    step: tuple[Array, Array],
    used: Mask,
) -> float:
    """Share of a step that turns no used phase by more than REACH."""
    there = at.moved(step[0])
    places, aims = at.positions(bench.sensor)[used], there.positions(bench.sensor)[used]
    matrix = tangent.matrix(there.design, aims) + possible.correction(step[1], aims)
    change = bench.loads @ (matrix - tangent.matrix(at.design, places)).T
    return min(1.0, REACH / max(float(np.abs(change).max()), 1e-12))


def _gain(quadratic: Quadratic, step: Array, change: Array) -> float:
    """Squared length of a step in units of what the frames can tell."""
    own = step @ quadratic.hessian @ step + change @ quadratic.information @ change
    return float(own + 2 * step @ quadratic.cross @ change)
