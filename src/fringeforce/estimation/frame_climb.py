"""The climb to the smallest loss of a frame, in compiled loops."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import apart, sums, sums_entry
from fringeforce.estimation.frame_exposure import dot, fill_exposure, workspace
from fringeforce.estimation.frame_loss import Prior, frame_loss, weighed_squares
from fringeforce.estimation.frame_model import FrameModel
from fringeforce.estimation.linearised_frame import empty_linearised, fill_linearised

Array = NDArray[np.float64]

CONVERGED = 0.1
"""Fall of the loss below which a climb is at its top: a tenth of what noise leaves to one unknown,
a third of its standard deviation."""
UNDAMPED = 0.1
"""Damping below which a step is nearly that of Gauss and Newton."""


@apart
def factorised(hessian, cone, damping, lower):
    """Root of H + cone + damping diag, into `lower`; False where it is not positive definite."""
    for i in range(len(lower)):
        for j in range(i + 1):
            total = hessian[i, j] + cone[i, j]
            if i == j:
                total *= 1 + damping
            for k in range(j):
                total -= lower[i, k] * lower[j, k]
            if i == j:
                if not total > 0:
                    return False
                lower[i, i] = np.sqrt(total)
            else:
                lower[i, j] = total / lower[j, j]
    return True


@apart
def substituted(lower, gradient, step):
    """Solve for the step to where the gradient vanishes, from the root of the Hessian."""
    size = len(step)
    for i in range(size):
        total = -gradient[i]
        for k in range(i):
            total -= lower[i, k] * step[k]
        step[i] = total / lower[i, i]
    for i in range(size - 1, -1, -1):
        step[i] /= lower[i, i]
        for k in range(i):
            step[k] -= lower[i, k] * step[i]


@sums
def _solve(hessian, cone, damping, gradient, lower, step):
    """Solve (H + cone + damping diag) step = -gradient; False where it is not positive definite."""
    if not factorised(hessian, cone, damping, lower):
        return False
    substituted(lower, gradient, step)
    return True


def climb(
    model: FrameModel,
    prior: Prior,
    frame: Array,
    start: Array,
    heat: float,
    steps: int,
    tolerance: float,
    bound: float = np.inf,
) -> tuple[Array, float, float, float, float]:
    """Maximise the posterior from a start, by Levenberg and Marquardt's damped Gauss-Newton steps.

    Each step solves (H + damping diag H) step = -gradient and is taken if the loss falls
    (Marquardt, J. SIAM 11, 431, 1963).

    Parameters
    ----------
    model, prior, frame
        As of `linearise`.
    start : ndarray, shape (size,)
        Where to start.
    heat : float
        Factor on the variance of the noise and of the cone: above 1 the loss has fewer valleys.
    steps : int
        Most steps.
    tolerance : float
        Fall of the loss below which it is at its smallest.
    bound : float
        Loss above which a top is of no use: a climb ends where twice the fall that its linearised
        problem has left does not lead below.

    Returns
    -------
    unknowns : ndarray, shape (size,)
        The last point.
    loss : float
        Twice the negative logarithm of the posterior there, less a constant.
    square : float
        Weighted sum of squared residuals in units of the noise.
    count : float
        Sum of the weights of the pixels, their number if none is clipped or broken.
    broken : float
        Expected number of pixels, of those that are not clipped, that show anything at all.
    """
    return _climb(model, prior, frame, start, heat, steps, tolerance, bound)


@sums_entry
def _climb(model, prior, frame, start, heat, steps, tolerance, bound):
    """As `climb`; an argument that may be left out would have the loop compiled twice."""
    return _climbed(model, prior, frame, start, heat, steps, tolerance, bound)


@apart
def _climbed(model, prior, frame, start, heat, steps, tolerance, bound):
    """As `climb`."""
    sigma = np.sqrt(model.variance * heat)
    here, there, out = workspace(model), workspace(model), empty_linearised(model)
    lower, step = np.zeros_like(out.hessian), np.empty(len(start))
    unknowns, damping = start.copy(), 1e-2
    fill_exposure(model, unknowns, here)
    loss = frame_loss(model, prior, frame, unknowns, here[4], sigma, heat)
    for _ in range(steps):
        fill_linearised(model, prior, frame, unknowns, here, sigma, heat, out)
        better, reached, trial = False, loss, unknowns
        while damping < 1e6:
            if _solve(out.hessian, out.cone, damping, out.gradient, lower, step):
                trial = unknowns + step
                fill_exposure(model, trial, there)
                reached = frame_loss(model, prior, frame, trial, there[4], sigma, heat)
                if reached <= loss:
                    better = True
                    break
            damping *= 6
        if not better:
            break
        fall = -dot(step, out.gradient)
        gain, loss, unknowns = loss - reached, reached, trial
        here, there = there, here
        # a short step of a large damping falls little, far from any top
        if (gain < tolerance and damping < UNDAMPED) or loss - 2 * max(fall, gain) > bound:
            break
        damping = max(damping / 8, 1e-8)
    square, count, broken = weighed_squares(model, frame, here[4])
    return unknowns, loss, square, count, broken
