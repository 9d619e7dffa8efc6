"""Mirror symmetry of a pad: four kinds of load, each of which a quarter of the pad shows.

Pad and tactels are symmetric about the planes x = 0 and y = 0.  A load that is even or odd in x and
in y has stresses that are so as well, and the four kinds together make up any load.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

PARITIES = ((1, 1), (1, -1), (-1, 1), (-1, -1))
"""Kinds of load, by the sign that sigma_x - sigma_y takes in the mirrors x = 0 and y = 0."""
FIELDS = ((1, 1), (-1, -1))
"""Signs that a mirror image of a stress has of its own: sigma_x - sigma_y, and tau_xy."""
COMPONENTS = ((1, 1), (-1, 1), (1, -1))
"""Mirror signs of the components of a force, N, T_x and T_y."""


def load_basis(count: tuple[int, int], parity: tuple[int, int]) -> Array:
    """Orthonormal loads of one kind, shape (m, 3 n); their columns are those of forces (n, 3)."""
    n = count[0] * count[1]
    rows = []
    for component, own in enumerate(COMPONENTS):
        along, across = (_basis(count[axis], parity[axis] * own[axis]) for axis in (0, 1))
        patterns = np.kron(along, across)
        block = np.zeros((len(patterns), n, 3))
        block[:, :, component] = patterns
        rows.append(block.reshape(len(patterns), 3 * n))
    return np.concatenate(rows)


def _basis(count: int, sign: int) -> Array:
    """Orthonormal patterns along one axis that are even (1) or odd (-1), shape (m, count)."""
    half = count // 2
    pairs = np.zeros((half, count))
    pairs[np.arange(half), np.arange(half)] = np.sqrt(0.5)
    pairs[np.arange(half), count - 1 - np.arange(half)] = sign * np.sqrt(0.5)
    if sign < 0 or count % 2 == 0:
        return pairs
    return np.vstack([pairs, np.eye(count)[half]])


def unfold(
    quarter: NDArray[np.floating], signs: tuple[int, int], whole: NDArray[np.floating]
) -> None:
    """Add a quarter of the pad, shape (..., h, w), and its mirror images to the whole pad's field.

    Rows are along y, columns along x; the whole has the shape (..., 2 h, 2 w) and is contiguous.
    """
    h, w = quarter.shape[-2:]
    _unfold(quarter.reshape(-1, h, w), *signs, whole.reshape(-1, 2 * h, 2 * w))


def fold(whole: NDArray[np.floating], signs: tuple[int, int]) -> NDArray[np.floating]:
    """The transpose of `unfold`: a quarter, shape (..., h, w)."""
    h, w = whole.shape[-2] // 2, whole.shape[-1] // 2
    x, y = (np.asarray(sign, dtype=whole.dtype) for sign in signs)
    rows = whole[..., :h, :] + y * whole[..., : h - 1 : -1, :]
    return rows[..., :w] + x * rows[..., : w - 1 : -1]


def folded_weights(weights: Array, sign: int) -> Array:
    """Weights of the first half, whose mirror image the other half is, from those of all.

    Parameters
    ----------
    weights : ndarray, shape (k, n)
        Of an even number n of values along an axis.
    sign : int
        That the values take in the mirror.

    Returns
    -------
    ndarray, shape (k, n / 2)
    """
    half = weights.shape[1] // 2
    return np.asarray(weights[:, :half] + sign * weights[:, : half - 1 : -1])


@njit(cache=True, error_model="numpy", nogil=True)
def _unfold(quarter, x, y, whole) -> None:
    x, y = quarter.dtype.type(x), quarter.dtype.type(y)
    _, rows, columns = whole.shape
    for k in range(len(quarter)):
        for i in range(quarter.shape[1]):
            for j in range(quarter.shape[2]):
                value = quarter[k, i, j]
                whole[k, i, j] += value
                whole[k, i, columns - 1 - j] += x * value
                whole[k, rows - 1 - i, j] += y * value
                whole[k, rows - 1 - i, columns - 1 - j] += x * y * value
