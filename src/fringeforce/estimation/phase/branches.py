"""Every phase that a row of folded phases allows: the likeliest ones, and single departures.

A Kalman filter along the strip with a beam of interpretations, as in `beam`, that remembers what it
merged.  Two hypotheses that agree ahead become one, and what the loser had supposed, such as a
stretch mirrored at a multiple of pi, is forgotten; since all hypotheses share covariance and gain,
a path that departs from the best one in such a place only is replayed in a few operations a block.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fringeforce.estimation.compiling import copied
from fringeforce.estimation.hypotheses import SAME_PHASE
from fringeforce.estimation.phase.beam import AGREEMENT, LOOK_AHEAD, continuations

Array = NDArray[np.float64]

MERGES = 64
"""Merges that are remembered for each block; in the mean there are fewer than ten."""
GAP = 30.0
"""Squared deviations behind the best at which a departure is not worth a replay."""
ROOTS = 3
"""Hypotheses from which departures are replayed."""


@njit(cache=True, error_model="numpy", nogil=True)
def _search(fold, variance, single, bias, columns, width, gate, cut):
    blocks, size = columns.shape
    covariance, means, scores = np.eye(size), np.zeros((1, size)), np.zeros(1)
    gains, parent = np.zeros((blocks, size)), np.full((blocks, width), -1, np.int64)
    phase, skipped = np.zeros((blocks, width)), np.zeros(blocks, np.bool_)
    merges, merged = np.zeros((blocks * MERGES, 4)), 0
    signless = not bias.any()
    for b in range(blocks):
        row = columns[b]
        shift = covariance @ row
        spread = variance[b] + row @ shift
        choices = continuations(
            means @ row + bias[b], scores, fold[b], single[b], spread, gate, signless, width
        )
        if len(choices) == 0:  # nothing fits anyone: a broken pixel, not a broken hypothesis
            skipped[b] = True
            scores = scores + gate**2
            for k in range(len(scores)):
                parent[b, k] = k
            continue
        gain = shift / spread
        copied(gain, gains[b])
        ahead = columns[min(b + LOOK_AHEAD, blocks - 1)]
        expected, pull = means @ ahead, gain @ ahead
        best = choices[0, 0]
        kept, kept_scores = np.empty((width, size)), np.empty(width)
        now, later, count = np.empty(width), np.empty(width), 0
        for score, innovation, here, source in choices:
            p = int(source)
            if count == width or score > best + cut:
                break
            outlook, double = expected[p] + pull * innovation, -1
            for q in range(count):
                if now[q] == here and abs(later[q] - outlook) < AGREEMENT:
                    double = q
                    break
            if double >= 0:
                if merged < len(merges):
                    merges[merged, 0], merges[merged, 1] = b, double
                    merges[merged, 2], merges[merged, 3] = p, score - kept_scores[double]
                    merged += 1
                continue
            for i in range(size):
                kept[count, i] = means[p, i] + gain[i] * innovation
            kept_scores[count], now[count], later[count] = score, here, outlook
            parent[b, count], phase[b, count] = p, here
            count += 1
        means, scores = kept[:count].copy(), kept_scores[:count].copy()
        signless = signless and fold[b] == 0.0
        for i in range(size):
            for j in range(size):
                covariance[i, j] -= shift[i] * gain[j]
    return means, scores, parent, phase, skipped, gains, merges[:merged]


@njit(cache=True, error_model="numpy", nogil=True)
def _traced(parent, phase, skipped, last, k, out):
    """Phases that hypothesis k chose up to a block, into `out`; not a number where it skipped."""
    for b in range(last, -1, -1):
        out[b] = np.nan if skipped[b] else phase[b, k]
        k = parent[b, k]


@njit(cache=True, error_model="numpy", nogil=True)
def _replayed(choice, bias, columns, gains):
    blocks, size = columns.shape
    mean = np.zeros(size)
    for b in range(blocks):
        if np.isnan(choice[b]):
            continue
        innovation = choice[b] - bias[b]
        for i in range(size):
            innovation -= columns[b, i] * mean[i]
        for i in range(size):
            mean[i] += gains[b, i] * innovation
    return mean


@njit(cache=True, error_model="numpy", nogil=True)
def _branched(means, scores, parent, phase, skipped, gains, merges, bias, columns, most):
    """Final hypotheses and single departures from them: states, scores."""
    blocks, size = columns.shape
    found, heights = np.empty((most * ROOTS, size)), np.empty(most * ROOTS)
    paths, count = np.empty((most * ROOTS, blocks)), 0
    order = np.argsort(merges[:, 3])
    lineage, base = np.empty(blocks, np.int64), np.empty(blocks)
    other = np.empty(blocks)
    for k in range(min(len(scores), ROOTS)):
        _traced(parent, phase, skipped, blocks - 1, k, base)
        copied(means[k], found[count])
        copied(base, paths[count])
        heights[count] = scores[k]
        count += 1
        q = k
        for b in range(blocks - 1, -1, -1):
            lineage[b] = q
            q = parent[b, q]
        for o in order:
            b, kept, source = int(merges[o, 0]), int(merges[o, 1]), int(merges[o, 2])
            if merges[o, 3] > GAP or count >= most * (k + 1):
                break
            if lineage[b] != kept:
                continue
            copied(base, other)
            if b > 0:
                _traced(parent, phase, skipped, b - 1, source, other)
            known = False
            for c in range(count):
                far = False
                for i in range(blocks):
                    if abs(other[i] - paths[c, i]) >= SAME_PHASE:
                        far = True
                        break
                if not far:
                    known = True
                    break
            if known:
                continue
            copied(_replayed(other, bias, columns, gains), found[count])
            copied(other, paths[count])
            heights[count] = scores[k] + merges[o, 3]
            count += 1
    return found[:count], heights[:count]


def branches(
    fold: Array,
    variance: Array,
    single: NDArray[np.bool_],
    bias: Array,
    columns: Array,
    width: int,
    gate: float,
    cut: float,
    most: int = 24,
) -> tuple[Array, Array]:
    """States that explain a row of folded phases, the likeliest first.

    Parameters
    ----------
    fold, variance : ndarray, shape (b,)
        Folded phases [rad] and their variances, in the order of the scan.
    single : ndarray of bool, shape (b,)
        Blocks that allow fold + 2 pi q only.
    bias : ndarray, shape (b,)
        Phase that is there without loads [rad].
    columns : ndarray, shape (b, m)
        Phase per unit of every state, which is a standard normal number before anything is seen.
    width : int
        Hypotheses that are kept.
    gate : float
        Standard deviations within which a phase counts as predicted.
    cut : float
        Squared deviations behind the best at which a hypothesis is given up.
    most : int
        Departures that are replayed from each of the best hypotheses.

    Returns
    -------
    states : ndarray, shape (k, m)
        Final hypotheses and single departures from the best of them.
    scores : ndarray, shape (k,)
        Their sums of squared innovations, ascending; of a departure up to where it ended.
    """
    # the loop is compiled once for rows of memory, and not again for columns
    fold, variance = np.ascontiguousarray(fold), np.ascontiguousarray(variance)
    found = _search(fold, variance, np.ascontiguousarray(single), bias, columns, width, gate, cut)
    states, scores = _branched(*found, bias, columns, most)
    order = np.argsort(scores, kind="stable")
    return states[order], scores[order]
