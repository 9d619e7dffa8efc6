"""From harmonics of tractions on a pad with roller sides to retardance at pixels, and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numba import njit

from fringeforce.base.arrays import Array, Index, Single
from fringeforce.models import splines


@dataclass(frozen=True, eq=False)
class Waves:
    """Standing waves along one axis at places: cosines, or sines.

    Where places are their own mirror image, as those of pixels are, half of them are computed: the
    waves are then sorted, those with an even number first, of which the others hold no more than
    a sign.

    Attributes
    ----------
    table : ndarray, shape (places, m), or (places / 2, m)
        Values.
    even : int
        Waves with an even number, if half of the places are computed; none if not.
    sign : int
        Of an even wave in the mirror: 1 for cosines, -1 for sines.
    """

    table: Single
    even: int
    sign: int

    @property
    def count(self) -> int:
        """Number of places."""
        return len(self.table) * (2 if self.even else 1)

    @property
    def whole(self) -> Single:
        """Values at all places, shape (places, m)."""
        if not self.even:
            return self.table
        mirrored = np.float32(-self.sign) * self.table[::-1]
        mirrored[:, : self.even] *= -1
        return np.concatenate([self.table, mirrored])

    def splines(self, places: Array) -> Waves:
        """Those of the coefficients of splines through the values at places, shape (places,)."""
        values = splines.coefficients(places)[: len(self.table)] @ self.whole
        return replace(self, table=values.astype(np.float32))

    def forward(self, values: Single, out: Single | None = None) -> Single:
        """Sum of waves, shape (..., places), from amplitudes, shape (..., m)."""
        if not self.even:
            return np.matmul(values, self.table.T, out=out)
        one = values[..., : self.even] @ self.table[:, : self.even].T
        two = values[..., self.even :] @ self.table[:, self.even :].T
        half = len(self.table)
        found = np.empty((*one.shape[:-1], 2 * half), dtype=np.float32) if out is None else out
        np.add(one, two, out=found[..., :half])
        parts = (one, two) if self.sign > 0 else (two, one)
        np.subtract(*parts, out=found[..., : half - 1 : -1])
        return found

    def adjoint(self, values: Single) -> Single:
        """From derivatives at places, shape (..., places, q), to those by amplitudes, (..., q, m).

        Places do not come last, so that halves are added up along rows of numbers.
        """
        turned = values.swapaxes(-1, -2)
        if not self.even:
            return turned @ self.table
        half = len(self.table)
        near, far = values[..., :half, :], values[..., : half - 1 : -1, :]
        both = (near + far).swapaxes(-1, -2), (near - far).swapaxes(-1, -2)
        found = np.empty((*turned.shape[:-1], self.table.shape[1]), dtype=np.float32)
        first, second = both if self.sign > 0 else both[::-1]
        np.matmul(first, self.table[:, : self.even], out=found[..., : self.even])
        np.matmul(second, self.table[:, self.even :], out=found[..., self.even :])
        return found


def waves_at(places: Array, side: float, count: int) -> tuple[Index, tuple[Waves, Waves]]:
    """Cosines and sines of waves between sides, and the order that they want.

    Parameters
    ----------
    places : ndarray, shape (p,)
        From the middle [m].
    side : float
        Distance of the sides [m].
    count : int
        Waves: wave k has k half periods between the sides.
    """
    numbers = np.arange(count)
    inside = np.clip(places, -side / 2, side / 2)
    mirrored = len(places) % 2 == 0 and np.allclose(inside, -inside[::-1], rtol=0, atol=1e-9 * side)
    even = 0
    if mirrored:
        numbers = np.concatenate([numbers[::2], numbers[1::2]])
        even, inside = len(numbers[::2]), inside[: len(places) // 2]
    angles = np.outer(inside + side / 2, numbers * np.pi / side)
    cosines, sines = (part(angles).astype(np.float32) for part in (np.cos, np.sin))
    return numbers, (Waves(cosines, even, 1), Waves(sines, even, -1))


class Harmonics(NamedTuple):
    """Amplitudes of standing waves of loads.

    Attributes
    ----------
    component : int or None
        Of N, T_x and T_y; none if all three are given.
    values : ndarray, shape (m, n), or (3, m, n)
        Amplitudes.
    """

    component: int | None
    values: Single


@dataclass(frozen=True, eq=False)
class Synthesis:
    """From harmonics to retardance on a grid of places.

    Attributes
    ----------
    waves : ndarray, shape (2, modes, 3, m, n)
        Retardance (A, B) of every depth profile per harmonic of N, T_x and T_y, in their order.
    along, across : tuple of Waves
        Cosines and sines along x, and along y.
    orders : (ndarray, ndarray)
        Numbers of the harmonics along x and along y in their order.
    """

    waves: Single
    along: tuple[Waves, Waves]
    across: tuple[Waves, Waves]
    orders: tuple[Index, Index]

    @classmethod
    def of(cls, waves: Single, sides: tuple[float, float], x: Array, y: Array) -> Synthesis:
        """At columns and rows [m] of a pad with these sides [m], from harmonics as they come."""
        m, n = waves.shape[-2:]
        (first, along), (second, across) = waves_at(x, sides[0], m), waves_at(y, sides[1], n)
        found = cls(waves, along, across, (first, second))
        return replace(found, waves=found.ordered(waves))

    def splines(self, x: Array, y: Array) -> Synthesis:
        """The same to coefficients of the splines through its places, columns x and rows y [m]."""
        along, across = (
            (one.splines(places), other.splines(places))
            for (one, other), places in ((self.along, x), (self.across, y))
        )
        return replace(self, along=along, across=across)

    def ordered(self, values: Single) -> Single:
        """Values of harmonics as they come, shape (..., m, n), in the order of the waves."""
        if self.along[0].even or self.across[0].even:
            values = values[..., self.orders[0][:, None], self.orders[1]]
        return np.ascontiguousarray(values)

    def modes(self, loads: Single) -> Single:
        """Retardance of every depth profile, shape (2, modes, rows, columns) [rad]."""
        return self._spread(self._mixed(self.waves, loads))

    def mixed(self, waves: Single, loads: Single) -> Single:
        """Sums (2, modes, m, n) over the components of other waves, as they come, and loads."""
        return self._mixed(self.ordered(waves), loads)

    def _mixed(self, waves: Single, loads: Single) -> Single:
        sums = np.zeros((*waves.shape[:2], *waves.shape[3:]), dtype=np.float32)
        _mix(waves, *self.orders, loads, sums)
        return sums

    def columns(self, harmonics: Sequence[Harmonics], slopes: Single) -> Array:
        """What harmonics change of something whose derivatives by the modes are known.

        Parameters
        ----------
        harmonics : sequence of Harmonics, length k
            Of loads.
        slopes : ndarray, shape (s, 2 modes, rows * columns)
            Derivatives of s quantities at every place by the modes of A and then of B.

        Returns
        -------
        ndarray, shape (k, s * rows * columns)
        """
        (_, modes, _, m, n), pixels = self.waves.shape, slopes.shape[-1]
        # one after the other, for all together would leave the processor's cache
        sums = np.empty((2, modes, m, n), dtype=np.float32)
        found = np.empty((len(harmonics), len(slopes), pixels))
        for (component, own), row in zip(harmonics, found, strict=True):
            if component is None:
                mixed = self._mixed(self.waves, own)
            else:
                mixed = np.multiply(self.waves[:, :, component], self.ordered(own), out=sums)
            np.einsum("sfp,fp->sp", slopes, self._spread(mixed).reshape(-1, pixels), out=row)
        return found.reshape(len(harmonics), slopes.shape[0] * pixels)

    def _spread(self, sums: Single) -> Single:
        rows, columns = (axis[0].count for axis in (self.across, self.along))
        found = np.empty((*sums.shape[:2], rows, columns), dtype=np.float32)
        for field in range(2):
            lines = self.across[field].forward(sums[field].reshape(-1, sums.shape[-1]))
            turned = lines.reshape(*sums.shape[1:3], -1).swapaxes(1, 2)
            self.along[field].forward(turned, found[field])
        return found

    def adjoint(self, by_modes: Single) -> Single:
        """From derivatives by the modes, shape (2, modes, rows, columns), to those by loads."""
        return self.back(self.gather(by_modes))

    def back(self, sums: Single) -> Single:
        """The same from derivatives by sums of harmonics."""
        found = np.zeros(self.waves.shape[2:], dtype=np.float32)
        _unmix(self.waves, *self.orders, sums, found)
        return found

    def gather(self, by_modes: Single) -> Single:
        """The same to those by sums of harmonics, shape (2, modes, m, n)."""
        _, modes, _, m, n = self.waves.shape
        sums = np.empty((2, modes, m, n), dtype=np.float32)
        for field, values in enumerate(by_modes):
            lines = self.across[field].adjoint(values)
            sums[field] = self.along[field].adjoint(lines).swapaxes(1, 2)
        return sums


@njit(cache=True, error_model="numpy", fastmath=True, nogil=True)
def _mix(waves, first, second, loads, sums) -> None:
    """Add up sums of modes, shape (2, modes, m, n), of loads, shape (3, m, n)."""
    own = np.empty(len(second), np.float32)
    for c in range(waves.shape[2]):
        for i in range(len(first)):
            for j in range(len(second)):
                own[j] = loads[c, first[i], second[j]]
            for field in range(waves.shape[0]):
                for k in range(waves.shape[1]):
                    wave, total = waves[field, k, c, i], sums[field, k, i]
                    for j in range(len(second)):
                        total[j] += wave[j] * own[j]


@njit(cache=True, error_model="numpy", fastmath=True, nogil=True)
def _unmix(waves, first, second, sums, loads) -> None:
    """Add up loads from sums: the transpose of `_mix`."""
    own = np.empty(len(second), np.float32)
    for c in range(waves.shape[2]):
        for i in range(len(first)):
            own[:] = 0
            for field in range(waves.shape[0]):
                for k in range(waves.shape[1]):
                    wave, part = waves[field, k, c, i], sums[field, k, i]
                    for j in range(len(second)):
                        own[j] += wave[j] * part[j]
            for j in range(len(second)):
                loads[c, first[i], second[j]] = own[j]
