"""Block-tridiagonal systems: what the elimination of columns or slabs leaves of a tensor mesh."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky
from scipy.linalg.lapack import dtrtrs  # pyrefly: ignore[missing-module-attribute]

from fringeforce.base.arrays import Array, Mask


@dataclass(frozen=True)
class BlockCholesky:
    """A factorised chain of unknowns; `held` marks those that are zero."""

    held: Mask  # (links, unknowns of a link)
    diagonal: list[Array]  # lower Cholesky factors
    lower: list[Array]  # the blocks to the left of them

    def solve(self, loads: Array) -> Array:
        """Displacements for forces of shape (links, unknowns of a link, cases)."""
        return self._backward(self._forward(loads))

    def solve_both(self, loads: Array, other: BlockCholesky) -> tuple[Array, Array]:
        """Displacements in this chain and in one that differs from it in its last link alone."""
        values = self._forward(loads)
        others = values.copy()
        others[-1] = other._forward_last(loads, values[-2])
        return self._backward(values), other._backward(others)

    def _forward(self, loads: Array) -> Array:
        """Values by the lower factor; cases that load later links only are zero before these."""
        values = np.where(self.held[..., None], 0.0, loads)
        numbers = np.where(values.any(axis=1), np.arange(1, values.shape[-1] + 1), 0)
        for i, count in enumerate(np.maximum.accumulate(numbers.max(axis=1, initial=0))):
            here = values[i, :, :count]
            if i:
                here -= self.lower[i] @ values[i - 1, :, :count]
            here[:] = forward(self.diagonal[i], here)
        return values

    def _forward_last(self, loads: Array, before: Array) -> Array:
        """The last of these values, from the one before it."""
        last = np.where(self.held[-1, :, None], 0.0, loads[-1]) - self.lower[-1] @ before
        return forward(self.diagonal[-1], last)

    def _backward(self, values: Array) -> Array:
        """Displacements from the values of `_forward`, in their place."""
        for i in reversed(range(len(values))):
            if i + 1 < len(values):
                values[i] -= self.lower[i + 1].T @ values[i + 1]
            values[i] = backward(self.diagonal[i], values[i])
        return values

    def followed_by(self, block: Array, off: Array, fixed: Mask) -> BlockCholesky:
        """The chain with one more link: its own stiffness, and what couples it to the last."""
        off[fixed] = 0.0
        block[fixed], block[:, fixed] = 0.0, 0.0
        block[fixed, fixed] = 1.0
        if self.diagonal:
            off[:, self.held[-1]] = 0.0
            off = forward(self.diagonal[-1], off.T).T
            block -= off @ off.T
        factor = cholesky(block, lower=True, overwrite_a=True, check_finite=False)
        held = np.concatenate([self.held, fixed[None]])
        return BlockCholesky(held, [*self.diagonal, factor], [*self.lower, off])

    def held_last(self, stiffness: Array, fixed: Mask) -> BlockCholesky:
        """The chain, of two links or more, with its last link held in another way.

        Parameters
        ----------
        stiffness : ndarray, shape (2 u, 2 u)
            Stiffness of the last pair of links.
        fixed : ndarray of bool, shape (u,)
            Unknowns of the last link that are held at zero.
        """
        size = fixed.size
        shorter = BlockCholesky(self.held[:-1], self.diagonal[:-1], self.lower[:-1])
        return shorter.followed_by(
            stiffness[size:, size:].copy(), stiffness[size:, :size].copy(), fixed
        )


def block_cholesky(stiffness: Iterable[Array], held: Mask) -> BlockCholesky:
    """Factor a chain.

    Parameters
    ----------
    stiffness : iterable of ndarray, shape (2 u, 2 u)
        Stiffness of each pair of neighbouring links, left one first; they add up.
    held : ndarray of bool, shape (links, u)
        Unknowns that are held at zero.
    """
    size = held.shape[1]
    left = np.zeros((2 * size, 2 * size))
    chain = BlockCholesky(held[:0], [], [])
    for right, fixed in zip(stiffness, held[:-1], strict=True):
        block = left[size:, size:] + right[:size, :size]
        chain = chain.followed_by(block, left[size:, :size].copy(), fixed)
        left = right
    return chain.followed_by(left[size:, size:].copy(), left[size:, :size].copy(), held[-1])


def forward(factor: Array, values: Array) -> Array:
    """Solve with a lower triangular factor."""
    return dtrtrs(factor, values, lower=1)[0]


def backward(factor: Array, values: Array) -> Array:
    """Solve with the transpose of a lower triangular factor."""
    return dtrtrs(factor, values, lower=1, trans=1)[0]
