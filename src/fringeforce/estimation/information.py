"""Fisher's information of the loads: every pixel's slope counts, but few products are formed.

The slopes change from pixel to pixel, fringe by fringe; the influence does so only over the depth
of the cover.  So products are formed at the nodes, among which the squared slopes of all pixels are
shared out.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, solve_triangular

from fringeforce.estimation.compiling import inner
from fringeforce.estimation.layout import TAPS, Layout
from fringeforce.estimation.vector_loops import add_gram, factorise, gather, multiply_factors

Array = NDArray[np.float64]

SPACINGS = (8, 4, 2)
"""Distances of the nodes that are tried, in pixels."""
BLOCK = 512
"""Nodes whose products are summed in single precision, and stay in the fastest cache."""
LOST = 1e-5
"""Share of the largest information in a direction, below which single precision loses it."""
NO_TRACE = 1e-9
"""Share of all information in a direction, below which a frame says nothing of it."""
EXACT = 5e-3
"""Relative error of the information in any direction that a spacing may cause."""
TRIAL_PACES = (0.03, 0.1, 0.3, 0.6)
"""Largest phases between neighbouring pixels of frames that this is tried on [rad]."""


def even_units(influence: Array, used: NDArray[np.bool_]) -> Array:
    """Units of the loads in which evenly spread squared slopes have the information one.

    Tactels that lie close together differ by little; in newtons the information of what they differ
    by is lost in single precision beside that of their sum, in these units it is as large.  Where
    nothing is lost in newtons, they are newtons, which is faster.

    Parameters
    ----------
    influence : ndarray, shape (P, m)
        Influence matrix [rad/N].
    used : ndarray of bool, shape (P,)
        Pixels that count.

    Returns
    -------
    ndarray, shape (m, m)
        R, lower triangular, with R R' the information where all slopes are one [rad/N]; or the
        unit matrix.
    """
    whole = (influence.T * used) @ influence
    values = np.linalg.eigvalsh(whole)
    if values[0] > LOST * values[-1]:
        return np.eye(len(whole))
    return np.linalg.cholesky(whole + np.eye(len(whole)) * (1e-14 * np.trace(whole) + 1e-300))


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
    even = solve_triangular(even_units(influence, used), influence.T, lower=True).T
    layouts = [Layout(len(influence), channels, every) for every in SPACINGS]
    return next(
        (
            layout.every
            for layout in layouts
            if layout.nodes >= TAPS
            and all(
                _is_kept(layout, even, square * used) for square in _trial_squares(influence, used)
            )
        ),
        1,
    )


def _trial_squares(influence: Array, used: NDArray[np.bool_]) -> Iterator[Array]:
    """Squared slopes that a frame of this design may have, shape (P,) each."""
    rng = np.random.default_rng(0)
    # slopes that no neighbour shares are harder than most fringes
    yield rng.random(len(influence))
    pace = np.abs(np.diff(influence, axis=0)).max() or 1.0
    for densest in TRIAL_PACES:
        loads = rng.uniform(-1, 1, influence.shape[1])
        yield np.sin(influence @ loads * (densest / pace)) ** 2


def _is_kept(layout: Layout, even: Array, square: Array) -> bool:
    """Whether the nodes keep the information of squared slopes, in every direction."""
    whole = (even.T * square) @ even
    nodes = layout.at_nodes(even).astype(float)
    weight = np.zeros(nodes.shape[1], dtype=np.float32)
    gather(layout.lay(square), layout.shares, weight)
    ridge = np.eye(len(whole)) * (NO_TRACE * np.trace(whole) + 1e-300)
    values = eigh((nodes * weight) @ nodes.T + ridge, whole + ridge, eigvals_only=True)
    return bool(np.abs(values - 1).max() < EXACT)


@inner
def fill_information(nodes, shares, square, matrix) -> None:
    """Fill in the lower triangle of the information of squared slopes, shape (size,).

    In the units of the nodes that are given: newtons, or `even_units`.
    """
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
    fill_information(strip.even, strip.shares, square, factor)
    trace = 0.0
    for j in range(size):
        trace += factor[j, j]
    factorise(factor, size, ridge * trace + 1e-12)
    if not strip.plain:
        multiply_factors(strip.units, factor)
