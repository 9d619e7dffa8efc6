"""Corrections of the influence columns from all frames at once, on top of a fitted design.

Design, camera, light, the frames' own light and the pixels' pattern are fitted again with them: a
wrong matrix looks like a lamp that drifts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.calibration.columns.prior import MIDDLE, Posterior, Shapes, most_probable, shapes
from fringeforce.calibration.columns.quadratic import Quadratic, expanded, pattern_after
from fringeforce.calibration.design_jacobian import DesignJacobian, relinearised
from fringeforce.calibration.frame_fit import (
    STAGES,
    CalibrationFit,
    FrameFit,
    consistent,
    pixel_weight,
    precision,
    small_phases,
    start,
)
from fringeforce.calibration.light.drift import drifting
from fringeforce.calibration.measurements import Measurements, Unknowns

MOST_STEPS = 12
"""Largest number of steps."""
REACH = 1.0
"""Change of a phase up to which a step is followed [rad]."""
GAIN_TOLERANCE = 0.1
"""Gain of twice the log-likelihood below which a step is the last."""


@dataclass(frozen=True, eq=False)
class ColumnFit(CalibrationFit):
    """A fit with corrected columns, which the Jacobian of its `fit` has.

    Attributes
    ----------
    shapes : Shapes
        What the coefficients mean.
    posterior : Posterior
        The corrections.
    responses : ndarray, shape (U, r)
        What the other shared unknowns do in each mode of the corrections.
    own : ndarray, shape (U, U)
        Covariance of the other shared unknowns for given corrections.
    """

    shapes: Shapes
    posterior: Posterior
    responses: Array
    own: Array

    def correction(self, x: Array) -> Array:
        """What is added to the columns at some places, shape (m, 2n) [rad/N]."""
        return self.shapes.correction(self.posterior.mean, x)

    @property
    def origin(self) -> dict[str, str | int]:
        """How the columns came about, in words and numbers."""
        x = self.shapes.parts.x
        change, columns = self.correction(x), self.fit.jacobian.at(x)[0]
        share = np.sqrt((change**2).sum() / (columns**2).sum())
        return {
            "method": "finite elements, calibrated, columns corrected",
            "column correction": f"{share:.2%}, smooth over {1e3 * self.posterior.length:.2g} mm",
        }


def fit_columns(
    measured: Measurements, paths: tuple[str, ...], fit: FrameFit, stuck: Mask, kept: Mask
) -> ColumnFit:
    """Correct the columns of a fitted design, and fit design, camera and light again with them.

    Parameters
    ----------
    measured : Measurements
        All frames.
    paths : tuple of str
        Design values.
    fit : FrameFit
        Fit of the design.
    stuck : ndarray of bool, shape (P,)
        Pixels that do not follow the light at all.
    kept : ndarray of bool, shape (F,)
        Frames to start with.
    """
    at, jacobian = fit.unknowns, fit.jacobian
    possible = shapes(measured.sensor, jacobian, at.design)
    coefficients = np.zeros((2 * measured.loads.shape[1], possible.count))
    bent, sound, choice = jacobian, ~stuck, MIDDLE
    for number in range(MOST_STEPS):
        limit, explore = STAGES[min(number, len(STAGES) - 1)], number < len(STAGES)
        chosen = kept & small_phases(measured, at, bent, limit)
        weight = pixel_weight(measured, at, sound)
        rows = measured.rows(chosen)
        quadratic = expanded(rows, at, bent, possible, weight)
        solved = _solved(rows, at, coefficients, quadratic, possible, jacobian, choice, explore)
        posterior, step, choice = solved.posterior, solved.step, solved.posterior.choice
        change = posterior.mean - coefficients
        there = at.moved(step[: len(at.flat)])
        share = _step_share(
            rows, at, there, bent, possible.correction(change, bent.spline.x), weight
        )
        turned = possible.correction(change, at.positions(measured.sensor))
        measured = pattern_after(measured, quadratic.normal, step, turned, share)
        at = at.moved(share * step[: len(at.flat)])
        coefficients = coefficients + share * change
        far = 1.0 if explore else 0.5
        jacobian = relinearised(measured.sensor, paths, at.design, solved.covariance, jacobian, far)
        bent = jacobian.plus(possible.correction(coefficients, jacobian.spline.x))
        if np.isinf(limit):
            before = measured, kept, sound
            measured = drifting(measured, at, bent, pixel_weight(measured, at, sound))
            clear, kept = consistent(measured, at, bent, sound)
            sound = ~stuck & clear
            same = measured is before[0] and all(map(np.array_equal, before[1:], (kept, sound)))
            if same and quadratic.gain(step, change.ravel()) < GAIN_TOLERANCE:
                break
    quadratic = expanded(measured.rows(kept), at, bent, possible, pixel_weight(measured, at, sound))
    solved = _solved(measured, at, coefficients, quadratic, possible, jacobian, choice, False)
    posterior, count = replace(solved.posterior, mean=coefficients), len(at.flat)
    final = FrameFit(at, solved.covariance[:count, :count], bent, quadratic.normal)
    responses, own = solved.responses[:count], solved.own[:count, :count]
    return ColumnFit(measured, final, sound, kept, possible, posterior, responses, own)


@dataclass(frozen=True, eq=False)
class _Solved:
    """Posterior of the corrections, and the step of the other unknowns (U,) that goes with it.

    Responses (U, r) of the other unknowns to its modes, and the covariance (U, U) of these unknowns
    for given corrections.
    """

    posterior: Posterior
    step: Array
    responses: Array
    own: Array

    @property
    def covariance(self) -> Array:
        """Covariance of the other unknowns, shape (U, U)."""
        return self.own + self.responses @ self.responses.T


def _solved(
    measured: Measurements,
    at: Unknowns,
    coefficients: Array,
    quadratic: Quadratic,
    possible: Shapes,
    jacobian: DesignJacobian,
    first: tuple[int, int],
    explore: bool,
) -> _Solved:
    """The most probable step."""
    frames = np.zeros(len(quadratic.gradient) - len(at.flat))
    prior = precision(measured, jacobian.deviations)
    prior, place = np.append(prior, frames), np.append(at.flat, frames)
    origin = np.append(start(measured, len(at.design)).flat, frames)
    own = np.asarray(np.linalg.inv(quadratic.hessian + np.diag(prior)), dtype=float)
    here = coefficients.ravel()
    wanted = quadratic.hessian @ place + quadratic.cross @ here - quadratic.gradient
    wanted += prior * origin
    column_gradient = (
        quadratic.information @ here + quadratic.cross.T @ place - quadratic.column_gradient
    )
    eliminated = own @ quadratic.cross
    posterior = most_probable(
        possible,
        quadratic.information - quadratic.cross.T @ eliminated,
        column_gradient - eliminated.T @ wanted,
        first,
        explore,
    )
    aim = own @ wanted - eliminated @ posterior.mean.ravel()
    responses = -eliminated @ posterior.modes.reshape(len(posterior.modes), len(here)).T
    return _Solved(posterior, aim - place, responses, own)


def _step_share(
    measured: Measurements,
    at: Unknowns,
    there: Unknowns,
    jacobian: DesignJacobian,
    change: Array,
    weight: Array,
) -> float:
    """Share of a step that turns no used phase by more than REACH."""
    used = weight > 0
    places, aims = (each.positions(measured.sensor)[used] for each in (at, there))
    aim = jacobian.plus(change).matrix(there.design, aims)
    turned = measured.loads @ (aim - jacobian.matrix(at.design, places)).T
    return min(1.0, REACH / max(float(np.abs(turned).max()), 1e-12))
