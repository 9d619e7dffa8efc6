"""Many hypotheses at once: a Kalman filter along the strip with a beam of interpretations.

The loads are the hidden state and the blocks of pixels come in as measurements of one phase each,
which the intensity allows to be any of +-w + 2 pi q.  The variance of a measurement depends on the
frame alone and not on the interpretation, so all hypotheses share one covariance and one gain and
each carries nothing but its mean.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

TURN = 2 * np.pi
LOOK_AHEAD = 8
"""Blocks ahead at which two hypotheses must agree to be one."""
AGREEMENT = 0.05
"""How near their phases must be there [rad]."""


@njit(cache=True, error_model="numpy")
def beam_search(
    fold: Array,
    variance: Array,
    single: NDArray[np.bool_],
    bias: Array,
    influence: Array,
    scale: float,
    width: int,
    gate: float,
    cut: float,
) -> tuple[Array, Array]:
    """Interpretations of a row of folded phases, the likeliest first.

    Parameters
    ----------
    fold, variance : ndarray, shape (b,)
        Folded phases [rad] and their variances, in the order of the scan.
    single : ndarray of bool, shape (b,)
        Blocks that allow fold + 2 pi q only.
    bias : ndarray, shape (b,)
        Phase that is there without loads [rad].
    influence : ndarray, shape (b, m)
        Phase per unit load.
    scale : float
        Standard deviation of every load before anything is seen.
    width : int
        Hypotheses that are kept.
    gate : float
        Standard deviations within which a phase counts as predicted.
    cut : float
        Squared deviations behind the best at which a hypothesis is given up.

    Returns
    -------
    means : ndarray, shape (k, m)
        Loads of the k hypotheses that are left, up to a common sign if nothing is biased.
    scores : ndarray, shape (k,)
        Their sums of squared innovations, ascending.
    """
    blocks, unknowns = influence.shape
    covariance = np.eye(unknowns) * scale**2
    means, scores = np.zeros((1, unknowns)), np.zeros(1)
    signless = not bias.any()
    for block in range(blocks):
        row = influence[block]
        shift = covariance @ row
        spread = variance[block] + row @ shift
        choices = continuations(
            means @ row + bias[block],
            scores,
            fold[block],
            single[block],
            spread,
            gate,
            signless,
            width,
        )
        if len(choices) == 0:  # nothing fits anyone: a broken pixel, not a broken hypothesis
            scores += gate**2
            continue
        ahead = influence[min(block + LOOK_AHEAD, blocks - 1)]
        means, scores = _survivors(choices, means, shift / spread, ahead, width, cut)
        signless = signless and fold[block] == 0.0
        for i in range(unknowns):
            for j in range(unknowns):
                covariance[i, j] -= shift[i] * shift[j] / spread
    return means, scores


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


@njit(cache=True, error_model="numpy")
def _survivors(
    choices: Array, means: Array, gain: Array, ahead: Array, width: int, cut: float
) -> tuple[Array, Array]:
    """Update the best continuations, leaving out doubles and those far behind."""
    kept, scores = np.empty((width, means.shape[1])), np.empty(width)
    now, later = np.empty(width), np.empty(width)
    expected, pull = means @ ahead, gain @ ahead
    count = 0
    for score, innovation, phase, parent in choices:
        if count == width or score > choices[0, 0] + cut:
            break
        outlook = expected[int(parent)] + pull * innovation
        double = False
        for other in range(count):
            if now[other] == phase and abs(later[other] - outlook) < AGREEMENT:
                double = True
                break
        if double:
            continue
        mean = means[int(parent)]
        for i in range(len(gain)):
            kept[count, i] = mean[i] + gain[i] * innovation
        scores[count], now[count], later[count] = score, phase, outlook
        count += 1
    return kept[:count], scores[:count]
