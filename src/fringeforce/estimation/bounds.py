"""How well a frame can determine loads: Fisher information, covariance, the Cramer-Rao bound."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.likelihood import Response

Array = NDArray[np.float64]

COARSE_STRIDE, ENOUGH = 8, 8
"""The variance at which information is flat is sought at every so many pixels, or at more where
fewer than so many were left for each load; then at all pixels, until they agree."""
AGREED = 0.02
"""Relative change of the covariance, summed in squares over its directions, below which they do."""


def fisher_information(
    phase: Array, influence: Array, response: Response, phase_variance: Array | float = 0.0
) -> Array:
    """Information on the loads in one frame.

    The expected square of the grey level's slope, A^2/4 sin^2 p, taken over a phase that is itself
    uncertain: E[sin^2 p] = (1 - exp(-2 v) cos 2p) / 2 for a Gaussian of variance v; p includes the
    bias.

    Parameters
    ----------
    phase : ndarray, shape (P,)
        Phase [rad].
    influence : ndarray, shape (P, m)
        Influence matrix [rad/N].
    response : Response
        Of the camera.
    phase_variance : ndarray, shape (P,), or float
        Variance v of the phase [rad^2]; none for Fisher's own definition.

    Returns
    -------
    ndarray, shape (m, m)
        Information [1/N^2].
    """
    whole, cosine = np.ones(len(phase)), np.cos(2 * (phase + response.bias))
    rows, most = np.ascontiguousarray(influence), whole * _largest(response)
    return np.asarray(_information(rows, cosine, most, whole * phase_variance), dtype=np.float64)


def _largest(response: Response) -> Array | float:
    """Information on the phase of a pixel where its slope is steepest, halved [1/rad^2]."""
    return response.amplitude**2 / (8 * response.variance)


def cramer_rao_bound(phase: Array, influence: Array, response: Response) -> Array:
    """Smallest standard deviations that an unbiased reading of one frame can have, shape (m,) [N].

    Infinite where the frame does not change with a load to first order, as at zero load.
    """
    information = fisher_information(phase, influence, response)
    with np.errstate(divide="ignore", invalid="ignore"):
        try:
            variances = np.diag(np.linalg.inv(information))
        except np.linalg.LinAlgError:
            return np.full(len(information), np.inf)
        return np.where(variances > 0, np.sqrt(np.maximum(variances, 0)), np.inf)


def covariance(phase: Array, influence: Array, response: Response, rounds: int = 20) -> Array:
    """Covariance of loads read from one frame, also where intensity is flat in the phase.

    At a multiple of pi the slope of the intensity vanishes and Fisher's information with it, but
    the curvature still bounds the phase.  The phase's own variance enters the information, and both
    are made to agree; away from such places this is the inverse of Fisher's information.

    Parameters
    ----------
    phase : ndarray, shape (P,)
        Phase at the estimate [rad].
    influence : ndarray, shape (P, m)
        Influence matrix [rad/N].
    response : Response
        Of the camera.
    rounds : int
        Largest number of rounds until both agree.

    Returns
    -------
    ndarray, shape (m, m)
        Covariance [N^2].
    """
    step = int(np.clip(len(phase) // (ENOUGH * influence.shape[1]), 1, COARSE_STRIDE))
    whole = np.ones(len(phase))
    most = whole * _largest(response)
    start = whole * np.sqrt(response.variance) / response.amplitude
    rows, cosine = np.ascontiguousarray(influence), np.cos(2 * (phase + response.bias))
    few = slice(None, None, step)
    found = _agreed(
        np.ascontiguousarray(rows[few]), cosine[few], step * most[few], start[few], rounds
    )
    return _agreed(rows, cosine, most, _phase_variance(rows, found), rounds, found)


def _agreed(
    influence: Array,
    cosine: Array,
    most: Array,
    variance: Array,
    rounds: int,
    before: Array | None = None,
) -> Array:
    """Covariance of the loads that agrees with the variance of the phase that it causes.

    From a variance to start with, and the covariance that it belongs to where there is one.
    """
    result: Array = np.empty((0, 0))
    for _ in range(rounds):
        information = _bounded(_information(influence, cosine, most, variance))
        result = np.asarray(np.linalg.inv(information), dtype=float)
        if before is not None and _change(before, information) < AGREED:
            break
        # the geometric mean settles at once where information is proportional to the variance
        variance = np.sqrt(variance * _phase_variance(influence, result))
        before = result
    return result


def _change(covariance: Array, information: Array) -> float:
    """How far a covariance is from the inverse of an information, relative to it.

    The root of the summed squares of the relative changes in all directions.
    """
    change = covariance @ information - np.eye(len(covariance))
    return float(np.sqrt(abs((change * change.T).sum())))


def _information(influence: Array, cosine: Array, most: Array, variance: Array) -> Array:
    """Information on the loads; see `fisher_information` and `_largest`."""
    weight = most * (1 - np.exp(-2 * variance) * cosine)
    return np.asarray((influence * weight[:, None]).T @ influence)


def _phase_variance(influence: Array, loads: Array) -> Array:
    """Variance of the phase at every pixel, given the covariance of the loads."""
    return np.einsum("ij,ij->i", influence @ loads, influence)


def _bounded(information: Array) -> Array:
    """An information matrix whose inverse is finite where a load leaves no trace at all."""
    ridge = 1e-12 * np.trace(information) + 1e-300
    return information + ridge * np.eye(len(information))
