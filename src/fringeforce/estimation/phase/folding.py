"""What a noisy frame says of the phase before any model: how fast it runs, and where it may be.

Intensity folds the phase: I = sin^2(p/2) is met by p = +-w + 2 pi q with w = 2 arcsin sqrt(I).
Folding keeps the pace, |dw/dx| = |dp/dx|, so the pace is known everywhere and the phase up to a
sign and a multiple.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d

from fringeforce.estimation.compiling import entry

Array = NDArray[np.float64]

WINDOW = 32
"""Pixels over which the local pace is averaged."""
SURELY = 3.0
"""Standard deviations by which noise must be smaller than stated to be taken as smaller."""
BROKEN = 9.0
"""Squared deviations as far as which a second difference counts."""


def phase_pace(intensity: Array, variance: float, seen: NDArray[np.bool_]) -> Array:
    """Local pace of the phase from the mean square step of the intensity.

    For a phase that runs evenly by k per pixel the mean square step of sin^2(p/2) is
    (1 - cos k) / 4, plus twice the noise's variance: as stated, or as the line shows it if that is
    surely less, for too much would leave slow phases no pace.

    Parameters
    ----------
    intensity : ndarray, shape (P,)
        Normalised intensity, noise included.
    variance : float
        Of the noise of one pixel, as stated.
    seen : ndarray of bool, shape (P,)
        Pixels that show it; gaps between them are bridged.

    Returns
    -------
    ndarray, shape (P,)
        Magnitude of the phase's step from pixel to pixel, 0 to pi [rad].
    """
    window = min(WINDOW, len(intensity) - 1)
    steps = np.diff(intensity) ** 2
    shown = shown_noise(intensity, variance, seen)
    before = window // 2
    padded = np.pad(steps, (before, window - before), mode="edge")
    mean = np.convolve(padded, np.full(window, 1 / window), mode="valid")[: len(intensity)]
    return np.arccos(np.clip(1 - 4 * np.maximum(mean - 2 * shown, 0), -1, 1))


def shown_noise(intensity: Array, variance: float, seen: NDArray[np.bool_]) -> float:
    """Variance of the noise that a line shows, from second differences, or the stated one.

    These are six times the variance in the mean, plus what fringes make them, which is more than
    that where they are fast.  Single pixels that are broken count as far as noise reaches.
    """
    squares = np.diff(intensity, 2)[seen[2:] & seen[1:-1] & seen[:-2]] ** 2 / 6
    if not len(squares):
        return variance
    mean = float(np.minimum(squares, BROKEN * variance).mean())
    # the relative deviation of the mean of so many squares is 1.97 over the root of their number
    return min(mean * (1 + SURELY * 1.97 / np.sqrt(len(squares))), variance)


def block_edges(pace: Array, extent: float, largest: int = 8) -> NDArray[np.intp]:
    """Cut a frame into blocks that are long where the phase is slow and short where it runs.

    Parameters
    ----------
    pace : ndarray, shape (P,)
        Local pace of the phase [rad per pixel].
    extent : float
        Phase that a block may span [rad].
    largest : int
        Pixels that a block may span.

    Returns
    -------
    ndarray of int, shape (b + 1,)
        Boundaries of the blocks, from 0 to P.
    """
    length = np.clip(extent / np.maximum(pace, 1e-9), 1, largest).astype(np.intp)
    # no block is longer than any pixel within its reach allows
    return _edges(minimum_filter1d(length, largest, origin=-(largest // 2), mode="nearest"))


@entry
def _edges(allowed):
    """Boundaries of blocks that are as long as each pixel where one begins allows."""
    edges, count = np.zeros(len(allowed) + 1, np.intp), 0
    while edges[count] < len(allowed):
        edges[count + 1] = edges[count] + allowed[edges[count]]
        count += 1
    edges[count] = len(allowed)
    return edges[: count + 1]


@entry
def block_means(rows, edges):
    """Means of rows over blocks.

    Parameters
    ----------
    rows : ndarray, shape (P, k)
        One for each pixel.
    edges : ndarray of int, shape (b + 1,)
        As of `block_edges`.

    Returns
    -------
    ndarray, shape (b, k)
        For each block.
    """
    found = np.zeros((len(edges) - 1, rows.shape[1]))
    for b in range(len(found)):
        own, share = found[b], 1.0 / (edges[b + 1] - edges[b])
        for p in range(edges[b], edges[b + 1]):
            row = rows[p]
            for i in range(len(own)):
                own[i] += share * row[i]
    return found
