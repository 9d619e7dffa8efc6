"""A large matrix in whole numbers of 16 bits, for its products take as long as it takes to read it.

Every row has a scale of its own, so that an entry is off by less than two in 100,000 of the largest
of its row: a hundredth of what depth profiles leave out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fringeforce.base.linear_map import LinearMap

Array = NDArray[np.float64]
Single = NDArray[np.float32]

LARGEST_INTEGER = 32767
"""Largest whole number of 16 bits."""
TOGETHER = 512
"""Rows that are summed in single precision."""


@dataclass(frozen=True, eq=False)
class Packed(LinearMap):
    """A matrix of whole numbers, and what each row of them is multiplied by.

    Attributes
    ----------
    numbers : ndarray of int16, shape (rows, columns)
    scale : ndarray, shape (rows,)
    """

    numbers: NDArray[np.int16]
    scale: Single

    @classmethod
    def of(cls, matrix: Single) -> Packed:
        """The nearest to a matrix."""
        scale = np.abs(matrix).max(axis=1, initial=0) / np.float32(LARGEST_INTEGER)
        whole = np.divide(
            matrix, scale[:, None], out=np.zeros_like(matrix), where=scale[:, None] > 0
        )
        return cls(np.rint(whole).astype(np.int16), scale)

    @property
    def shapes(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Those of vectors of columns and of rows."""
        return self.numbers.shape[1:], self.scale.shape

    def forward(self, values: Single) -> Single:
        """The matrix times a vector, shape (columns,) to (rows,)."""
        found = np.empty(len(self.scale), dtype=np.float32)
        _product(self.numbers, self.scale, values, found)
        return found

    def adjoint(self, values: Single) -> Array:
        """A vector times the matrix, shape (rows,) to (columns,)."""
        found = np.zeros(self.numbers.shape[1])
        _adjoint(self.numbers, self.scale * values, found)
        return found


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, nogil=True)
def _product(numbers, scale, vector, found) -> None:
    for i in range(len(found)):
        row, total = numbers[i], np.float32(0)
        for j in range(len(vector)):
            total += np.float32(row[j]) * vector[j]
        found[i] = total * scale[i]


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"}, nogil=True)
def _adjoint(numbers, vector, found) -> None:
    part = np.empty(len(found), dtype=np.float32)
    for start in range(0, len(vector), TOGETHER):
        part[:] = 0
        for i in range(start, min(start + TOGETHER, len(vector))):
            row, share = numbers[i], vector[i]
            for j in range(len(part)):
                part[j] += share * np.float32(row[j])
        found += part
