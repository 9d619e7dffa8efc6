"""Compiled sums over the spectra of contacts: harmonics of loads, and derivatives by unknowns.

At the wave vector (alpha, beta) with q = A k = (q cos phi, q sin phi), a polynomial of degree n has
the spectrum i^n around_p(phi) R_n(q) with R_n = j_{n+1}(q) / q, where around_p is 1, cos 2 phi,
sin 2 phi, ... for even degrees, and cos phi, sin phi, cos 3 phi, ... for odd ones.  A degree has
the first of them, which `FIRST_OF` and `COUNT_OF` list.  R_n' = n / q R_n - R_{n+1} (NIST Handbook
of Mathematical Functions, 2010, 10.51).

With roller sides a load is a sum of standing waves, which the spectra at (alpha, beta) and at
(alpha, -beta) make: of the real part for N, of the imaginary part for T_x and T_y, the latter with
the sign of beta.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from scipy.special import spherical_jn

from fringeforce.base.arrays import Single

DEGREES = 11
"""Number of the degrees, 0 to 10."""
ANGULAR_TERMS = 9
"""Functions of the angle that an even degree has at most."""
TABLE_POINTS, UP_TO = 64, 32
"""Values of R_n in a unit of q, between which lines are drawn: they are off by 3e-5 of its second
derivative; and q from which the recurrence is stable and needs no table."""
_LOOSE = {"contract", "reassoc", "nsz", "arcp"}


def radial_table() -> Single:
    """R_n at q = k / TABLE_POINTS, shape (TABLE_POINTS UP_TO + 2, DEGREES + 1)."""
    q = np.arange(TABLE_POINTS * UP_TO + 2) / TABLE_POINTS
    q[0] = 1e-6  # as good as the limit
    rows = [spherical_jn(n + 1, q) / q for n in range(DEGREES + 1)]
    return np.ascontiguousarray(np.stack(rows, axis=1), dtype=np.float32)


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def _row(alpha, beta, matrix, table, q, radial, around) -> None:
    """Fill in q, R_n and the functions of the angle at one alpha and all beta.

    The shapes are (n,), (DEGREES + 1, n) and (2, ANGULAR_TERMS, n): of even degrees, then of odd
    ones.
    """
    one = np.float32(1)
    for j in range(len(beta)):
        a = matrix[0, 0] * alpha + matrix[0, 1] * beta[j]
        b = matrix[1, 0] * alpha + matrix[1, 1] * beta[j]
        size = max(np.sqrt(a * a + b * b), np.float32(1e-4))
        q[j] = size
        around[1, 0, j], around[1, 1, j] = a / size, b / size
        if size < UP_TO:
            place = size * np.float32(TABLE_POINTS)
            low = int(place)
            part = place - np.float32(low)
            for n in range(DEGREES + 1):
                radial[n, j] = table[low, n] + part * (table[low + 1, n] - table[low, n])
        else:
            inverse = 1.0 / size
            last = np.sin(size) * inverse
            this = (last - np.cos(size)) * inverse
            for n in range(DEGREES + 1):
                radial[n, j] = this * inverse
                last, this = this, (2 * n + 3) * inverse * this - last
    c, s = around[1, 0], around[1, 1]
    for j in range(len(beta)):
        around[0, 0, j] = one
        around[0, 1, j] = c[j] * c[j] - s[j] * s[j]
        around[0, 2, j] = c[j] * s[j] + c[j] * s[j]
    for parity, p in ((1, 2), (0, 3), (1, 4), (0, 5), (1, 6), (0, 7)):
        for j in range(len(beta)):
            x, y = around[parity, p - 2, j], around[parity, p - 1, j]
            twice_c, twice_s = around[0, 1, j], around[0, 2, j]
            around[parity, p, j] = x * twice_c - y * twice_s
            around[parity, p + 1, j] = y * twice_c + x * twice_s


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def _turned(one, others, sign, norm, cosine, sine) -> None:
    """Fill in cosine and sine of the phase at a place, times a norm, shape (n,)."""
    for j in range(len(cosine)):
        c, s = others[j].real, sign * others[j].imag
        cosine[j] = norm[j] * (one.real * c - one.imag * s)
        sine[j] = norm[j] * (one.imag * c + one.real * s)


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def _sum_terms(first, mixed, radial, around, base, sums) -> None:
    """Fill in the sums of the terms of N, T_x and T_y, even and odd ones, shape (3, 2, n)."""
    begin, counts = first
    sums[:] = 0
    for degree in range(DEGREES):
        parity = degree % 2
        for p in range(counts[degree]):
            t = begin[degree] + p
            for j in range(len(base)):
                base[j] = radial[degree, j] * around[parity, p, j]
            for c in range(3):
                share = mixed[c, t]
                if share != 0:
                    for j in range(len(base)):
                        sums[c, parity, j] += share * base[j]


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def _add_row(sums, cosine, sine, sign, total, i) -> None:
    """Add the harmonics of sums of terms to row i of a total, shape (3, m, n)."""
    for j in range(len(cosine)):
        total[0, i, j] += cosine[j] * sums[0, 0, j] - sine[j] * sums[0, 1, j]
        total[1, i, j] += sine[j] * sums[1, 0, j] + cosine[j] * sums[1, 1, j]
        total[2, i, j] += sign * (sine[j] * sums[2, 0, j] + cosine[j] * sums[2, 1, j])


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def add_loads(grid, first, shape, mixed, total) -> None:
    """Add harmonics of a contact to a total, shape (3, m, n).

    Parameters
    ----------
    grid : tuple
        alpha (m,), beta (n,), how many beta count at each alpha (m,), the norms (m, n), and the
        table of R_n.
    first : tuple
        Where the terms of a degree begin, and how many there are.
    shape : tuple
        The matrix A, and exp(i alpha x) and exp(i beta y) of the centre, from a corner.
    mixed : ndarray, shape (3, terms)
        Real factors of the terms.
    total : ndarray, shape (3, m, n)
        Harmonics.
    """
    alpha, beta, reach, norm, table = grid
    matrix, at_x, at_y = shape
    n = len(beta)
    q, radial = np.empty(n, np.float32), np.empty((DEGREES + 1, n), np.float32)
    around, sums = np.empty((2, ANGULAR_TERMS, n), np.float32), np.empty((3, 2, n), np.float32)
    rows = np.empty((3, n), np.float32)
    for i in range(len(alpha)):
        n = reach[i]
        cosine, sine, base = rows[0, :n], rows[1, :n], rows[2, :n]
        for side in range(2):
            sign = np.float32(1 - 2 * side)
            _row(alpha[i], sign * beta[:n], matrix, table, q, radial, around)
            _turned(at_x[i], at_y, sign, norm[i], cosine, sine)
            _sum_terms(first, mixed, radial, around, base, sums)
            _add_row(sums, cosine, sine, sign, total, i)


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def fill_moved(grid, first, shape, mixed, whole, unit, along_x, along_y) -> None:
    """Fill in harmonics of a contact, and their derivatives by its centre and its forces.

    Parameters
    ----------
    grid, first, shape, mixed
        As of `add_loads`.
    whole : ndarray, shape (3, m, n)
        Harmonics.
    unit : ndarray, shape (3, m, n)
        Those of the first polynomial alone with the factor 1 in N, T_x and T_y.
    along_x, along_y : ndarray, shape (3, m, n)
        Derivatives by the centre.
    """
    alpha, beta, reach, norm, table = grid
    matrix, at_x, at_y = shape
    n = len(beta)
    q, radial = np.empty(n, np.float32), np.empty((DEGREES + 1, n), np.float32)
    around, sums = np.empty((2, ANGULAR_TERMS, n), np.float32), np.empty((3, 2, n), np.float32)
    rows = np.empty((5, n), np.float32)
    whole[:], unit[:], along_x[:], along_y[:] = 0, 0, 0, 0
    for i in range(len(alpha)):
        n = reach[i]
        cosine, sine, base = rows[0, :n], rows[1, :n], rows[2, :n]
        down, up = rows[3, :n], rows[4, :n]
        for side in range(2):
            sign = np.float32(1 - 2 * side)
            along = sign * beta[:n]
            _row(alpha[i], along, matrix, table, q, radial, around)
            _turned(at_x[i], at_y, sign, norm[i], cosine, sine)
            _sum_terms(first, mixed, radial, around, base, sums)
            _add_row(sums, cosine, sine, sign, whole, i)
            for j in range(n):
                unit[0, i, j] += cosine[j] * radial[0, j]
                unit[1, i, j] += sine[j] * radial[0, j]
                unit[2, i, j] += sign * sine[j] * radial[0, j]
            for j in range(n):
                down[j], up[j] = -alpha[i] * sine[j], alpha[i] * cosine[j]
            _add_row(sums, down, up, sign, along_x, i)
            for j in range(n):
                down[j], up[j] = -along[j] * sine[j], along[j] * cosine[j]
            _add_row(sums, down, up, sign, along_y, i)


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def fill_terms(grid, first, shape, scales, places, found) -> None:
    """Fill in harmonics of single polynomials in N, T_x or T_y.

    Parameters
    ----------
    grid, first, shape
        As of `add_loads`.
    scales : ndarray, shape (terms,)
        Real factors of the terms.
    places : ndarray of int, shape (3, terms)
        Where the harmonics of a term go; -1 for none.
    found : ndarray, shape (count, m, n)
        Harmonics.
    """
    alpha, beta, reach, norm, table = grid
    (begin, counts), (matrix, at_x, at_y) = first, shape
    n = len(beta)
    q, radial = np.empty(n, np.float32), np.empty((DEGREES + 1, n), np.float32)
    around, rows = np.empty((2, ANGULAR_TERMS, n), np.float32), np.empty((3, n), np.float32)
    cosine, sine, base = rows[0], rows[1], rows[2]
    found[:] = 0
    for i in range(len(alpha)):
        for side in range(2):
            sign = np.float32(1 - 2 * side)
            n = reach[i]
            along = sign * beta[:n]
            _row(alpha[i], along, matrix, table, q, radial, around)
            _turned(at_x[i], at_y, sign, norm[i], cosine[:n], sine[:n])
            for degree in range(DEGREES):
                parity = degree % 2
                for p in range(counts[degree]):
                    t = begin[degree] + p
                    for j in range(n):
                        base[j] = scales[t] * radial[degree, j] * around[parity, p, j]
                    # the real part for N, the imaginary one for T_x and T_y
                    first_sign = np.float32(-1) if parity else np.float32(1)
                    real, imaginary = (sine, cosine) if parity else (cosine, sine)
                    normal, x, y = places[0, t], places[1, t], places[2, t]
                    if normal >= 0:
                        for j in range(n):
                            found[normal, i, j] += first_sign * real[j] * base[j]
                    if x >= 0:
                        for j in range(n):
                            found[x, i, j] += imaginary[j] * base[j]
                    if y >= 0:
                        for j in range(n):
                            found[y, i, j] += sign * imaginary[j] * base[j]


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def pull(grid, first, shape, mixed, by_loads, by_mixed, by_place, by_matrix) -> None:
    """Fill in the derivative by a contact of something whose derivative by its loads is known.

    Parameters
    ----------
    grid, first, shape, mixed
        As of `add_loads`.
    by_loads : ndarray, shape (3, m, n)
        The known derivative.
    by_mixed : ndarray, shape (3, terms)
        By the real factors.
    by_place : ndarray, shape (2,)
        By the centre.
    by_matrix : ndarray, shape (2, 2)
        By the matrix A, as if its entries were four unknowns.
    """
    alpha, beta, reach, norm, table = grid
    (begin, counts), (matrix, at_x, at_y) = first, shape
    n = len(beta)
    q, radial = np.empty(n, np.float32), np.empty((DEGREES + 1, n), np.float32)
    around, weights = np.empty((2, ANGULAR_TERMS, n), np.float32), np.empty((3, 2, n), np.float32)
    rows = np.empty((3, n), np.float32)
    cosine, sine, base = rows[0], rows[1], rows[2]
    more = np.empty((4, n), np.float32)
    outward, turning, phase, slope = more[0], more[1], more[2], more[3]
    by_mixed[:], by_place[:], by_matrix[:] = 0, 0, 0
    for i in range(len(alpha)):
        for side in range(2):
            sign = np.float32(1 - 2 * side)
            n = reach[i]
            along = sign * beta[:n]
            _row(alpha[i], along, matrix, table, q, radial, around)
            _turned(at_x[i], at_y, sign, norm[i], cosine[:n], sine[:n])
            for j in range(n):
                normal, x = by_loads[0, i, j], by_loads[1, i, j]
                y = sign * by_loads[2, i, j]
                weights[0, 0, j], weights[0, 1, j] = normal * cosine[j], -normal * sine[j]
                weights[1, 0, j], weights[1, 1, j] = x * sine[j], x * cosine[j]
                weights[2, 0, j], weights[2, 1, j] = y * sine[j], y * cosine[j]
            outward[:], turning[:], phase[:] = 0, 0, 0
            for degree in range(DEGREES):
                parity = degree % 2
                other = np.float32(2 * parity - 1)
                for j in range(n):
                    slope[j] = degree / q[j] * radial[degree, j] - radial[degree + 1, j]
                for p in range(counts[degree]):
                    t = begin[degree] + p
                    for j in range(n):
                        base[j] = radial[degree, j] * around[parity, p, j]
                    for c in range(3):
                        told = np.float32(0)
                        for j in range(n):
                            told += weights[c, parity, j] * base[j]
                        by_mixed[c, t] += told
                    N, X, Y = mixed[0, t], mixed[1, t], mixed[2, t]
                    if N == 0 and X == 0 and Y == 0:
                        continue
                    # the derivative of cos m phi is -m sin m phi, that of sin m phi m cos m phi
                    if parity:
                        waves, turn = 2 * (p // 2) + 1, p + 1 - 2 * (p % 2)
                        factor = np.float32(waves if p % 2 else -waves)
                    else:
                        waves = 2 * ((p + 1) // 2)
                        turn = 0 if p == 0 else p - 1 + 2 * (p % 2)
                        factor = np.float32(-waves if p % 2 else waves)
                    for j in range(n):
                        mine = N * weights[0, parity, j]
                        mine += X * weights[1, parity, j] + Y * weights[2, parity, j]
                        theirs = N * weights[0, 1 - parity, j]
                        theirs += X * weights[1, 1 - parity, j] + Y * weights[2, 1 - parity, j]
                        outward[j] += mine * slope[j] * around[parity, p, j]
                        turning[j] += mine * factor * radial[degree, j] * around[parity, turn, j]
                        phase[j] -= other * theirs * base[j]
            for j in range(n):
                by_place[0] += alpha[i] * phase[j]
                by_place[1] += along[j] * phase[j]
                c, s, swing = around[1, 0, j], around[1, 1, j], turning[j] / q[j]
                a, b = c * outward[j] - s * swing, s * outward[j] + c * swing
                by_matrix[0, 0] += a * alpha[i]
                by_matrix[0, 1] += a * along[j]
                by_matrix[1, 0] += b * alpha[i]
                by_matrix[1, 1] += b * along[j]
