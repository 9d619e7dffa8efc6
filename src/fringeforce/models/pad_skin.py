"""Contacts anywhere on a pad: what each does to the retardance, by its spectrum.

A contact is an ellipse x = centre + A t, |t| < 1, with the symmetric matrix

    A = size * exp [[s, u], [u, -s]].

On it its tractions are, with w = 3 / (2 pi det A) sqrt(1 - |t|^2), which is Hertz's pressure
(K. L. Johnson, Contact Mechanics, 1985, section 4.2),

    p = N w (1 + sum_j c_j Z_j(t)),    tau = w (T + N sum_j d_j Z_j(t)),

with the polynomials Z_j that are orthonormal under the weight of Hertz's pressure.  Those of the
first and the second degree are left out of the pressure, for place, size and axes are as good, so
that the centre of pressure is the centre of the ellipse and its second moments are A A / 5.  What
friction, thin layers and edges add is in the others.

The spectrum of w Z is closed, i^n cos(m phi) j_{n+1}(q) / q with q = A k and spherical Bessel
functions j (Noll, J. Opt. Soc. Am. 66, 207, 1976, for Zernike's polynomials; here with the weight),
so that the exact series of roller sides carries any contact to all pixels.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import gamma, pi, sqrt
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.special import eval_jacobi, roots_jacobi

from fringeforce.base.arrays import Array, Mask, Single
from fringeforce.design.pad import Pad
from fringeforce.mechanics.solid.fourier import retardance_waves
from fringeforce.models.pad_slices import block_of
from fringeforce.optics.photoelasticity import stress_optic_constant

DEGREE, RADIAL = 6, 8
"""Degrees up to which there are all polynomials, and those that are the same in all directions."""
PRESSURE_STDS = {3: 0.15, 4: 0.3, 5: 0.1, 6: 0.2, 8: 0.15}
"""Standard deviations of the shapes of a pressure by their degree.  Spheres of 2 to 10 mm on a thin
cover have up to 0.2 at degree 4; flat punches and long edges have 0.3 to 0.5."""
SHEAR_STDS = {1: 0.1, 2: 0.2, 3: 0.05, 4: 0.15, 6: 0.1}
"""The same of shears, over the normal force.  Under partial slip with a friction of 0.6 a sphere
has 0.1 to 0.2 at degree 2."""
SHEAR_DEGREE = 4
"""Degree up to which shears have all polynomials."""
SIZE = 2.0, 1.0
"""Typical size over the thickness of the cover, and standard deviation of its logarithm."""
LONG = 0.7
"""Standard deviation of s and u: ellipses are up to 16 times as long as wide at two of them."""
FORCE = 20.0
"""Standard deviation of the force of a contact [N]."""
DIGITS = 4.0
"""The series ends where the cover has damped its harmonics by ten to this power."""
SLICES, KEPT = 32, 1e-4
"""Depths of the layer, of which twice as many change a frame of 8 bits by less than a tenth of a
grey level, and the share of the stresses that depth profiles may leave out."""
STEP = 1e-3
"""Change of the logarithm of sizes by which spectra are differentiated."""
N, PLACE, SHAPE = 0, 3, 5
FIRST = 8
"""Where force, place, logarithm of the size with s and u, and shapes begin among the unknowns."""
ORDER = 28
"""Order from which Bessel functions are computed downwards, where their argument is smaller."""


class Term(NamedTuple):
    """A polynomial: degree, waves around the circle, and whether it is their cosine."""

    degree: int
    waves: int
    even: bool

    @property
    def scale(self) -> float:
        """What makes its spectrum i^degree cos(waves phi) j_{degree + 1}(q) / q times it."""
        k = (self.degree - self.waves) // 2
        # Jacobi's polynomials in 2 r^2 - 1, and the mean of their square under the weight
        x, weights = roots_jacobi(2 * RADIAL, 0.5, float(self.waves))
        square = eval_jacobi(k, 0.5, float(self.waves), x) ** 2
        mean = float(weights @ square) * 0.75 / 2 ** (self.waves + 0.5)
        mean *= 1.0 if self.waves == 0 else 0.5
        return 6 / sqrt(pi) * gamma(k + 1.5) / gamma(k + 1) / sqrt(mean)

    def value(self, r: Array, turn: Array) -> Array:
        """Of the polynomial on the unit disc."""
        k = (self.degree - self.waves) // 2
        norm = self.scale * sqrt(pi) * gamma(k + 1) / (6 * gamma(k + 1.5))
        around = np.cos(self.waves * turn) if self.even else np.sin(self.waves * turn)
        jacobi = eval_jacobi(k, 0.5, float(self.waves), 2 * r**2 - 1)
        return np.asarray(norm * r**self.waves * jacobi * around)


TERMS = tuple(
    Term(degree, waves, even)
    for degree in range(RADIAL + 1)
    for waves in range(degree % 2, degree + 1, 2)
    for even in ((True, False) if waves else (True,))
    if degree <= DEGREE or waves == 0
)
"""All polynomials; the first is constant."""
PRESSURES = tuple(i for i, term in enumerate(TERMS) if term.degree > 2)
SHEARS = tuple(
    i
    for i, term in enumerate(TERMS)
    if 0 < term.degree <= SHEAR_DEGREE or (term.degree == DEGREE and term.waves == 0)
)
"""Polynomials of pressure and of either component of shear."""
SIZE_OF = FIRST + len(PRESSURES) + 2 * len(SHEARS)
"""Unknowns of a contact."""


def matrix_of(shape: Array) -> Array:
    """A of (logarithm of size, s, u), shape (2, 2) [m]."""
    size, s, u = shape
    length = np.hypot(s, u)
    sinh = np.sinh(length) / length if length > 0 else 1.0
    cosh = np.cosh(length)
    return np.exp(size) * np.array([[cosh + sinh * s, sinh * u], [sinh * u, cosh - sinh * s]])


@dataclass(frozen=True, eq=False)
class PadSkinModel:
    """What contacts anywhere on a pad do.

    Attributes
    ----------
    pad : Pad
        With roller sides.
    """

    pad: Pad

    @cached_property
    def _waves(self) -> tuple[Array, Array, Single, Single]:
        """Wave numbers, waves (2, modes, 3, m, n) of (A, B) per harmonic, and profiles."""
        block = block_of(self.pad)
        alpha, beta, found = retardance_waves(block, SLICES, DIGITS)
        layer, light = self.pad.transducer.photoelastic, self.pad.polariscope
        constant = stress_optic_constant(layer, light.wavelength)
        weights = block.depths(SLICES)[1]
        stack = constant * weights[:, None, None, None, None] * found  # (S, 2, 3, m, n)
        # damped twice, for loads have weaker short waves than a point has
        kappa = np.hypot(alpha[:, None], beta)
        flat = (stack * np.exp(-kappa * block.compliant.thickness / 4)).reshape(SLICES, -1)
        vectors, sizes, _ = np.linalg.svd(flat @ flat.T)
        lost = np.sqrt(np.append(sizes[::-1].cumsum()[::-1], 0) / sizes.sum())
        profile = vectors[:, : int(np.argmax(lost <= KEPT))]
        waves = np.einsum("sk,sfcmn->fkcmn", profile, stack, optimize=True)
        return alpha, beta, waves.astype(np.float32), profile.astype(np.float32)

    @property
    def profile(self) -> Single:
        """What each mode adds to each slice, shape (slices, modes)."""
        return self._waves[3]

    def synthesis(self, x: Array, y: Array) -> Synthesis:
        """From harmonics of tractions to retardance at columns and rows [m]."""
        alpha, beta, waves, _ = self._waves
        t = self.pad.transducer
        at_x = np.outer(np.clip(x, -t.length / 2, t.length / 2) + t.length / 2, alpha)
        at_y = np.outer(np.clip(y, -t.width / 2, t.width / 2) + t.width / 2, beta)
        single = [part(at).astype(np.float32) for at in (at_x, at_y) for part in (np.cos, np.sin)]
        return Synthesis(waves, (single[0], single[1]), (single[2], single[3]))

    @cached_property
    def _norm(self) -> Single:
        alpha, beta, *_ = self._waves
        t = self.pad.transducer
        parts = [
            np.where(k > 0, 2.0, 1.0) / side for k, side in ((alpha, t.length), (beta, t.width))
        ]
        return np.asarray(np.outer(*parts) / 2, dtype=np.float32)

    def _spectra(self, contact: Array, terms: list[int]) -> NDArray[np.complex64]:
        """Spectra of polynomials of a contact, shape (terms, 2, m, n): at (alpha, +-beta)."""
        alpha, beta, *_ = self._waves
        matrix = matrix_of(contact[SHAPE:FIRST])
        found = np.empty((len(terms), 2, len(alpha), len(beta)), dtype=np.float32)
        _bessel(alpha, beta, matrix, _NUMBERS[terms], _SCALES[terms], found)
        corner = np.array([self.pad.transducer.length, self.pad.transducer.width]) / 2
        x, y = contact[PLACE:SHAPE] + corner
        across = np.exp(1j * beta * y).astype(np.complex64)
        turned = np.stack([across, across.conj()])[:, None] * np.exp(1j * alpha * x)[:, None]
        return found * (turned.astype(np.complex64) * _POWERS[terms, None, None, None])

    def _harmonics(self, spectra: NDArray[np.complex64], component: int) -> Single:
        """Real harmonics of spectra, shape (..., 2, m, n), as loads of a component."""
        plus, minus = spectra[..., 0, :, :], spectra[..., 1, :, :]
        if component == 0:
            found = (plus + minus).real
        else:
            found = (plus + minus).imag if component == 1 else (plus - minus).imag
        return np.asarray(found * self._norm, dtype=np.float32)

    def _mixed(self, contact: Array) -> Array:
        """Coefficients of all polynomials in N, T_x and T_y, shape (3, terms) [N]."""
        mixed = np.zeros((3, len(TERMS)))
        mixed[:, 0] = contact[:PLACE]
        first = FIRST + len(PRESSURES)
        mixed[0, list(PRESSURES)] = contact[0] * contact[FIRST:first]
        mixed[1:, list(SHEARS)] = contact[0] * contact[first:].reshape(2, -1)
        return mixed

    def _sums(self, contact: Array, mixed: Array) -> NDArray[np.complex64]:
        """Spectra of the tractions of a contact, shape (3, 2, m, n)."""
        terms = [0, *(np.flatnonzero(mixed[:, 1:].any(axis=0)) + 1)]
        found = np.tensordot(mixed[:, terms], self._spectra(contact, terms), 1)
        return found.astype(np.complex64)

    def loads(self, contacts: Array) -> Single:
        """Harmonics of the tractions of contacts, shape (3, m, n).

        Parameters
        ----------
        contacts : ndarray, shape (k, SIZE_OF)
            Unknowns of each.
        """
        alpha, beta, *_ = self._waves
        total = np.zeros((3, len(alpha), len(beta)), dtype=np.float32)
        for contact in contacts:
            sums = self._sums(contact, self._mixed(contact))
            for c in range(3):
                total[c] += self._harmonics(sums[c], c)
        return total

    def derivatives(self, contact: Array, free: Mask) -> list[tuple[int, Single]]:
        """Derivatives of `loads` by unknowns of a contact: component and harmonics of each.

        Component 3 stands for all three, of the shape (3, m, n).

        Parameters
        ----------
        contact : ndarray, shape (SIZE_OF,)
            The unknowns.
        free : ndarray of bool, shape (SIZE_OF,)
            Those that are asked for.
        """
        alpha, beta, *_ = self._waves
        mixed = self._mixed(contact)
        terms = list(range(len(TERMS))) if free[FIRST:].any() else [0]
        spectra, whole = self._spectra(contact, terms), self._sums(contact, mixed)
        by_normal = mixed / max(contact[0], 1e-9)
        by_normal[1:, 0] = 0.0
        parts = self._sums(contact, by_normal)

        def all_three(changes: NDArray[np.complex64]) -> Single:
            three = [self._harmonics(changes[c], c) for c in range(3)]
            return np.stack(three).astype(np.float32)

        def one(term: int, component: int) -> Single:
            return self._harmonics(spectra[term], component).astype(np.float32)

        def reshaped(k: int) -> Single:
            ahead = contact.copy()
            ahead[k] += STEP
            return all_three((self._sums(ahead, mixed) - whole) / STEP)

        signed, normal = np.stack([beta, -beta])[:, None, :], np.float32(contact[0])
        moved = [(1j * part).astype(np.complex64) for part in (alpha[:, None], signed)]
        first = FIRST + len(PRESSURES)
        found = list[tuple[int, Single]]()
        for k in np.flatnonzero(free):
            if k == 0:
                found.append((3, all_three(parts)))
            elif k < PLACE:
                found.append((int(k), one(0, int(k))))
            elif k < SHAPE:
                found.append((3, all_three(moved[k - PLACE] * whole)))
            elif k < FIRST:
                found.append((3, reshaped(int(k))))
            elif k < first:
                found.append((0, normal * one(PRESSURES[k - FIRST], 0)))
            else:
                part, term = divmod(int(k) - first, len(SHEARS))
                found.append((1 + part, normal * one(SHEARS[term], 1 + part)))
        return found

    def drawn(self, count: int) -> tuple[Array, Array]:
        """Mean and standard deviation of the unknowns of contacts before a frame, (k, SIZE_OF)."""
        assert self.pad.skin is not None
        cover, friction = self.pad.transducer.compliant.thickness, self.pad.skin.friction
        mean, std = np.zeros(SIZE_OF), np.zeros(SIZE_OF)
        std[:PLACE] = FORCE, friction * FORCE, friction * FORCE
        std[PLACE:SHAPE] = np.array(self.pad.skin.extent) / 2
        mean[SHAPE], std[SHAPE:FIRST] = np.log(SIZE[0] * cover), (SIZE[1], LONG, LONG)
        std[FIRST : FIRST + len(PRESSURES)] = [PRESSURE_STDS[TERMS[i].degree] for i in PRESSURES]
        std[FIRST + len(PRESSURES) :] = [SHEAR_STDS[TERMS[i].degree] for i in SHEARS] * 2
        return np.tile(mean, (count, 1)), np.tile(std, (count, 1))


@dataclass(frozen=True, eq=False)
class Synthesis:
    """From harmonics to retardance on a grid of places.

    Attributes
    ----------
    waves : ndarray, shape (2, modes, 3, m, n)
        Retardance (A, B) of every depth profile per harmonic of N, T_x and T_y.
    along, across : tuple of ndarray, shape (columns, m) and (rows, n)
        Cosines and sines along x, and along y.
    """

    waves: Single
    along: tuple[Single, Single]
    across: tuple[Single, Single]

    def modes(self, loads: Single) -> Single:
        """Retardance of every depth profile, shape (2, modes, rows, columns) [rad]."""
        return self._spread(np.einsum("fkcmn,cmn->fkmn", self.waves, loads))

    def column(self, component: int, harmonics: Single) -> Single:
        """The same of harmonics of one component, shape (m, n), or, as component 3, of all."""
        if component == 3:
            return self.modes(harmonics)
        return self._spread(self.waves[:, :, component] * harmonics)

    def _spread(self, sums: Single) -> Single:
        return np.stack([self._field(sums[field], field) for field in range(2)])

    def _field(self, sums: Single, field: int) -> Single:
        """One part from its harmonics, shape (modes, m, n)."""
        modes, m, n = sums.shape
        first = sums.reshape(modes * m, n) @ self.across[field].T
        lines = first.reshape(modes, m, -1).transpose(0, 2, 1)
        return np.asarray(lines @ self.along[field].T, dtype=np.float32)

    def adjoint(self, by_modes: Single) -> Single:
        """From derivatives by the modes, shape (2, modes, rows, columns), to those by loads."""
        sums = []
        for field in range(2):
            values = by_modes[field]
            modes, rows, columns = values.shape
            first = values.reshape(modes * rows, columns) @ self.along[field]
            lines = first.reshape(modes, rows, -1).transpose(0, 2, 1)
            sums.append(lines @ self.across[field])
        return np.einsum("fkcmn,fkmn->cmn", self.waves, np.stack(sums))


_NUMBERS = np.array([(term.degree, term.waves, term.even) for term in TERMS], dtype=np.int64)
_SCALES = np.array([term.scale for term in TERMS])
_POWERS = np.array([1j ** (term.degree % 4) for term in TERMS], dtype=np.complex64)


@njit(cache=True, error_model="numpy", nogil=True)
def _bessel(alpha, beta, matrix, numbers, scales, found) -> None:
    """Fill in cos(m phi) j_{n+1}(q) / q of every term, shape (terms, 2, m, n)."""
    highest = numbers[:, 0].max() + 1
    values = np.zeros(ORDER + 2)
    cosines, sines = np.zeros(highest + 1), np.zeros(highest + 1)
    for i in range(len(alpha)):
        for side in range(2):
            for j in range(len(beta)):
                k = beta[j] if side == 0 else -beta[j]
                a = matrix[0, 0] * alpha[i] + matrix[0, 1] * k
                b = matrix[1, 0] * alpha[i] + matrix[1, 1] * k
                q = max(np.sqrt(a * a + b * b), 1e-4)
                if q > highest + 1:
                    values[0] = np.sin(q) / q
                    values[1] = (values[0] - np.cos(q)) / q
                    for n in range(1, highest):
                        values[n + 1] = (2 * n + 1) / q * values[n] - values[n - 1]
                else:
                    values[ORDER + 1], values[ORDER] = 0.0, 1e-280
                    last, this = 0.0, 1e-280
                    for n in range(ORDER, 0, -1):
                        last, this = this, (2 * n + 1) / q * this - last
                        values[n - 1] = this
                        if abs(this) > 1e200:
                            for later in range(n - 1, ORDER + 1):
                                values[later] *= 1e-200
                            last *= 1e-200
                            this *= 1e-200
                    share = np.sin(q) / q / values[0]
                    for n in range(highest + 1):
                        values[n] *= share
                cosine, sine = (a / q, b / q) if q > 1e-4 else (1.0, 0.0)
                cosines[0], sines[0] = 1.0, 0.0
                for n in range(highest):
                    cosines[n + 1] = cosines[n] * cosine - sines[n] * sine
                    sines[n + 1] = sines[n] * cosine + cosines[n] * sine
                for term in range(len(numbers)):
                    degree, waves, even = numbers[term]
                    around = cosines[waves] if even else sines[waves]
                    found[term, side, i, j] = scales[term] * around * values[degree + 1] / q
