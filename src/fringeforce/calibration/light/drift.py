"""How much the light changes from frame to frame, judged by the frames themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.design_jacobian import DesignJacobian
from fringeforce.calibration.measurements import Measurements, Unknowns
from fringeforce.calibration.predictions import (
    frame_illumination,
    illumination_information,
    predict,
)

DETECTED = 4.0
"""Standard deviations of chance that a scatter must exceed noise by to be called a drift."""
DRIFT_TOLERANCE = 0.1
"""Relative change of a drift's size below which it stays."""
OUTSIDE = 4.0
"""Standard deviations beyond which a frame's own light is taken for a wrong load."""
TOO_UNSURE = 4.0
"""Times the variance of the best quarter beyond which a frame says too little of its own light."""
FREE = 1e-6
"""Inverse variance of a frame's own light before it is seen, next to none."""


def drifting(
    measured: Measurements, at: Unknowns, jacobian: DesignJacobian, weight: Array
) -> Measurements:
    """The measurements with the size of its drift; the very same one if that hardly changes.

    Every frame's own gain and offset are estimated freely.  What they scatter beyond their own
    errors, by the median so that wrong loads do not count, is the drift; a scatter that chance
    explains is none.

    Parameters
    ----------
    measured : Measurements
        The frames.
    at : Unknowns
        Unknowns that explain the frames.
    jacobian : DesignJacobian
        The matrix about a design.
    weight : ndarray, shape (P,)
        Weights of the pixels.
    """
    predicted = predict(replace(measured, drift=(0.0, 0.0)), at, jacobian, weight)
    amplitude = predicted.response.amplitude
    shifts = (
        np.stack([amplitude * predicted.light, np.ones_like(predicted.light)]) * predicted.scale
    )
    estimates = frame_illumination(predicted.residuals, shifts, weight, FREE)
    own = illumination_information(shifts, weight, FREE)
    variances = np.diagonal(np.linalg.inv(own), axis1=1, axis2=2).T
    sizes = [_scatter(*each) for each in zip(estimates, variances, strict=True)]
    if np.allclose(sizes, measured.drift, rtol=DRIFT_TOLERANCE, atol=0):
        return measured
    return replace(measured, drift=(sizes[0], sizes[1]))


def _scatter(estimates: Array, variances: Array) -> float:
    """Standard deviation beyond the estimates' own, or zero if chance explains it."""
    sure = variances <= TOO_UNSURE * np.quantile(variances, 0.25)
    values, noise = estimates[sure], float(np.median(variances[sure]))
    spread = (1.4826 * float(np.median(np.abs(values - np.median(values))))) ** 2
    # the variance from a median of n values is itself sure to 2.33 / sqrt(n)
    if spread <= noise * (1 + DETECTED * 2.33 / np.sqrt(len(values))):
        return 0.0
    # a drift that is there is measured better by all frames but the wrong ones
    near = values[np.abs(values - np.median(values)) < OUTSIDE * np.sqrt(spread)]
    return float(np.sqrt(max(near.var() - noise, 0.0)))
