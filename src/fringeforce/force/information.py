"""Fisher's information of the loads: every pixel's slope counts, but few products are formed.

The slopes change from pixel to pixel, fringe by fringe; the influence does so only over the depth
of the cover.  So the influence is taken at every fourth pixel, and quintic interpolation
between these nodes shares out the squared slopes of all pixels among them.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fringeforce.force.vector_loops import CHUNK, REORDERED, add_gram, factorise

Array = NDArray[np.float64]

SPACINGS = (4, 2)
"""Distances of the nodes that are tried, in pixels."""
TAPS = 6
"""Nodes among which a pixel is shared out."""
EXACT = 3e-4
"""Relative error of the information in any direction that a spacing may cause."""


def spacing(influence: Array, used: NDArray[np.bool_]) -> int:
    """Largest distance of nodes at which the information of all pixels is kept.

    Parameters
    ----------
    influence : ndarray, shape (P, m)
        Influence matrix [rad/N].
    used : ndarray of bool, shape (P,)
        Pixels that count.
    """
    # slopes that no neighbour shares are harder than any fringes
    square = np.random.default_rng(0).random(len(influence)) * used
    whole = (influence.T * square) @ influence
    root = np.linalg.cholesky(whole + np.eye(len(whole)) * (1e-9 * np.trace(whole) + 1e-300))
    for every in SPACINGS:
        nodes = influence[::every]
        padded = np.zeros(len(nodes) * every, dtype=np.float32)
        padded[: len(square)] = square
        weight = np.zeros(len(nodes), dtype=np.float32)
        spread(padded, every, weight)
        off = np.linalg.solve(root, (nodes.T * weight) @ nodes - whole)
        if np.linalg.norm(np.linalg.solve(root, off.T), 2) < EXACT:
            return every
    return 1


@njit(cache=True, error_model="numpy")
def _lagrange(t, share) -> None:
    """Lagrange's polynomials of the nodes around a place t nodes behind the middle one."""
    for i in range(TAPS):
        product = 1.0
        for j in range(TAPS):
            if j != i:
                product *= (t + TAPS // 2 - 1 - j) / (i - j)
        share[i] = product


@njit(cache=True, error_model="numpy", fastmath=REORDERED)
def spread(square, every, weight) -> None:
    """Share out values over pixels, shape (nodes * every,), among nodes, shape (nodes,)."""
    nodes = len(weight)
    pixels = square[: nodes * every].reshape(nodes, every)
    column, share = np.empty(nodes, np.float32), np.empty(TAPS, np.float32)
    weight[:] = 0
    for d in range(every):
        _lagrange(d / every, share)
        column[:] = pixels[:, d]
        for i in range(TAPS):
            part, ahead = share[i], i + 1 - TAPS // 2
            low, high = max(0, -ahead), min(nodes, nodes - ahead)
            # slices, whose indices need no look at their signs, let the loop be vectorised
            source, target = column[low:high], weight[low + ahead : high + ahead]
            for k in range(len(source)):
                target[k] += part * source[k]
            # beyond the last nodes there is none; the strip's ends say next to nothing
            for k in range(low):
                weight[0] += part * column[k]
            for k in range(high, nodes):
                weight[nodes - 1] += part * column[k]


@njit(cache=True, error_model="numpy", nogil=True)
def fill_information(strip, square, matrix) -> None:
    """Fill in the lower triangle of the information of squared slopes, shape (chunks, CHUNK)."""
    nodes, every, count = strip[1], strip[13], strip[14]
    scaled = np.empty(nodes.shape[1:], dtype=np.float32)
    weight = np.zeros(nodes.shape[0] * CHUNK, dtype=np.float32)
    spread(square.reshape(-1), every, weight[:count])
    matrix[:] = 0
    for i in range(len(nodes)):
        add_gram(nodes[i], weight[i * CHUNK : (i + 1) * CHUNK], scaled, matrix)


@njit(cache=True, error_model="numpy", nogil=True)
def factorise_information(strip, square, ridge, factor) -> None:
    """Fill in the Cholesky factor of the information of squared slopes, shape (chunks, CHUNK)."""
    size = strip[9]
    fill_information(strip, square, factor)
    trace = 0.0
    for j in range(size):
        trace += factor[j, j]
    factorise(factor, size, ridge * trace + 1e-12)
