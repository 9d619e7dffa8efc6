"""From a recovered phase, or from raw grey levels, to loads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import InputError
from fringeforce.estimation.likelihood import Misfit, Response, misfit

Array = NDArray[np.float64]

THINNED, LEFT = 4, 16
"""Every so many pixels enter the Hessian, if so many for each load are left; all the gradient."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """Loads at the top of the likelihood.

    Attributes
    ----------
    loads : ndarray, shape (m,)
        The estimate.
    phase : ndarray, shape (P,)
        Phase that it predicts [rad].
    misfit : Misfit
        What it leaves of the frame.
    """

    loads: Array
    phase: Array
    misfit: Misfit


def least_squares(phase: ArrayLike, influence: ArrayLike) -> Array:
    """Loads that explain a recovered phase best, equation (14).

    Parameters
    ----------
    phase : array_like, shape (P,)
        Recovered phase [rad]; pixels that are not finite are left out.
    influence : array_like, shape (P, m) or (P, n, 2)
        Influence matrix [rad/N].

    Returns
    -------
    ndarray, shape (m,) or (n, 2)
        Loads [N].

    Raises
    ------
    InputError
        If the shapes do not fit or there are fewer pixels than unknowns.
    """
    measured, matrix = np.asarray(phase, dtype=float), np.asarray(influence, dtype=float)
    flat = matrix.reshape(len(matrix), -1)
    known = np.isfinite(measured)
    if measured.shape != (len(flat),) or known.sum() < flat.shape[1]:
        raise InputError(
            f"{int(known.sum())} known phases of shape {measured.shape} cannot determine "
            f"{flat.shape[1]} loads through an influence matrix of {len(flat)} pixels; give one "
            "phase for every row and at least as many as loads."
        )
    loads = np.linalg.lstsq(flat[known], measured[known], rcond=None)[0]
    return loads.reshape(matrix.shape[1:])


def maximum_likelihood(
    frame: Array,
    influence: Array,
    response: Response,
    start: Array,
    steps: int = 30,
    tolerance: float = 1e-3,
) -> Estimate:
    """Climb to the top of the likelihood of a frame from loads that are nearly right.

    Levenberg and Marquardt's method on all pixels; more than half a fringe from the truth it ends
    in a side maximum, which the misfit shows.

    Parameters
    ----------
    frame : ndarray, shape (P,)
        Grey levels of the pixels to use.
    influence : ndarray, shape (P, m)
        Their influence matrix [rad/N].
    response : Response
        Of the camera.
    start : ndarray, shape (m,)
        Loads to start from [N].
    steps : int
        Largest number of steps.
    tolerance : float
        Gain of twice the log-likelihood below which a step is the last.
    """
    sigma = np.sqrt(response.variance)
    here = evaluated(frame, influence, response, start)
    damping, every = 1e-3, int(np.clip(len(frame) // (LEFT * len(start)), 1, THINNED))
    for _ in range(steps):
        slope = response.slope(here.phase) / sigma
        gradient = influence.T @ (slope * here.misfit.slope)
        root = slope[::every] * np.sqrt(every * here.misfit.weight[::every])
        scaled = influence[::every] * root[:, None]
        hessian = scaled.T @ scaled
        diagonal = np.diag(hessian) + 1e-9 * np.trace(hessian) + 1e-12
        before = here.misfit.loss
        if (
            gradient @ np.linalg.solve(hessian + np.diag(1e-6 * diagonal), gradient)
            < tolerance / 10
        ):
            break
        while damping < 1e6:
            step = np.linalg.solve(hessian + np.diag(damping * diagonal), -gradient)
            there = evaluated(frame, influence, response, here.loads + step)
            if there.misfit.loss <= before:
                here, damping = there, damping / 10
                break
            damping *= 10
        if before - here.misfit.loss < tolerance:
            break
    return here


def evaluated(frame: Array, influence: Array, response: Response, loads: Array) -> Estimate:
    """Given loads and what they leave of a frame; parameters as of `maximum_likelihood`."""
    phase = influence @ loads
    return Estimate(loads, phase, misfit(frame, response.level(phase), response))
