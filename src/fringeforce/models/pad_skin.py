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
from typing import Any, NamedTuple

import numpy as np
from scipy.special import eval_jacobi, roots_jacobi

from fringeforce.base.arrays import Array, Mask, Single
from fringeforce.design.pad import Pad
from fringeforce.mechanics.solid.fourier import retardance_waves
from fringeforce.models.as_built import RESIDUAL
from fringeforce.models.pad_slices import DIGITS, block_of
from fringeforce.models.pad_spectra import (
    DEGREES,
    add_loads,
    fill_moved,
    fill_terms,
    pull,
    radial_table,
)
from fringeforce.models.pad_synthesis import Harmonics, Synthesis
from fringeforce.optics.photoelasticity import stress_optic_constant

POLYNOMIAL_DEGREE, RADIAL = 8, 10
"""Degrees up to which there are all polynomials, and those that are the same in all directions."""
PRESSURE_STDS = {3: 0.15, 4: 0.3, 5: 0.1, 6: 0.2, 7: 0.07, 8: 0.15, 10: 0.1}
"""Standard deviations of the shapes of a pressure by their degree.  Spheres of 2 to 10 mm on a thin
cover have up to 0.2 at degree 4; flat punches and long edges have 0.3 to 0.5.  A uniform load on a
line, as of a long edge, has 0.27, 0.07, 0.13 and 0.09 at degrees 4, 6, 8 and 10, all along it."""
SHEAR_STDS = {1: 0.1, 2: 0.2, 3: 0.05, 4: 0.15, 6: 0.1}
"""The same of shears, over the normal force.  Under partial slip with a friction of 0.6 a sphere
has 0.1 to 0.2 at degree 2."""
SHEAR_DEGREE, SHEAR_RADIAL = 4, 6
"""As `POLYNOMIAL_DEGREE` and `RADIAL`, of shears."""
SIZE = 2.0, 1.0
"""Typical size over the thickness of the cover, and standard deviation of its logarithm."""
LONG = 0.7
"""Standard deviation of s and u: ellipses are up to 16 times as long as wide at two of them."""
FORCE = 20.0
"""Standard deviation of the force of a contact [N]."""
SLICES, PROFILE_SHARE = 32, 3e-3
"""Depths of the layer, of which twice as many change a frame of 8 bits by less than a tenth of a
grey level, and the share of the stresses that depth profiles may leave out beside their mean over
the depth: 8 N on a contact of 1.6 mm change by 0.3 grey levels at most, and 0.006 in the root mean
square."""
CURVATURE_DIGITS = 3.0
"""As `DIGITS`, for curvatures: with more, stated deviations of totals change by less than 1 %."""
LOG_STEP = 1e-3
"""Change of the logarithm of sizes by which spectra are differentiated."""
N, PLACE, SHAPE, FIRST_SHAPE = 0, 3, 5, 8
"""Where force, place, logarithm of the size with s and u, and shapes begin among the unknowns."""


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
    if degree <= POLYNOMIAL_DEGREE or waves == 0
)
"""All polynomials; the first is constant."""
PRESSURES = tuple(i for i, term in enumerate(TERMS) if term.degree > 2)
SHEARS = tuple(
    i
    for i, term in enumerate(TERMS)
    if 0 < term.degree <= SHEAR_DEGREE or (0 < term.degree <= SHEAR_RADIAL and term.waves == 0)
)
"""Polynomials of pressure and of either component of shear."""
_SHAPES = np.array(
    [(0, term) for term in PRESSURES] + [(part, term) for part in (1, 2) for term in SHEARS]
)
"""Component and polynomial of every unknown of the shapes."""
SIZE_OF = FIRST_SHAPE + len(_SHAPES)
"""Unknowns of a contact."""


def matrix_of(shapes: Array) -> Array:
    """A of (logarithm of size, s, u), shape (..., 3), as (..., 2, 2) [m]."""
    size, s, u = shapes[..., 0], shapes[..., 1], shapes[..., 2]
    length = np.maximum(np.hypot(s, u), 1e-9)  # sinh(x) / x is then 1
    sinh, cosh = np.sinh(length) / length, np.cosh(length)
    entries = np.stack([cosh + sinh * s, sinh * u, sinh * u, cosh - sinh * s], axis=-1)
    found: Array = np.exp(size)[..., None, None] * entries.reshape(*size.shape, 2, 2)
    return found


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
        alpha, beta, stack = _retardance_of(self.pad, DIGITS)
        # damped twice, for loads have weaker short waves than a point has
        kappa = np.hypot(alpha[:, None], beta)
        flat = (stack * np.exp(-kappa * block.compliant.thickness / 4)).reshape(SLICES, -1)
        # the mean over the depth is one of them, which is nearly all that light sees
        first = np.full((SLICES, 1), SLICES**-0.5)
        if RESIDUAL in self.pad.tolerances:  # which is even in depth
            first, _ = np.linalg.qr(np.column_stack([first, block.depths(SLICES)[1]]))
        rest = flat - first @ (first.T @ flat)
        vectors, sizes, _ = np.linalg.svd(rest @ rest.T)
        lost = np.sqrt(np.append(sizes[::-1].cumsum()[::-1], 0) / np.vdot(flat, flat))
        profile = np.column_stack([first, vectors[:, : int(np.argmax(lost <= PROFILE_SHARE))]])
        waves = np.einsum("sk,sfcmn->fkcmn", profile, stack, optimize=True)
        return alpha, beta, waves.astype(np.float32), profile.astype(np.float32)

    @property
    def waves(self) -> Single:
        """Retardance of the modes per harmonic of N, T_x and T_y, shape (2, modes, 3, m, n)."""
        return self._waves[2]

    def waves_of(self, pad: Pad) -> Array:
        """The same of a pad with other layers, for the same harmonics and depth profiles."""
        own, other = (one.transducer.compliant.thickness for one in (self.pad, pad))
        # as many harmonics, or one more where rounding says so
        _, _, stack = _retardance_of(pad, DIGITS * other / own * (1 + 1e-12))
        m, n = self.waves.shape[-2:]
        return np.einsum("sk,sfcmn->fkcmn", self.profile, stack[..., :m, :n], optimize=True)

    @property
    def profile(self) -> Single:
        """What each mode adds to each slice, shape (slices, modes)."""
        return self._waves[3]

    def synthesis(self, x: Array, y: Array, waves: Single | None = None) -> Synthesis:
        """From harmonics of `loads` to retardance at columns and rows [m], by waves if given."""
        return Synthesis.of(self.waves if waves is None else waves, self._sides, x, y)

    @cached_property
    def pixels(self) -> Synthesis:
        """The same at the columns and rows of the camera."""
        return self.synthesis(*self.pad.pixel_positions)

    def rough(self, x: Array, y: Array, mixed: Single, waves: Single) -> Synthesis:
        """The same from harmonics of `derivatives`, for mixtures (modes, k) of depth profiles."""
        m, n = self._fewer
        lowest = waves[..., :m, :n]
        few = np.einsum("kr,fkcmn->frcmn", mixed, lowest, optimize=True)
        return Synthesis.of(few, self._sides, x, y)

    @property
    def _sides(self) -> tuple[float, float]:
        return self.pad.transducer.length, self.pad.transducer.width

    @cached_property
    def _grid(self) -> tuple[Any, ...]:
        """As `pad_spectra.add_loads` wants it."""
        alpha, beta, *_ = self._waves
        both = zip((alpha, beta), self._sides, strict=True)
        parts = [np.where(k > 0, 2.0, 1.0) / side for k, side in both]
        norm = np.outer(*parts) / 2
        # those in the corners, beyond the highest along the axes, are damped away
        highest = max(alpha[-1], beta[-1])
        reach = np.searchsorted(beta, np.sqrt(highest**2 - alpha**2), side="right")
        single = [part.astype(np.float32) for part in (alpha, beta, norm)]
        return (single[0], single[1], reach, single[2], radial_table())

    @cached_property
    def _rough(self) -> tuple[Any, ...]:
        """The same of those harmonics that count for curvatures."""
        alpha, beta, reach, norm, table = self._grid
        m, n = self._fewer
        return alpha[:m], beta[:n], np.minimum(reach[:m], n), norm[:m, :n].copy(), table

    def lowest(self, loads: Single) -> Single:
        """Those harmonics of `loads` that count for curvatures."""
        m, n = self._fewer
        return loads[..., :m, :n]

    @cached_property
    def _fewer(self) -> tuple[int, int]:
        """How many harmonics along x and along y count for curvatures."""
        alpha, beta, *_ = self._waves
        m, n = (int(np.ceil(len(k) * CURVATURE_DIGITS / DIGITS)) for k in (alpha, beta))
        return m, n

    def _ellipse(self, contact: Array) -> tuple[Any, ...]:
        """As `pad_spectra.add_loads` wants it."""
        alpha, beta, *_ = self._waves
        corner = np.array(self._sides) / 2
        x, y = contact[PLACE:SHAPE] + corner
        at = [np.exp(1j * k * place).astype(np.complex64) for k, place in ((alpha, x), (beta, y))]
        return matrix_of(contact[SHAPE:FIRST_SHAPE]).astype(np.float32), at[0], at[1]

    def _mixed(self, contact: Array) -> Array:
        """Coefficients of all polynomials in N, T_x and T_y, shape (3, terms) [N]."""
        mixed = np.zeros((3, len(TERMS)))
        mixed[:, 0] = contact[:PLACE]
        first = FIRST_SHAPE + len(PRESSURES)
        mixed[0, list(PRESSURES)] = contact[0] * contact[FIRST_SHAPE:first]
        mixed[1:, list(SHEARS)] = contact[0] * contact[first:].reshape(2, -1)
        return mixed

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
            mixed = (_SCALES * self._mixed(contact)).astype(np.float32)
            add_loads(self._grid, _DEGREES, self._ellipse(contact), mixed, total)
        return total

    def gradient(self, contact: Array, by_loads: Single) -> Array:
        """Derivative by all unknowns of a contact, shape (SIZE_OF,).

        Parameters
        ----------
        contact : ndarray, shape (SIZE_OF,)
            The unknowns.
        by_loads : ndarray, shape (3, m, n)
            Derivative by harmonics of `loads`.
        """
        mixed = self._mixed(contact)
        by_mixed, by_place, by_matrix = np.empty(mixed.shape), np.empty(2), np.empty((2, 2))
        pull(
            self._grid,
            _DEGREES,
            self._ellipse(contact),
            (_SCALES * mixed).astype(np.float32),
            by_loads,
            by_mixed,
            by_place,
            by_matrix,
        )
        by_mixed *= _SCALES
        found, first = np.empty(SIZE_OF), FIRST_SHAPE + len(PRESSURES)
        found[0] = np.vdot(by_mixed, mixed_by_normal(mixed, contact))
        found[1:PLACE] = by_mixed[1:, 0]
        found[PLACE:SHAPE] = by_place
        for k, change in enumerate(np.eye(3) * LOG_STEP):
            ahead, behind = (matrix_of(contact[SHAPE:FIRST_SHAPE] + s * change) for s in (1, -1))
            found[SHAPE + k] = np.vdot(by_matrix, ahead - behind) / (2 * LOG_STEP)
        found[FIRST_SHAPE:first] = contact[0] * by_mixed[0, list(PRESSURES)]
        found[first:] = contact[0] * by_mixed[1:, list(SHEARS)].ravel()
        return found

    def derivatives(self, contact: Array, free: Mask) -> list[Harmonics]:
        """Derivatives of `loads` by unknowns of a contact.

        Only those harmonics are given that count for curvatures, the lowest.

        Parameters
        ----------
        contact : ndarray, shape (SIZE_OF,)
            The unknowns.
        free : ndarray of bool, shape (SIZE_OF,)
            Those that are asked for.
        """
        grid, shape = self._rough, self._ellipse(contact)
        mixed = (_SCALES * self._mixed(contact)).astype(np.float32)
        size = len(grid[0]), len(grid[1])
        whole, unit, *moved = np.empty((4, 3, *size), np.float32)
        fill_moved(grid, _DEGREES, shape, mixed, whole, unit, *moved)
        unit *= np.float32(_SCALES[0])
        found = list[Harmonics]()
        for k in np.flatnonzero(free[:FIRST_SHAPE]).tolist():
            if k == 0:  # pressure and shapes grow with it, but not the tangential force
                values = whole.copy()
                values[1:] -= contact[1:PLACE, None, None].astype(np.float32) * unit[1:]
                values /= np.float32(max(contact[0], 1e-9))
            elif k < PLACE:
                found.append(Harmonics(k, unit[k]))
                continue
            elif k < SHAPE:
                values = moved[k - PLACE]
            else:
                ahead, values = contact.copy(), -whole
                ahead[k] += LOG_STEP
                add_loads(grid, _DEGREES, self._ellipse(ahead), mixed, values)
                values /= np.float32(LOG_STEP)
            found.append(Harmonics(None, values))
        chosen = _SHAPES[free[FIRST_SHAPE:]]
        if len(chosen):
            places = np.full((3, len(TERMS)), -1)
            places[tuple(chosen.T)] = np.arange(len(chosen))
            each = np.empty((len(chosen), *size), dtype=np.float32)
            scales = (contact[0] * _SCALES).astype(np.float32)
            fill_terms(grid, _DEGREES, shape, scales, places, each)
            found += map(Harmonics, chosen[:, 0].tolist(), each)
        return found

    @property
    def friction(self) -> float:
        """Largest |tangential| / normal force of a contact."""
        assert self.pad.skin is not None
        return self.pad.skin.friction

    def drawn(self, count: int) -> tuple[Array, Array]:
        """Mean and standard deviation of the unknowns of contacts before a frame, (k, SIZE_OF)."""
        assert self.pad.skin is not None
        cover, friction = self.pad.transducer.compliant.thickness, self.friction
        mean, std = np.zeros(SIZE_OF), np.zeros(SIZE_OF)
        std[:PLACE] = FORCE, friction * FORCE, friction * FORCE
        std[PLACE:SHAPE] = np.array(self.pad.skin.extent) / 2
        mean[SHAPE], std[SHAPE:FIRST_SHAPE] = np.log(SIZE[0] * cover), (SIZE[1], LONG, LONG)
        std[FIRST_SHAPE : FIRST_SHAPE + len(PRESSURES)] = [
            PRESSURE_STDS[TERMS[i].degree] for i in PRESSURES
        ]
        std[FIRST_SHAPE + len(PRESSURES) :] = [SHEAR_STDS[TERMS[i].degree] for i in SHEARS] * 2
        return np.tile(mean, (count, 1)), np.tile(std, (count, 1))


def _retardance_of(pad: Pad, digits: float) -> tuple[Array, Array, Array]:
    """Wave numbers, and retardance of slices (S, 2, 3, m, n) per harmonic of tractions."""
    block = block_of(pad)
    alpha, beta, found = retardance_waves(block, SLICES, digits)
    constant = stress_optic_constant(pad.transducer.photoelastic, pad.polariscope.wavelength)
    weights = block.depths(SLICES)[1]
    return alpha, beta, constant * weights[:, None, None, None, None] * found


_SCALES = np.array([(1, 1, -1, -1)[term.degree % 4] * term.scale for term in TERMS])
"""Of the spectra, with i^degree, less i for odd degrees."""
_COUNTS = np.bincount([term.degree for term in TERMS], minlength=DEGREES)
_DEGREES = np.cumsum(_COUNTS) - _COUNTS, _COUNTS
"""Where the terms of a degree begin, and how many there are."""


def mixed_by_normal(mixed: Array, contact: Array) -> Array:
    """Derivative by N of the coefficients of all polynomials, shape (3, terms)."""
    found = mixed / max(contact[0], 1e-9)
    found[1:, 0] = 0.0
    return found
