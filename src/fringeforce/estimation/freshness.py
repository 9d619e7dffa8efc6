"""How far loads may move before a matrix that was computed where they were is too old.

A matrix is used again while the way from where it was computed is hardly bent.  How much a bend
changes the deviations that it states depends on the design: it is tried for the very design.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.covariance import covariance_of
from fringeforce.estimation.likelihood import Response

Array = NDArray[np.float64]

FRESHEST = 0.015
"""Bend up to which a matrix is used again at most; see `gauss_newton.relative_curvature`."""
TOLERATED = 0.05
"""Relative error of deviations that an old matrix may cause, root of the mean square."""
TRIALS = 8
"""Motions that are tried."""
TRIAL_PHASES = (2.0, 20.0)
"""Range of the largest phase of their frames [rad]."""


def freshness(influence: Array, response: Response) -> float:
    """Bend up to which deviations from an old matrix hold to `TOLERATED`.

    Parameters
    ----------
    influence : ndarray, shape (P, m)
        Influence matrix at the pixels that are used [rad/N].
    response : Response
        Of the camera, there.
    """
    rng = np.random.default_rng(0)
    influence = influence[:, np.any(influence != 0, axis=0)]  # others say nothing
    lowest, highest = np.log(TRIAL_PHASES)
    motions = []
    for _ in range(TRIALS):
        loads = _pushing(rng, influence.shape[1])
        size = np.exp(rng.uniform(lowest, highest))
        loads *= size / np.abs(influence @ loads).max()
        motions.append((loads, loads * rng.uniform(-1, 1, len(loads))))
    bend = FRESHEST
    while (error := _error(influence, response, motions, bend)) > TOLERATED:
        bend *= 0.9 * TOLERATED / error
    return bend


def _pushing(rng: np.random.Generator, size: int) -> Array:
    """Loads that push on every tactel, some more and some less to the side."""
    loads = rng.uniform(0.2, 1, size)
    loads[1::2] *= rng.uniform(-0.35, 0.35, size // 2)
    return loads


def _error(
    influence: Array, response: Response, motions: list[tuple[Array, Array]], bend: float
) -> float:
    """Relative error of deviations after motions of a given bend, root of the mean square."""
    errors = []
    for loads, way in motions:
        phase, moved = influence @ loads, influence @ way
        curve = response.amplitude / 2 * np.cos(phase + response.bias)
        # of second order over first, for the whole way
        second = ((curve / 2 * moved**2) ** 2).sum()
        whole = np.sqrt(second / ((response.slope(phase) * moved) ** 2).sum())
        after = _deviations(influence, response, loads + way * (bend / whole))
        errors.append(after / _deviations(influence, response, loads) - 1)
    return float(np.sqrt(np.mean(np.square(errors))))


def _deviations(influence: Array, response: Response, loads: Array) -> Array:
    """Standard deviations of the loads, shape (m,) [N]."""
    pulled = influence * response.slope(influence @ loads)[:, None]
    return np.sqrt(np.diag(covariance_of(pulled.T @ pulled / response.variance)))
