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

The loops below do these turns for many pixels, exactly, and their derivative backwards.
"""

from __future__ import annotations

from math import factorial

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from fringeforce.errors import InputError

Real = NDArray[np.floating]

CHUNK = 512
"""Pixels that are worked on together, so that they stay in the fastest cache."""
LARGEST = 2 * np.pi
"""Retardance of one slice up to which the series below hold to 1e-8 [rad]."""
# Taylor's series of sin(r)/r, cos(r) and d/dh sin(r)/r in powers of h = r^2
_SINE = tuple((-1.0) ** k / factorial(2 * k + 1) for k in range(10))
_COSINE = tuple((-1.0) ** k / factorial(2 * k) for k in range(10))
_SLOPE = tuple((k + 1) * (-1.0) ** (k + 1) / factorial(2 * k + 3) for k in range(10))
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
    pulled = np.array(pull, dtype=flat.dtype).reshape(3, -1)
    turn_back(flat, light.reshape(3, -1).copy(), pulled, result)
    return result.reshape(stack.shape)


def jones_matrix(light: ArrayLike) -> NDArray[np.complex128]:
    """The Jones matrix of a point on the sphere, shape (3, ...) to (..., 2, 2)."""
    a, b, c = np.asarray(light, dtype=float)
    rows = [[c + 1j * a, 1j * b], [1j * b, c - 1j * a]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def equivalent_retarder(light: ArrayLike) -> Real:
    """Retardance vector of the one retarder that does what a double pass does, shape (2, ...).

    Its length is the retardance, 0 to 2 pi, its direction twice that of the axis.
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


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def turn(slices, light) -> None:
    """Fill in the light, shape (3, P), of slices, shape (n, 2, P)."""
    T = light.dtype.type
    for start in range(0, light.shape[1], CHUNK):
        part = slice(start, min(start + CHUNK, light.shape[1]))
        x, y, z = light[0, part], light[1, part], light[2, part]
        x[:], y[:], z[:] = T(0), T(0), T(1)
        for n in range(len(slices)):
            A, B = slices[n, 0, part], slices[n, 1, part]
            for i in range(len(x)):
                # h, and with it s and k, belong to half of the angle
                h = (A[i] * A[i] + B[i] * B[i]) * T(0.25)
                s, k = _series(h, T, _SINE), _series(h, T, _COSINE)
                S, C = s * k, s * s * T(0.5)
                along = A[i] * x[i] + B[i] * y[i]
                push = S * z[i] - C * along
                z[i] = z[i] * (k * k - h * s * s) - S * along
                x[i] += push * A[i]
                y[i] += push * B[i]


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def turn_back(slices, light, pull, gradient) -> None:
    """Fill in the derivative by slices, shape (n, 2, P), of a function of the light.

    The light and the function's derivative by it, `pull`, both of shape (3, P), are turned back
    slice by slice, and end where the light began.
    """
    T = light.dtype.type
    for start in range(0, light.shape[1], CHUNK):
        part = slice(start, min(start + CHUNK, light.shape[1]))
        x, y, z = light[0, part], light[1, part], light[2, part]
        f, g, e = pull[0, part], pull[1, part], pull[2, part]
        for n in range(len(slices) - 1, -1, -1):
            A, B = slices[n, 0, part], slices[n, 1, part]
            by_A, by_B = gradient[n, 0, part], gradient[n, 1, part]
            for i in range(len(x)):
                h = (A[i] * A[i] + B[i] * B[i]) * T(0.25)
                s, k, t = _series(h, T, _SINE), _series(h, T, _COSINE), _series(h, T, _SLOPE)
                S, C, cosine = s * k, s * s * T(0.5), k * k - h * s * s
                # derivatives of S and C by |p|^2
                S_q, C_q = (t * k - s * s * T(0.5)) * T(0.25), s * t * T(0.25)
                along, pulled = A[i] * x[i] + B[i] * y[i], A[i] * f[i] + B[i] * g[i]
                push = S * z[i] + C * along
                x[i], y[i] = x[i] - push * A[i], y[i] - push * B[i]
                z[i] = z[i] * cosine + S * along
                along = A[i] * x[i] + B[i] * y[i]
                axis = T(2) * (pulled * (z[i] * S_q - along * C_q) - e[i] * along * S_q)
                axis -= e[i] * z[i] * S
                side, lift = e[i] * S + pulled * C, S * z[i] - C * along
                by_A[i] = axis * A[i] - side * x[i] + lift * f[i]
                by_B[i] = axis * B[i] - side * y[i] + lift * g[i]
                push = S * e[i] + C * pulled
                f[i], g[i] = f[i] - push * A[i], g[i] - push * B[i]
                e[i] = e[i] * cosine + S * pulled


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def turn_modes(modes, profile, light) -> None:
    """Fill in the light, shape (3, P), of slices that are sums of few modes.

    The modes have the shape (2, k, P), (A, B) of each; the profile, shape (n, k), says how much of
    each a slice has.
    """
    stack = np.empty((len(profile), 2, CHUNK), dtype=modes.dtype)
    part = np.empty((3, CHUNK), dtype=modes.dtype)
    for start in range(0, light.shape[1], CHUNK):
        count = min(CHUNK, light.shape[1] - start)
        _expand(modes, profile, start, count, stack)
        turn(stack, part)
        light[:, start : start + count] = part[:, :count]


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def turn_modes_back(modes, profile, light, pull, gradient) -> None:
    """Fill in the derivative by the modes, shape (2, k, P), as `turn_back` does by slices.

    Light and pull are left as they are.
    """
    stack = np.empty((len(profile), 2, CHUNK), dtype=modes.dtype)
    by_stack = np.empty_like(stack)
    seen = np.zeros((3, CHUNK), dtype=modes.dtype)
    pulled = np.zeros_like(seen)
    for start in range(0, light.shape[1], CHUNK):
        count = min(CHUNK, light.shape[1] - start)
        _expand(modes, profile, start, count, stack)
        seen[:, :count] = light[:, start : start + count]
        pulled[:, :count] = pull[:, start : start + count]
        turn_back(stack, seen, pulled, by_stack)
        for side in range(2):
            for k in range(profile.shape[1]):
                target = gradient[side, k, start : start + count]
                target[:] = 0
                for n in range(len(profile)):
                    _add(target, profile[n, k], by_stack[n, side, :count])


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def _expand(modes, profile, start, count, stack) -> None:
    """Fill in the first slices, shape (n, 2, CHUNK), of some places; the others are at rest."""
    stack[:] = 0
    for n in range(len(profile)):
        for side in range(2):
            for k in range(profile.shape[1]):
                source = modes[side, k, start : start + count]
                _add(stack[n, side, :count], profile[n, k], source)


@njit(cache=True, error_model="numpy", fastmath=_LOOSE, nogil=True)
def _add(target, share, source) -> None:
    """A loop of its own over contiguous rows, which is what vectorises."""
    for i in range(len(target)):
        target[i] += share * source[i]
