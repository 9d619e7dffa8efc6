"""Smooth random fields by their Karhunen-Loeve modes, along a line and over a rectangle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Index, Single

ALL = slice(None)
COARSE = 4
"""Of so many places one counts for the mean square of a field that is smooth from one to the
next."""
KEPT = 32
"""Fields whose modes are kept, some hundred kilobytes each: sensors of one design share them."""


def karhunen_loeve(x: Array, length: float, smallest: float) -> Array:
    """Modes of a Gaussian process of unit variance, shape (k, s): sum_k e_k row_k, e_k ~ N(0, 1).

    The covariance is `squared_exponential`; its eigenvectors are the Karhunen-Loeve modes
    (Rasmussen and Williams, Gaussian Processes for Machine Learning, section 4.3).

    Parameters
    ----------
    x : ndarray, shape (s,)
        Places [m].
    length : float
        Correlation length [m].
    smallest : float
        Variance of a mode, relative to the largest, below which it is left out.
    """
    return _modes(np.asarray(x, dtype=float).tobytes(), float(length), float(smallest)).copy()


@lru_cache(maxsize=KEPT)
def _modes(places: bytes, length: float, smallest: float) -> Array:
    """As `karhunen_loeve`, of places as they are stored."""
    values, vectors = np.linalg.eigh(squared_exponential(np.frombuffer(places), length))
    order = np.argsort(-values)
    kept = order[: int(np.sum(values > smallest * values.max()))]
    return np.ascontiguousarray((vectors[:, kept] * np.sqrt(values[kept])).T)


def squared_exponential(x: Array, length: float) -> Array:
    """Covariance exp(-(distance / length)^2 / 2) between places x (s,) [m], shape (s, s)."""
    return np.asarray(np.exp(-np.square(np.subtract.outer(x, x) / length) / 2))


@dataclass(frozen=True, eq=False)
class SmoothField:
    """A field over a rectangle, of which every mode is one along y times one along x.

    Attributes
    ----------
    across, along : ndarray, shapes (a, m), (b, n)
        Modes along y and along x, scaled by the field's standard deviation: at places, or as
        coefficients of splines.
    chosen : ndarray of int, shape (k, 2)
        Numbers of those that each of the k modes is the product of.
    """

    across: Array
    along: Array
    chosen: NDArray[np.intp]

    @classmethod
    def of(
        cls, places: tuple[Array, Array], lengths: tuple[float, float], std: float, smallest: float
    ) -> SmoothField:
        """That at places along y and along x [m].

        Parameters
        ----------
        places : (ndarray, ndarray), shapes (m,), (n,)
            Along y and along x [m].
        lengths : (float, float)
            Correlation lengths [m].
        std : float
            Standard deviation, in the field's unit.
        smallest : float
            Variance of a mode, relative to the largest, below which it is left out.
        """
        across, along = (
            karhunen_loeve(x, length, smallest) for x, length in zip(places, lengths, strict=True)
        )
        sizes = np.outer(np.square(across).sum(axis=1), np.square(along).sum(axis=1))
        return cls(std * across, along, np.argwhere(sizes > smallest * sizes.max()))

    def __len__(self) -> int:
        return len(self.chosen)

    def turned(self, across: Array, along: Array) -> SmoothField:
        """The same modes by matrices (m, m') and (n, n'): as splines, or at other places."""
        return SmoothField(self.across @ across, self.along @ along, self.chosen)

    def field(self, unknowns: Array) -> Array:
        """Sum of the modes, shape (..., m, n), from their standardised unknowns (..., k)."""
        shares = np.zeros((*unknowns.shape[:-1], len(self.across), len(self.along)))
        shares[..., self.chosen[:, 0], self.chosen[:, 1]] = unknowns
        return np.asarray(self.across.T @ shares @ self.along)

    def adjoint(self, image: Array | Single) -> Array:
        """Derivative by the unknowns (..., k) from that by the field (..., m, n)."""
        shares = self.across @ image @ self.along.T
        return np.asarray(shares[..., self.chosen[:, 0], self.chosen[:, 1]])

    def modes(self, rows: Index | slice = ALL, columns: Index | slice = ALL) -> Single:
        """Every mode at all pairs of rows and columns, shape (k, r * c)."""
        across, along = self.across[self.chosen[:, 0]], self.along[self.chosen[:, 1]]
        fields = across[:, rows, None] * along[:, None, columns]
        return np.asarray(fields.reshape(len(self), -1), dtype=np.float32)

    def square(self, squares: Array) -> float:
        """Mean square of the field, from those of its unknowns (k,)."""
        every = slice(None, None, COARSE)
        return float(np.square(self.modes(every, every)).mean(axis=1) @ squares)
