"""Frames with known loads against a model with unknowns: one step of Gauss and Newton at a time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fringeforce.calibration.design_tangent import DesignTangent
from fringeforce.calibration.unknowns import (
    Presses,
    Unknowns,
    level_slopes,
    on_strip,
    phase_and_matrix,
    precision,
    start,
)
from fringeforce.force.likelihood import misfit

Array = NDArray[np.float64]

FAR = 0.15
"""Change of a design value's logarithm up to which a tangent is followed."""
SUSPECT = 3.0
"""Times the median misfit beyond which a frame loses weight."""


@dataclass(frozen=True, eq=False)
class Bench(Presses):
    """Presses and the frames that were taken of them.

    Attributes
    ----------
    levels : ndarray, shape (F, P)
        Grey levels.
    """

    levels: Array

    def rows(self, chosen: NDArray[np.bool_]) -> Bench:
        """Some of the frames."""
        return replace(self, levels=self.levels[chosen], loads=self.loads[chosen])


@dataclass(frozen=True, eq=False)
class Fit:
    """Unknowns and what they leave.

    Attributes
    ----------
    unknowns : Unknowns
        The estimate.
    covariance : ndarray
        Of all unknowns, for unit reduced chi-square.
    slopes : ndarray, shape (F, P)
        Residuals in units of the noise.
    tangent : DesignTangent
        About which the matrix was linear.
    """

    unknowns: Unknowns
    covariance: Array
    slopes: Array
    tangent: DesignTangent


def climb(
    bench: Bench, at: Unknowns, tangent: DesignTangent, sound: NDArray[np.bool_], steps: int = 12
) -> Fit:
    """Levenberg and Marquardt's method with the matrix linear in the design.

    Frames that fit much worse than most lose weight in every step, so that a wrong press cannot
    pull the others along.

    Parameters
    ----------
    bench : Bench
        The frames.
    at : Unknowns
        Where to start.
    tangent : DesignTangent
        The matrix about a design.
    sound : ndarray of bool, shape (P,)
        Pixels to use.
    steps : int
        Largest number of steps.
    """
    prior, origin = precision(bench, len(at.design)), start(bench, len(at.design)).flat
    damping, step = 1e-3, np.zeros(len(prior))
    for _ in range(steps):
        weight = (sound & on_strip(at.positions(bench.sensor), bench.sensor)).astype(float)
        slopes, gradient, hessian = _linearised(bench, at, tangent, weight)
        shares = _frame_weights(slopes)
        before = _loss(slopes, weight, shares) + prior @ (at.flat - origin) ** 2
        gradient = gradient + prior * (at.flat - origin)
        hessian = hessian + np.diag(prior)
        while damping < 1e9:
            step = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), -gradient)
            reach = np.abs((at.design + step[: len(at.design)]) - tangent.centre).max(initial=FAR)
            there = at.moved(step * (FAR / reach))
            left = residuals(bench, there, tangent)
            if _loss(left, weight, shares) + prior @ (there.flat - origin) ** 2 <= before:
                at, damping = there, damping / 10
                break
            damping *= 10
        far = np.abs(at.design - tangent.centre).max(initial=0.0) > 0.99 * FAR
        if far or step @ hessian @ step < 1e-4:
            break
    weight = (sound & on_strip(at.positions(bench.sensor), bench.sensor)).astype(float)
    slopes, _, hessian = _linearised(bench, at, tangent, weight)
    return Fit(at, np.asarray(np.linalg.inv(hessian + np.diag(prior)), float), slopes, tangent)


def residuals(bench: Bench, at: Unknowns, tangent: DesignTangent) -> Array:
    """Residuals of all frames in units of the noise, shape (F, P)."""
    response = at.response(bench)
    phase, _ = phase_and_matrix(bench, at, tangent)
    return misfit(bench.levels, response.level(phase), response).slope


def _loss(slopes: Array, weight: Array, shares: Array) -> float:
    return float(shares @ (slopes**2 @ weight))


def _frame_weights(slopes: Array) -> Array:
    size = np.median(slopes**2, axis=1)
    return 1 / np.maximum(1, size / (SUSPECT * max(float(np.median(size)), 1e-12))) ** 2


def _linearised(
    bench: Bench, at: Unknowns, tangent: DesignTangent, weight: Array
) -> tuple[Array, Array, Array]:
    """Residuals, half the gradient and half the Hessian of the loss."""
    slopes = residuals(bench, at, tangent)
    weights = _frame_weights(slopes)[:, None] * weight
    along = level_slopes(bench, at, tangent)
    return slopes, along.gradient(weights * slopes), along.information(weights)
