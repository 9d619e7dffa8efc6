"""Loops over pixels that the compiler turns into vector instructions, in single precision.

Single precision costs 1e-5 rad of phase, where noise costs 1e-2 rad and more.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.polynomial import Chebyshev, Polynomial
from numpy.typing import NDArray

Single = NDArray[np.float32]
Array = NDArray[np.float64]


# The order of sums is left to the compiler, which needs that freedom to vectorise them; numbers
# that are not finite keep their meaning.
REORDERED = {"contract", "reassoc", "nsz"}
_HALF = np.float32(0.5)
_PER_PI = np.float32(1 / np.pi)
_PI, _PI_REST = np.float32(3.140625), np.float32(np.pi - 3.140625)
# through Chebyshev's nodes of half a period, in the square: right within 5e-8
_SINE, _COSINE = (
    Chebyshev.interpolate(function, 4, [0, np.pi**2 / 4]).convert(kind=Polynomial).coef
    for function in (lambda x: np.sinc(np.sqrt(x) / np.pi), lambda x: np.cos(np.sqrt(x)))
)
_S1, _S3, _S5, _S7, _S9 = _SINE.astype(np.float32)
_C0, _C2, _C4, _C6, _C8 = _COSINE.astype(np.float32)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def waves(phase: np.float32) -> tuple[np.float32, np.float32]:
    """Sine and cosine of half a phase, both perhaps with the other sign, to single precision.

    Their squares and their product have the period pi in p/2, so no quadrant needs to be kept.  Pi
    is taken off in two parts that keep the digits (Cody and Waite, Software Manual for the
    Elementary Functions, 1980).
    """
    half = phase * _HALF
    turns = np.floor(half * _PER_PI + _HALF)
    half = (half - turns * _PI) - turns * _PI_REST
    x = half * half
    sine = half * (_S1 + x * (_S3 + x * (_S5 + x * (_S7 + x * _S9))))
    cosine = _C0 + x * (_C2 + x * (_C4 + x * (_C6 + x * _C8)))
    return sine, cosine


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def combine(matrix: Single, loads: Single, bias: Single, phase: Single) -> None:
    """Fill in the phase: a bias and the sum of the matrix's rows times loads."""
    rows, pixels = matrix.shape
    for k in range(pixels):
        phase[k] = bias[k]
    for j in range(0, rows, 4):
        a, b, c, d = loads[j], loads[j + 1], loads[j + 2], loads[j + 3]
        p, q, r, s = matrix[j], matrix[j + 1], matrix[j + 2], matrix[j + 3]
        for k in range(pixels):
            phase[k] += a * p[k] + b * q[k] + (c * r[k] + d * s[k])


@njit(cache=True, error_model="numpy", fastmath=REORDERED)
def add_products(matrix: Single, values: Single | Array, total: Array) -> None:
    """Add the products of the rows with values over pixels, shape (rows,), as precise as these."""
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
    half = np.zeros_like(inverse)
    invert_factor(factor, half)
    multiply_halves(half, inverse)


@njit(cache=True, error_model="numpy", fastmath=REORDERED)
def multiply_halves(half: Array, inverse: Array) -> None:
    """Inverse of a matrix from that of its Cholesky factor, shape (size, size)."""
    inverse[:] = 0
    for k in range(len(half)):
        other = half[k]
        for i in range(k + 1):
            weight, row = other[i], inverse[i]
            for j in range(k + 1):
                row[j] += weight * other[j]
