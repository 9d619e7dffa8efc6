"""Loops over pixels that the compiler turns into vector instructions, in single precision.

Single precision costs 1e-5 rad of phase, where noise costs 1e-2 rad and more.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.polynomial import Chebyshev, Polynomial
from numpy.typing import NDArray

from fringeforce.estimation.layout import BEFORE, BEHIND

Single = NDArray[np.float32]
Array = NDArray[np.float64]

ROWS = 4
"""Rows of a matrix come in multiples of this, so that loops over fours end evenly."""

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


@njit(cache=True, error_model="numpy")
def copy(values: Array | Single, target: Array | Single) -> None:
    """Fill in the beginning of a row; a slice does the same, but takes far longer to compile."""
    for k in range(min(len(values), len(target))):
        target[k] = values[k]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def expose(
    phase: Single,
    amplitude: Single,
    offset: Single,
    steepness: Single,
    level: Single,
    slope: Single,
) -> None:
    """Fill in A sin^2(p/2) + I_o and s sin(p/2) cos(p/2)."""
    for k in range(len(phase)):
        sine, cosine = waves(phase[k])
        level[k] = amplitude[k] * (sine * sine) + offset[k]
        slope[k] = steepness[k] * (sine * cosine)


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def subtract_levels(
    level: Single, grey: Single, inverse: Single, slope: Single, left: Single, pull: Single
) -> None:
    """Fill in what is left of grey levels in units of the noise, and that times the slopes."""
    for k in range(len(left)):
        rest = (level[k] - grey[k]) * inverse[k]
        left[k] = rest
        pull[k] = rest * slope[k]


@njit(cache=True, error_model="numpy", fastmath=REORDERED)
def square_sum(values: Single) -> np.float32:
    """Sum of squares."""
    total = np.float32(0)
    for k in range(len(values)):
        total += values[k] * values[k]
    return total


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
def add_products(matrix: Single, values: Single, total: Array) -> None:
    """Add the products of the rows with values over pixels, shape (rows,)."""
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
def interpolate(nodes: Single, shares: Single, base: Single, values: Single) -> None:
    """Add to a base what lies between nodes; see `Layout.shares`.

    Arrays have the shapes (places,), (every, TAPS) and (size,).
    """
    places = len(nodes)
    last = places - BEFORE - BEHIND
    for k in range(places):
        values[k] = base[k] + nodes[k]
    # slices, whose indices need no look at their signs, let the loop be vectorised
    p, q, r = nodes[:last], nodes[1 : last + 1], nodes[2 : last + 2]
    s, t, u = nodes[3 : last + 3], nodes[4 : last + 4], nodes[5 : last + 5]
    for row in range(1, len(shares)):
        a, b, c = shares[row, 0], shares[row, 1], shares[row, 2]
        d, e, f = shares[row, 3], shares[row, 4], shares[row, 5]
        first = row * places + BEFORE
        origin, target = base[first : first + last], values[first : first + last]
        for k in range(last):
            outer, inner = a * p[k] + f * u[k] + b * q[k], e * t[k] + c * r[k] + d * s[k]
            target[k] = origin[k] + (outer + inner)


@njit(cache=True, error_model="numpy", fastmath=REORDERED)
def gather(values: Single, shares: Single, nodes: Single) -> None:
    """Fill in what the nodes get of values between them: the transpose of `interpolate`."""
    places = len(nodes)
    last = places - BEFORE - BEHIND
    copy(values, nodes)
    target = nodes[BEHIND:-BEFORE]
    for row in range(1, len(shares)):
        a, b, c = shares[row, 0], shares[row, 1], shares[row, 2]
        d, e, f = shares[row, 3], shares[row, 4], shares[row, 5]
        line = values[row * places : (row + 1) * places]
        p, q, r = line[5 : last + 5], line[4 : last + 4], line[3 : last + 3]
        s, t, u = line[2 : last + 2], line[1 : last + 1], line[:last]
        for k in range(last):
            outer, inner = a * p[k] + f * u[k] + b * q[k], e * t[k] + c * r[k] + d * s[k]
            target[k] += outer + inner


@njit(cache=True, error_model="numpy", fastmath=REORDERED)
def add_gram(matrix: Single, weight: Single, first: int, scaled: Single, total: Array) -> None:
    """Add the weighted rows times the rows, over some pixels from the `first` on.

    As many at `scaled`, shape (rows, pixels), has room for; of `total` the lower triangle is valid.
    Sixteen products at a time, so that every number loaded is used four times.
    """
    rows, pixels = scaled.shape
    span = slice(first, first + pixels)
    heavy, zero = weight[span], np.float32(0)
    for j in range(rows):
        row = matrix[j][span]
        for k in range(pixels):
            scaled[j, k] = row[k] * heavy[k]
    for i in range(0, rows, 4):
        a, b, c, d = scaled[i], scaled[i + 1], scaled[i + 2], scaled[i + 3]
        for j in range(0, i + 1, 4):
            p, q = matrix[j][span], matrix[j + 1][span]
            r, t = matrix[j + 2][span], matrix[j + 3][span]
            ap, aq, ar, at = zero, zero, zero, zero
            bp, bq, br, bt = zero, zero, zero, zero
            cp, cq, cr, ct = zero, zero, zero, zero
            dp, dq, dr, dt = zero, zero, zero, zero
            for k in range(pixels):
                ap += a[k] * p[k]
                aq += a[k] * q[k]
                ar += a[k] * r[k]
                at += a[k] * t[k]
                bp += b[k] * p[k]
                bq += b[k] * q[k]
                br += b[k] * r[k]
                bt += b[k] * t[k]
                cp += c[k] * p[k]
                cq += c[k] * q[k]
                cr += c[k] * r[k]
                ct += c[k] * t[k]
                dp += d[k] * p[k]
                dq += d[k] * q[k]
                dr += d[k] * r[k]
                dt += d[k] * t[k]
            total[i, j] += ap
            total[i, j + 1] += aq
            total[i, j + 2] += ar
            total[i, j + 3] += at
            total[i + 1, j] += bp
            total[i + 1, j + 1] += bq
            total[i + 1, j + 2] += br
            total[i + 1, j + 3] += bt
            total[i + 2, j] += cp
            total[i + 2, j + 1] += cq
            total[i + 2, j + 2] += cr
            total[i + 2, j + 3] += ct
            total[i + 3, j] += dp
            total[i + 3, j + 1] += dq
            total[i + 3, j + 2] += dr
            total[i + 3, j + 3] += dt


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
def multiply_factors(left: Array, right: Array) -> None:
    """Multiply two lower triangular matrices, in place in the leading block of the second."""
    for i in range(len(left) - 1, -1, -1):
        row, first = right[i], left[i, i]
        for j in range(i + 1):
            row[j] *= first
        for k in range(i):
            weight, other = left[i, k], right[k]
            for j in range(k + 1):
                row[j] += weight * other[j]


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
def multiply(matrix: Array, values: Array, product: Array) -> None:
    """Fill in a symmetric matrix (size, size) times the first of some values, shape (size,)."""
    product[:] = 0
    for j in range(len(product)):
        row, value = matrix[j], values[j]
        for i in range(len(product)):
            product[i] += row[i] * value


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
