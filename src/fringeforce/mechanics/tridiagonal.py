"""Block-tridiagonal systems: what the elimination of columns or slabs leaves of a tensor mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky
from scipy.linalg.lapack import dtrtrs  # pyright: ignore[reportAttributeAccessIssue]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BlockCholesky:
    """A factorised chain of unknowns; `held` marks those that are zero."""

    held: NDArray[np.bool_]  # (links, unknowns of a link)
    diagonal: list[Array]  # lower Cholesky factors
    lower: list[Array]  # the blocks to the left of them

    def solve(self, loads: Array) -> Array:
        """Displacements for forces of shape (links, unknowns of a link, cases)."""
        values = np.where(self.held[..., None], 0.0, loads)
        for i, (factor, lower) in enumerate(zip(self.diagonal, self.lower, strict=True)):
            if i:
                values[i] -= lower @ values[i - 1]
            values[i] = forward(factor, values[i])
        for i in reversed(range(len(values))):
            if i + 1 < len(values):
                values[i] -= self.lower[i + 1].T @ values[i + 1]
            values[i] = backward(self.diagonal[i], values[i])
        return values


def block_cholesky(stiffness: Sequence[Array], held: NDArray[np.bool_]) -> BlockCholesky:
    """Factor a chain.

    Parameters
    ----------
    stiffness : sequence of ndarray, shape (2 u, 2 u)
        Of each pair of neighbouring links, left one first; they add up.
    held : ndarray of bool, shape (links, u)
        Unknowns that are held at zero.
    """
    size = held.shape[1]
    diagonal: list[Array] = []
    lower: list[Array] = []
    for i, fixed in enumerate(held):
        block = np.zeros((size, size))
        off = np.zeros((size, size if i else 0))
        if i:
            block += stiffness[i - 1][size:, size:]
            off += stiffness[i - 1][size:, :size]
        if i < len(stiffness):
            block += stiffness[i][:size, :size]
        off[fixed] = 0.0
        block[fixed], block[:, fixed] = 0.0, 0.0
        block[fixed, fixed] = 1.0
        if i:
            off[:, held[i - 1]] = 0.0
            off = forward(diagonal[-1], off.T).T
            block -= off @ off.T
        diagonal.append(cholesky(block, lower=True, overwrite_a=True, check_finite=False))
        lower.append(off)
    return BlockCholesky(held, diagonal, lower)


def forward(factor: Array, values: Array) -> Array:
    """Solve with a lower triangular factor."""
    return dtrtrs(factor, values, lower=1)[0]


def backward(factor: Array, values: Array) -> Array:
    """Solve with the transpose of a lower triangular factor."""
    return dtrtrs(factor, values, lower=1, trans=1)[0]
