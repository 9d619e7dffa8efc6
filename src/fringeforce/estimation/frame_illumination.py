"""A frame's own gain and offset, when the lamp is not quite that of the calibration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.likelihood import Response, misfit

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FrameIllumination:
    """What a frame says of its own light.

    Attributes
    ----------
    shifts : ndarray, shape (2,)
        Gain and offset in units of their deviations, zero for the light of the calibration.
    covariance : ndarray, shape (m, m)
        What their uncertainty adds to that of the loads [N^2].
    """

    shifts: Array
    covariance: Array


def frame_illumination(
    frame: Array,
    loads: Array,
    influence: Array,
    response: Response,
    spread: Array,
    drift: tuple[float, float],
) -> FrameIllumination:
    """Estimate gain and offset together with the loads, to first order about the loads.

    Parameters
    ----------
    frame : ndarray, shape (P,)
        Grey levels.
    loads : ndarray, shape (m,)
        Loads that nearly explain it [N].
    influence : ndarray, shape (P, m)
        Influence matrix [rad/N].
    response : Response
        Of the camera, in the light of the calibration.
    spread : ndarray, shape (m, m)
        Covariance of the loads when the light is known [N^2].
    drift : pair of float
        Standard deviations of gain and offset.
    """
    phase, sigma = influence @ loads, np.sqrt(response.variance)
    level = response.level(phase)
    left = misfit(frame, level, response).slope
    turned = influence * (response.slope(phase) / sigma)[:, None]
    own = np.stack([drift[0] * (level - response.offset), np.full_like(level, drift[1])], axis=1)
    own = own / sigma
    mixed = spread @ (turned.T @ own)
    information = np.eye(2) + own.T @ own - (turned.T @ own).T @ mixed
    pull = own.T @ left - mixed.T @ (turned.T @ left)
    shifts = -np.linalg.solve(information, pull)
    covariance = mixed @ np.linalg.solve(information, mixed.T)
    return FrameIllumination(shifts, np.asarray(covariance, dtype=float))
