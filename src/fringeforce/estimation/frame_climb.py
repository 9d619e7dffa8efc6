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
def factorised(hessian, cone, damping, root):
    """Root U of U'U = H + cone + damping diag, into the upper triangle of `root`.

    Of the matrices the lower triangles count.  Rows of the root are what all above leave, four of
    them at a time.

    Returns
    -------
    bool
        Whether the sum is positive definite.
    """
    size = len(root)
    for k in range(size):
        row = root[k]
        for j in range(k, size):
            row[j] = hessian[j, k] + cone[j, k]
        row[k] *= 1 + damping
        z = 0
        while z + 3 < k:
            a, b, c, d = root[z], root[z + 1], root[z + 2], root[z + 3]
            p, q, r, s = a[k], b[k], c[k], d[k]
            for j in range(k, size):
                row[j] -= (p * a[j] + q * b[j]) + (r * c[j] + s * d[j])
            z += 4
        for x in range(z, k):
            factor, other = root[x, k], root[x]
            for j in range(k, size):
                row[j] -= factor * other[j]
        if not row[k] > 0:
            return False
        share = 1 / np.sqrt(row[k])
        for j in range(k, size):
            row[j] *= share
    return True


@apart
def substituted(root, gradient, step):
    """Solve for the step to where the gradient vanishes, from the root of the Hessian."""
    size = len(step)
    for i in range(size):
        step[i] = -gradient[i]
    for i in range(size):
        row = root[i]
        step[i] /= row[i]
        for k in range(i + 1, size):
            step[k] -= row[k] * step[i]
    for i in range(size - 1, -1, -1):
        row, total = root[i], step[i]
        for k in range(i + 1, size):
            total -= row[k] * step[k]
        step[i] = total / row[i]


@sums
def _solve(hessian, cone, damping, gradient, root, step):
    """Solve (H + cone + damping diag) step = -gradient; False where it is not positive definite."""
    if not factorised(hessian, cone, damping, root):
        return False
    substituted(root, gradient, step)
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
    root, step = np.empty_like(out.hessian), np.empty(len(start))
    unknowns, damping = start.copy(), 1e-2
    fill_exposure(model, unknowns, here)
    loss = frame_loss(model, prior, frame, unknowns, here[4], sigma, heat)
    for _ in range(steps):
        fill_linearised(model, prior, frame, unknowns, here, sigma, heat, out)
        better, reached, trial = False, loss, unknowns
        while damping < 1e6:
            if _solve(out.hessian, out.cone, damping, out.gradient, root, step):
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
