"""Light through a layer whose stress varies along the path, down to a mirror and back.

A thin slice whose single pass has the retardance p = (A, B), A between 0 and 90 degrees and B
between 45 and 135, has the Jones matrix exp(i/2 (A s1 + B s2)), s1 = diag(1, -1),
s2 = antidiag(1, 1).  Light that crosses slices and then, after a mirror, the same slices backwards
meets a symmetric and unitary matrix, a linear retarder whatever the slices are (Jones, J. Opt.
Soc. Am. 31, 493, 1941; Aben, Integrated Photoelasticity, McGraw-Hill 1979):

    J = c + i (a s1 + b s2),   a^2 + b^2 + c^2 = 1.

A double pass is thus a point w = (a, b, c) = (v, c) on a sphere, (0, 0, 1) with no stress.  One
more slice on the side of the light, M J M, turns it by |p| from the pole towards (A, B):

    v' = v + (S c - C p.v) p,   c' = c cos|p| - S p.v,
    S = sin|p| / |p|,   C = (1 - cos|p|) / |p|^2.

The loops below do these turns for many pixels, exactly, and their derivative backwards.  What a
slice does to a function whose derivative by the light behind it is e needs no more than the torque
t = w x e, which turns with the light: the turn about u = (-B, A, 0) has the derivative
J^T t = S t + D (u.t) u - C u x t by u, with D = (1 - S) / |p|^2 (the left Jacobian of a rotation,
Sola et al., arXiv:1812.01537).
"""

from __future__ import annotations

from math import factorial

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import InputError
from fringeforce.optics.whole_turns import LARGEST, remainder, remainder_back

Real = NDArray[np.floating]

CHUNK = 128
"""Pixels that are worked on together, so that they stay in the fastest cache, and of which those
that see little retardance take few slices."""
FEW = ((2, 0.2), (8, 0.4), (16, 0.7))
"""Numbers of slices, and the retardance of a single pass up to which as many do [rad]: merging more
changes light by up to 2.5e-4, which is 0.03 of the grey levels of a camera of 8 bits."""
SHORT = 0.2
"""Square of half the retardance of a slice up to which four terms of the series do, with an error
of h^4 / 8! = 4e-8, half of what single precision rounds."""
# Taylor's series of sin(r)/r, cos(r), (1 - sin(r)/r)/h and (1 - cos(r))/h in powers of h = r^2
_SINE = tuple((-1.0) ** k / factorial(2 * k + 1) for k in range(10))
_COSINE = tuple((-1.0) ** k / factorial(2 * k) for k in range(10))
_SINE_LACKS = tuple((-1.0) ** k / factorial(2 * k + 3) for k in range(10))
_COSINE_LACKS = tuple((-1.0) ** k / factorial(2 * k + 2) for k in range(10))
# sums may be reordered, which vector instructions need; what is not finite keeps its meaning
_LOOSE = {"contract", "reassoc", "nsz"}


def double_pass(slices: ArrayLike) -> Real:
    """Where light arrives on the sphere after it has crossed a stack, a mirror, and the stack.

    Parameters
    ----------
    slices : array_like, shape (n_slices, 2, ...)
        Single-pass retardance (A, B) of every slice, the one at the mirror first [rad].

    Returns
    -------
    ndarray, shape (3, ...)
        w = (a, b, c) of the Jones matrix c + i (a s1 + b s2), in the precision of the slices.

    Raises
    ------
    InputError
        If a slice alone retards by more than a wave.
    """
    stack = _floating(slices)
    size = np.sqrt((stack**2).sum(axis=1).max(initial=0))
    if not size <= LARGEST:
        raise InputError(
            f"A single slice retards light by {size:.3g} rad, more than one wave; divide the layer "
            "into more slices, or check the stress."
        )
    flat = stack.reshape(*stack.shape[:2], -1)
    light = np.empty((3, flat.shape[2]), dtype=flat.dtype)
    turn(flat, light)
    return light.reshape(3, *stack.shape[2:])


def double_pass_adjoint(slices: ArrayLike, light: Real, pull: ArrayLike) -> Real:
    """Derivative by every slice of something whose derivative by the light is known.

    Parameters
    ----------
    slices : array_like, shape (n_slices, 2, ...)
        As in `double_pass`.
    light : ndarray, shape (3, ...)
        What `double_pass` made of them.
    pull : array_like, shape (3, ...)
        Derivative by w.

    Returns
    -------
    ndarray, shape (n_slices, 2, ...)
        Derivative by (A, B).
    """
    stack = _floating(slices)
    flat = stack.reshape(*stack.shape[:2], -1)
    result = np.empty_like(flat)
    torque = np.cross(light.reshape(3, -1), np.reshape(pull, (3, -1)), axis=0)
    turn_back(flat, np.ascontiguousarray(torque, dtype=flat.dtype), result)
    return result.reshape(stack.shape)


def jones_matrix(light: ArrayLike) -> NDArray[np.complex128]:
    """The Jones matrix of a point on the sphere, shape (3, ...) to (..., 2, 2)."""
    a, b, c = np.asarray(light, dtype=float)
    rows = [[c + 1j * a, 1j * b], [1j * b, c - 1j * a]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def equivalent_retarder(light: ArrayLike) -> Real:
    """Retardance vector of the one retarder that does what a double pass does, shape (2, ...).

    The length of the vector is the retardance, 0 to 2 pi, its direction twice that of the axis.
    """
    a, b, c = np.asarray(light, dtype=float)
    sine = np.hypot(a, b)
    size = 2 * np.arctan2(sine, c)
    scale = np.divide(size, sine, out=np.full_like(sine, 2.0), where=sine > 0)
    return scale * np.stack([a, b])


def _floating(values: ArrayLike) -> Real:
    array = np.asarray(values)
    if array.dtype == np.float32:
        return np.ascontiguousarray(array, dtype=np.float32)
    return np.ascontiguousarray(array, dtype=np.float64)


@njit(error_model="numpy", fastmath=_LOOSE, inline="always")
def _series(h, T, c):
    """A polynomial of ten terms in the precision T, written out so that loops over it vectorise."""
    low = T(c[0]) + h * (T(c[1]) + h * (T(c[2]) + h * (T(c[3]) + h * T(c[4]))))
    high = T(c[5]) + h * (T(c[6]) + h * (T(c[7]) + h * (T(c[8]) + h * T(c[9]))))
    return low + (h * h) * (h * h) * h * high


@njit(error_model="numpy", fastmath=_LOOSE, inline="always")
def _short(h, T, c):
    """The first four terms."""
    return T(c[0]) + h * (T(c[1]) + h * (T(c[2]) + h * T(c[3])))


@njit(inline="always")
def _copy(line, out) -> None:
    """Copy a line: a slice on the left compiles for long, with the words of an error for shapes."""
    for i in range(len(out)):
        out[i] = line[i]


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def turn(slices, light) -> None:
    """Fill in the light, shape (3, P), of slices, shape (n, 2, P)."""
    if _is_single(light) and not _turned(slices, light, True):
        return
    if _turned(slices, light, False):
        _turned(remainder(slices)[0], light, False)


@njit(inline="always")
def _is_single(values) -> bool:
    """Whether values have single precision."""
    return values.itemsize == 4


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def _turned(slices, light, short) -> bool:
    """Fill in the light; true if that is wrong, for a slice exceeds what the series hold for."""
    T = light.dtype.type
    limit, beyond = T(SHORT if short else LARGEST**2 / 4), T(0)
    for start in range(0, light.shape[1], CHUNK):
        part = slice(start, min(start + CHUNK, light.shape[1]))
        x, y, z = light[0, part], light[1, part], light[2, part]
        x[:], y[:], z[:] = T(0), T(0), T(1)
        for n in range(len(slices)):
            A, B = slices[n, 0, part], slices[n, 1, part]
            for i in range(len(x)):
                # h, and with it s and k, belong to half of the angle
                h = (A[i] * A[i] + B[i] * B[i]) * T(0.25)
                beyond += T(0) if h <= limit else T(1)
                if short:
                    s, k = _short(h, T, _SINE), _short(h, T, _COSINE)
                else:
                    s, k = _series(h, T, _SINE), _series(h, T, _COSINE)
                S, C = s * k, s * s * T(0.5)
                along = A[i] * x[i] + B[i] * y[i]
                push = S * z[i] - C * along
                z[i] = z[i] * (k * k - h * s * s) - S * along
                x[i] += push * A[i]
                y[i] += push * B[i]
    return beyond > 0


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def turn_back(slices, torque, gradient) -> None:
    """Fill in the derivative by slices, shape (n, 2, P), of a function of the light.

    The torque, shape (3, P), is the cross product of the light and the derivative by it, and is
    used up.
    """
    kept = torque.copy()
    if _is_single(torque):
        if not _turned_back(slices, torque, gradient, True):
            return
        for k in range(3):
            _copy(kept[k], torque[k])
    if _turned_back(slices, torque, gradient, False):
        rest, share = remainder(slices)
        _turned_back(rest, kept, gradient, False)
        remainder_back(slices, share, gradient)


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def _turned_back(slices, torque, gradient, short) -> bool:
    """Fill in the derivative, while the torque is turned back slice by slice; true as `_turned`."""
    T = torque.dtype.type
    limit, beyond = T(SHORT if short else LARGEST**2 / 4), T(0)
    for start in range(0, torque.shape[1], CHUNK):
        part = slice(start, min(start + CHUNK, torque.shape[1]))
        x, y, z = torque[0, part], torque[1, part], torque[2, part]
        for n in range(len(slices) - 1, -1, -1):
            A, B = slices[n, 0, part], slices[n, 1, part]
            by_A, by_B = gradient[n, 0, part], gradient[n, 1, part]
            for i in range(len(x)):
                q = A[i] * A[i] + B[i] * B[i]
                h = q * T(0.25)
                beyond += T(0) if h <= limit else T(1)
                if short:
                    lack, rest = _short(h, T, _SINE_LACKS), _short(h, T, _COSINE_LACKS)
                else:
                    lack, rest = _series(h, T, _SINE_LACKS), _series(h, T, _COSINE_LACKS)
                s = T(1) - h * lack
                S, C, D = s * (T(1) - h * rest), s * s * T(0.5), (lack + s * rest) * T(0.25)
                along = A[i] * y[i] - B[i] * x[i]
                by_A[i] = S * y[i] + A[i] * D * along - C * B[i] * z[i]
                by_B[i] = B[i] * D * along - S * x[i] + C * A[i] * z[i]
                lift, cosine = S * z[i], T(1) - C * q
                z[i] = cosine * z[i] + S * (A[i] * x[i] + B[i] * y[i])
                x[i] = cosine * x[i] - A[i] * lift - C * B[i] * along
                y[i] = cosine * y[i] - B[i] * lift + C * A[i] * along
    return beyond > 0


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def turn_modes(modes, profile, light) -> None:
    """Fill in the light, shape (3, P), of slices that are sums of few modes.

    The modes have the shape (2, k, P), (A, B) of each; the profile, shape (n, k), says how much of
    each a slice has.
    """
    whole = np.empty((len(profile), 2, CHUNK), dtype=modes.dtype)
    part = np.empty((3, CHUNK), dtype=modes.dtype)
    merged = _merged(profile)
    for start in range(0, light.shape[1], CHUNK):
        count = min(CHUNK, light.shape[1] - start)
        own = _slices(modes, profile, merged, start, count, whole)
        stack = whole[: len(own)]
        _expand(modes, own, start, count, stack)
        turn(stack, part)
        for k in range(3):
            _copy(part[k, :count], light[k, start : start + count])


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def turn_modes_back(modes, profile, light, pull, gradient) -> None:
    """Fill in the derivative by the modes, shape (2, k, P), as `turn_back` does by slices.

    Light and pull are left as they are.
    """
    whole = np.empty((len(profile), 2, CHUNK), dtype=modes.dtype)
    by_whole = np.empty_like(whole)
    torque = np.zeros((3, CHUNK), dtype=modes.dtype)
    merged = _merged(profile)
    for start in range(0, light.shape[1], CHUNK):
        count = min(CHUNK, light.shape[1] - start)
        own = _slices(modes, profile, merged, start, count, whole)
        stack, by_stack = whole[: len(own)], by_whole[: len(own)]
        _expand(modes, own, start, count, stack)
        part = slice(start, start + count)
        for k in range(3):
            target = torque[k, :count]
            _cross(
                light[k - 2, part], light[k - 1, part], pull[k - 2, part], pull[k - 1, part], target
            )
        turn_back(stack, torque, by_stack)
        for side in range(2):
            for k in range(profile.shape[1]):
                target, n = gradient[side, k, part], 0
                target[:] = 0
                while n + 4 <= len(own):
                    a, b = by_stack[n, side, :count], by_stack[n + 1, side, :count]
                    c, d = by_stack[n + 2, side, :count], by_stack[n + 3, side, :count]
                    _add_four(target, own[n : n + 4, k], a, b, c, d)
                    n += 4
                for one in range(n, len(own)):
                    _add(target, own[one, k], by_stack[one, side, :count])


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def _merged(profile):
    """Profiles of as many slices as `FEW` says, each of whole ones of the profile, one by one."""
    merged = np.zeros((len(FEW), len(profile), profile.shape[1]), dtype=profile.dtype)
    for level in range(len(FEW)):
        each = max(len(profile) // FEW[level][0], 1)
        for n in range(len(profile)):
            whole = merged[level, n // each]
            for k in range(len(whole)):
                whole[k] += profile[n, k]
    return merged


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def _slices(modes, profile, merged, start, count, stack):
    """The profile, or one of the merged ones if it does for some places; the stack is used up."""
    total = len(profile)
    if total % FEW[0][0]:
        return profile
    most = _size(modes, merged[0, : FEW[0][0]], start, count, stack)
    for level in range(len(FEW)):
        few, limit = FEW[level]
        if most < limit and few < total and total % few == 0:
            return merged[level, :few]
    return profile


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def _size(modes, profile, start, count, stack):
    """The largest retardance of a single pass at some places."""
    _expand(modes, profile, start, count, stack[: len(profile)])
    total = np.zeros(CHUNK, dtype=modes.dtype)
    for n in range(len(profile)):
        A, B = stack[n, 0], stack[n, 1]
        for i in range(CHUNK):
            total[i] += np.sqrt(A[i] * A[i] + B[i] * B[i])
    return total.max()


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def _expand(modes, profile, start, count, stack) -> None:
    """Fill in the first slices, shape (n, 2, CHUNK), of some places; the others are at rest."""
    stack[:] = 0
    part = slice(start, start + count)
    for side in range(2):
        k = 0
        while k + 4 <= profile.shape[1]:
            a, b = modes[side, k, part], modes[side, k + 1, part]
            c, d = modes[side, k + 2, part], modes[side, k + 3, part]
            for n in range(len(profile)):
                _add_four(stack[n, side, :count], profile[n, k : k + 4], a, b, c, d)
            k += 4
        for one in range(k, profile.shape[1]):
            source = modes[side, one, part]
            for n in range(len(profile)):
                _add(stack[n, side, :count], profile[n, one], source)


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def _cross(x, y, f, g, target) -> None:
    """Fill in one part of a cross product."""
    for i in range(len(target)):
        target[i] = x[i] * g[i] - y[i] * f[i]


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def _add_four(target, shares, a, b, c, d) -> None:
    """Four rows at a time, which spares most visits to the target."""
    p, q, r, s = shares[0], shares[1], shares[2], shares[3]
    for i in range(len(target)):
        target[i] += (p * a[i] + q * b[i]) + (r * c[i] + s * d[i])


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def _add(target, share, source) -> None:
    """A loop of its own over contiguous rows, which is what vectorises."""
    for i in range(len(target)):
        target[i] += share * source[i]
