"""Reading a frame whose lamp is not quite as bright as that of the calibration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.frame_illumination import frame_illumination
from fringeforce.estimation.likelihood import Response
from fringeforce.estimation.strip import Strip
from fringeforce.reading.cold_start import cold_start
from fringeforce.reading.frame_problem import Doubt
from fringeforce.reading.hypothesis_selection import Hypothesis
from fringeforce.reading.reading import Status

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

GAINS = (1.0, -1.0, 2.0, -2.0)
"""Gains that are tried where none does not explain a frame, in their deviations."""
ROUNDS = 4
"""Times that a frame is read again in its own light at most."""
LARGEST = 5.0
"""Deviations beyond which no lamp is believed to have drifted."""
SETTLED = 0.03
"""Change of a frame's gain and offset, in their deviations, below which its light is known."""


def cold_start_with_illumination(
    levels: Array,
    used: Mask,
    influence: Array,
    response: Response,
    strip: Strip,
    full_scale: int,
    model_error: float,
    channels: int,
    drift: tuple[float, float],
    calibration_uncertainty: Doubt | None,
    start: Array | None = None,
) -> Hypothesis:
    """Explain a frame, with its own gain and offset where the lamp is known to drift.

    A drifting lamp makes a reading take at least twice as long.

    Parameters
    ----------
    levels, used, influence, response, strip, full_scale, model_error, channels
        As of `cold_start`; the response is that in the light of the calibration.
    drift : pair of float
        Standard deviations of gain and offset from frame to frame; zeros for a steady lamp.
    calibration_uncertainty : callable or None
        As of `cold_start`.
    start : ndarray, shape (2n,), optional
        As of `cold_start`.
    """

    def explained(shifts: Array) -> Hypothesis:
        gain, offset = shifts * drift
        lit = replace(
            response, amplitude=response.amplitude * (1 + gain), offset=response.offset + offset
        )
        return cold_start(
            levels,
            used,
            influence,
            lit,
            strip,
            full_scale,
            model_error,
            channels,
            calibration_uncertainty,
            start,
        )

    def settled(shifts: Array) -> Hypothesis:
        found, added = explained(shifts), 0.0
        for _ in range(ROUNDS):
            light = frame_illumination(
                levels[used],
                found.loads,
                influence[used],
                response.at(used),
                found.noise,
                drift,
            )
            following = np.clip(light.shifts, -LARGEST, LARGEST)
            added, moved = light.covariance, np.abs(following - shifts).max()
            if moved < SETTLED:
                break
            shifts = following
            found = explained(shifts)
        return replace(found, covariance=found.covariance + added, noise=found.noise + added)

    if not any(drift):
        return explained(np.zeros(2))
    found = settled(np.zeros(2))
    for gain in GAINS:
        if found.status is not Status.MODEL_MISMATCH:
            break
        found = settled(np.array([gain, 0.0]))
    return found
