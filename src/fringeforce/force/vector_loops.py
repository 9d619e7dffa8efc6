"""Loops over pixels that the compiler turns into vector instructions, in single precision.

Pixels come in chunks that stay in the fastest cache: an array over pixels has the shape
(chunks, CHUNK), a matrix (chunks, rows, CHUNK).  Single precision costs 1e-5 rad of phase, where
noise costs 1e-2 rad and more.
"""

from __future__ import annotations

from math import factorial

import numpy as np
from numba import njit
from numpy.typing import NDArray

Single = NDArray[np.float32]
Array = NDArray[np.float64]

CHUNK = 256
"""Pixels of a chunk."""
ROWS = 12
"""Rows of a matrix come in multiples of this, so that loops over fours and threes end evenly."""

# The order of sums is left to the compiler, which needs that freedom to vectorise them; numbers
# that are not finite keep their meaning.
REORDERED = {"contract", "reassoc", "nsz"}
_ONE, _HALF = np.float32(1), np.float32(0.5)
_PER_PI = np.float32(1 / np.pi)
_PI, _PI_REST = np.float32(3.140625), np.float32(np.pi - 3.140625)
_S3, _S5, _S7, _S9, _S11 = (np.float32((-1) ** (k // 2) / factorial(k)) for k in (3, 5, 7, 9, 11))
_C2, _C4, _C6, _C8, _C10, _C12 = (
    np.float32((-1) ** (k // 2) / factorial(k)) for k in (2, 4, 6, 8, 10, 12)
)


def chunked(values: Array, fill: float = 0.0) -> Single:
    """Values over pixels in chunks, the last one filled up, shape (chunks, CHUNK)."""
    chunks = -(-len(values) // CHUNK)
    padded = np.full(chunks * CHUNK, fill, dtype=np.float32)
    padded[: len(values)] = values
    return padded.reshape(chunks, CHUNK)


def chunked_matrix(matrix: Array) -> Single:
    """A matrix over pixels (P, m) in chunks, shape (chunks, rows, CHUNK); new rows are zero."""
    rows = -(-matrix.shape[1] // ROWS) * ROWS
    columns = [chunked(column) for column in matrix.T]
    columns += [np.zeros_like(columns[0])] * (rows - len(columns))
    return np.ascontiguousarray(np.stack(columns, axis=1))


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def expose(
    phase: Single,
    amplitude: Single,
    offset: Single,
    steepness: Single,
    level: Single,
    slope: Single,
) -> None:
    """Fill in A sin^2(p/2) + I_o and s sin(p/2) cos(p/2) for one chunk, to single precision.

    Both have the period pi in p/2, so no quadrant needs to be kept.  Half a period either side of
    zero Taylor's series is exact enough; pi is taken off in two parts that keep the digits (Cody
    and Waite, Software Manual for the Elementary Functions, 1980).
    """
    for k in range(len(phase)):
        half = phase[k] * _HALF
        turns = np.floor(half * _PER_PI + _HALF)
        half = (half - turns * _PI) - turns * _PI_REST
        x = half * half
        sine = half * (_ONE + x * (_S3 + x * (_S5 + x * (_S7 + x * (_S9 + x * _S11)))))
        cosine = _ONE + x * (_C2 + x * (_C4 + x * (_C6 + x * (_C8 + x * (_C10 + x * _C12)))))
        level[k] = amplitude[k] * (sine * sine) + offset[k]
        slope[k] = steepness[k] * (sine * cosine)


@njit(cache=True, error_model="numpy", fastmath=REORDERED)
def square_sum(values: Single) -> np.float32:
    """Sum of squares over one chunk."""
    total = np.float32(0)
    for k in range(len(values)):
        total += values[k] * values[k]
    return total


@njit(cache=True, error_model="numpy")
def count_beyond(values: Single, square: np.float32) -> np.int32:
    """Number of values in one chunk whose square exceeds a limit."""
    count = np.int32(0)
    for k in range(len(values)):
        count += np.int32(values[k] * values[k] > square)
    return count


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def combine(matrix: Single, loads: Single, bias: Single, phase: Single) -> None:
    """Fill in the phase of one chunk: a bias and the sum of the matrix's rows times loads."""
    rows, pixels = matrix.shape
    for k in range(pixels):
        phase[k] = bias[k]
    for j in range(0, rows, 4):
        a, b, c, d = loads[j], loads[j + 1], loads[j + 2], loads[j + 3]
        p, q, r, s = matrix[j], matrix[j + 1], matrix[j + 2], matrix[j + 3]
        for k in range(pixels):
            phase[k] += a * p[k] + b * q[k] + (c * r[k] + d * s[k])


@njit(cache=True, error_model="numpy", fastmath=REORDERED)
def add_products(matrix: Single, values: Single, total: Array) -> None:
    """Add the products of one chunk's rows with values over its pixels, shape (rows,)."""
    rows, pixels = matrix.shape
    for j in range(0, rows, 4):
        p, q, r, s = matrix[j], matrix[j + 1], matrix[j + 2], matrix[j + 3]
        a, b, c, d = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
        for k in range(pixels):
            value = values[k]
            a += p[k] * value
            b += q[k] * value
            c += r[k] * value
            d += s[k] * value
        total[j] += a
        total[j + 1] += b
        total[j + 2] += c
        total[j + 3] += d


@njit(cache=True, error_model="numpy", fastmath=REORDERED)
def add_gram(matrix: Single, weight: Single, scaled: Single, total: Array) -> None:
    """Add one chunk's weighted rows times its rows; of `total` the lower triangle is valid.

    Nine products at a time, so that every number loaded is used three times.
    """
    rows, pixels = matrix.shape
    for j in range(rows):
        for k in range(pixels):
            scaled[j, k] = matrix[j, k] * weight[k]
    for i in range(0, rows, 3):
        a, b, c = scaled[i], scaled[i + 1], scaled[i + 2]
        for j in range(0, i + 1, 3):
            p, q, r = matrix[j], matrix[j + 1], matrix[j + 2]
            ap, aq, ar = np.float32(0), np.float32(0), np.float32(0)
            bp, bq, br = np.float32(0), np.float32(0), np.float32(0)
            cp, cq, cr = np.float32(0), np.float32(0), np.float32(0)
            for k in range(pixels):
                ap += a[k] * p[k]
                aq += a[k] * q[k]
                ar += a[k] * r[k]
                bp += b[k] * p[k]
                bq += b[k] * q[k]
                br += b[k] * r[k]
                cp += c[k] * p[k]
                cq += c[k] * q[k]
                cr += c[k] * r[k]
            total[i, j] += ap
            total[i, j + 1] += aq
            total[i, j + 2] += ar
            total[i + 1, j] += bp
            total[i + 1, j + 1] += bq
            total[i + 1, j + 2] += br
            total[i + 2, j] += cp
            total[i + 2, j + 1] += cq
            total[i + 2, j + 2] += cr


@njit(cache=True, error_model="numpy")
def factorise(matrix: Array, size: int, ridge: float) -> None:
    """Cholesky factor of the leading block, in place in the lower triangle."""
    for j in range(size):
        pivot = matrix[j, j] + ridge
        for k in range(j):
            pivot -= matrix[j, k] * matrix[j, k]
        pivot = np.sqrt(max(pivot, ridge))
        matrix[j, j] = pivot
        for i in range(j + 1, size):
            rest = matrix[i, j]
            for k in range(j):
                rest -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = rest / pivot


@njit(cache=True, error_model="numpy")
def solve(factor: Array, size: int, right: Array, solution: Array) -> None:
    """Solve with a Cholesky factor; `right` and `solution` may be the same array."""
    for i in range(size):
        rest = right[i]
        for k in range(i):
            rest -= factor[i, k] * solution[k]
        solution[i] = rest / factor[i, i]
    for i in range(size - 1, -1, -1):
        rest = solution[i]
        for k in range(i + 1, size):
            rest -= factor[k, i] * solution[k]
        solution[i] = rest / factor[i, i]


@njit(cache=True, error_model="numpy", fastmath=REORDERED)
def invert_factor(factor: Array, half: Array) -> None:
    """Fill in the inverse of the leading block of a Cholesky factor; `half` comes full of zeros."""
    for i in range(len(half)):
        row = half[i]
        for k in range(i):
            weight, other = factor[i, k], half[k]
            for j in range(k + 1):
                row[j] -= weight * other[j]
        for j in range(i):
            row[j] /= factor[i, i]
        row[i] = 1 / factor[i, i]


@njit(cache=True, error_model="numpy", fastmath=REORDERED)
def invert(factor: Array, inverse: Array) -> None:
    """Inverse of a matrix from the leading block of its Cholesky factor, shape (size, size)."""
    size = len(inverse)
    half = np.zeros((size, size))
    invert_factor(factor, half)
    inverse[:] = 0
    for k in range(size):
        other = half[k]
        for i in range(k + 1):
            weight, row = other[i], inverse[i]
            for j in range(k + 1):
                row[j] += weight * other[j]
