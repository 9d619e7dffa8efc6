"""Fisher's information of the loads: every pixel's slope counts, but few products are formed.

The slopes change from pixel to pixel, fringe by fringe; the influence does so only over the depth
of the cover.  So products are formed at the nodes, among which the squared slopes of all pixels are
shared out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import inner
from fringeforce.estimation.layout import TAPS, Layout
from fringeforce.estimation.vector_loops import add_gram, factorise, gather

Array = NDArray[np.float64]

SPACINGS = (8, 4, 2)
"""Distances of the nodes that are tried, in pixels."""
BLOCK = 512
"""Nodes whose products are summed in single precision, and stay in the fastest cache."""
EXACT = 2e-3
"""Relative error of the information in any direction that a spacing may cause."""


def spacing(influence: Array, used: NDArray[np.bool_], channels: int = 1) -> int:
    """Largest distance of nodes at which the information of all pixels is kept.

    Parameters
    ----------
    influence : ndarray, shape (P, m)
        Influence matrix [rad/N].
    used : ndarray of bool, shape (P,)
        Pixels that count.
    channels : int
        Channels that they belong to, one after the other.
    """
    # slopes that no neighbour shares are harder than any fringes
    square = np.random.default_rng(0).random(len(influence)) * used
    whole = (influence.T * square) @ influence
    root = np.linalg.cholesky(whole + np.eye(len(whole)) * (1e-9 * np.trace(whole) + 1e-300))
    for every in SPACINGS:
        layout = Layout(len(influence), channels, every)
        if layout.nodes < TAPS:
            continue
        nodes = layout.at_nodes(influence).astype(float)
        weight = np.zeros(nodes.shape[1], dtype=np.float32)
        gather(layout.lay(square), layout.shares, weight)
        off = np.linalg.solve(root, (nodes * weight) @ nodes.T - whole)
        if np.linalg.norm(np.linalg.solve(root, off.T), 2) < EXACT:
            return every
    return 1


@inner
def fill_information(strip, square, matrix) -> None:
    """Fill in the lower triangle of the information of squared slopes, shape (size,)."""
    nodes, shares = strip.nodes, strip.shares
    rows, places = nodes.shape
    weight = np.empty(places, dtype=np.float32)
    gather(square, shares, weight)
    matrix[:] = 0
    for first in range(0, places, BLOCK):
        scaled = np.empty((rows, min(BLOCK, places - first)), dtype=np.float32)
        add_gram(nodes, weight, first, scaled, matrix)


@inner
def factorise_information(strip, square, ridge, factor) -> None:
    """Fill in the Cholesky factor of the information of squared slopes, shape (size,)."""
    size = strip.loads
    fill_information(strip, square, factor)
    trace = 0.0
    for j in range(size):
        trace += factor[j, j]
    factorise(factor, size, ridge * trace + 1e-12)
