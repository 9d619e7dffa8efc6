"""Many hypotheses at once: a Kalman filter along the strip with a beam of hypotheses.

The loads are the hidden state and the blocks of pixels come in as measurements of one phase each,
which the intensity allows to be any of +-w + 2 pi q.  The variance of a measurement depends on the
frame alone and not on the hypothesis, so all hypotheses share one covariance and one gain and
each carries nothing but its mean.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

TURN = 2 * np.pi
"""Phase of one fringe [rad]."""
LOOK_AHEAD = 8
"""Blocks ahead at which two hypotheses must agree to be one."""
AGREEMENT = 0.05
"""How near their phases must be there [rad]."""


@njit(cache=True, error_model="numpy")
def continuations(
    predicted: Array,
    scores: Array,
    fold: float,
    single: bool,
    spread: float,
    gate: float,
    signless: bool,
    width: int,
) -> Array:
    """Continuations within the gate: rows of score, innovation, phase and parent, best first."""
    reach = gate * np.sqrt(spread)
    found = np.empty((8 * width, 4))
    count = 0
    for parent in range(len(predicted)):
        for sign in (1.0, -1.0):
            if single and sign < 0:
                continue
            low = np.ceil((predicted[parent] - reach - sign * fold) / TURN)
            high = np.floor((predicted[parent] + reach - sign * fold) / TURN)
            for turn in range(int(low), int(high) + 1):
                phase = sign * fold + TURN * turn
                # until something has shown, a load and its negative are the same: follow one
                if (signless and phase < 0) or count == len(found):
                    continue
                innovation = phase - predicted[parent]
                found[count, 0] = scores[parent] + innovation**2 / spread
                found[count, 1] = innovation
                found[count, 2] = phase
                found[count, 3] = parent
                count += 1
    return found[np.argsort(found[:count, 0])]
