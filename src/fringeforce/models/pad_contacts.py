"""Retardance of a few contacts anywhere on a pad, and what places, widths and layers change of it.

The pressure under an indenter is proportional to (1 - r^2 / a^2)^m on a disc of diameter w = 2 a:
m = 1/2 is Hertz's, 0 a uniform one and -1/2 that of a rigid flat punch (Johnson, Contact Mechanics,
1985, section 3.4).  Under a tactel it is uniform on the square of side w.  Of each the series of
`mechanics.solid.fourier` needs the Fourier transform alone, at the wave number q: with t = q a and
n = m + 1 it is Gamma(n + 1) (2 / t)^n J_n(t) on a disc, by Sonine's first integral (NIST Handbook,
10.22.19), and on a square a product of two j_0.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import gamma, j0, j1, jv, spherical_jn

from fringeforce.base.errors import InputError
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import number_at, with_values
from fringeforce.models import splines
from fringeforce.models.pad_influence import PadInfluence
from fringeforce.models.pad_slices import DIGITS, profile_waves

Array = NDArray[np.float64]
Single = NDArray[np.float32]

NARROWEST = 1e-2
"""Smallest width of a contact over the cover's thickness: narrower ones look the same."""
SMALL_ARGUMENT = 1e-6
"""Wave number times radius that stands for none."""
EXPONENT_STEP = 0.01
"""Step of the exponent of a pressure for its derivative."""

CLOSED: dict[float, Callable[[Array], Array]] = {
    0.0: j0,
    0.5: lambda t: np.sinc(t / np.pi),
    1.0: lambda t: 2 * j1(t) / t,
    1.5: lambda t: 3 * spherical_jn(1, t) / t,
}
"""Bessel's functions of `bessel` that take a twentieth of the time of any order."""


@dataclass(frozen=True, eq=False)
class ContactInfluence(PadInfluence):
    """Retardance per force of k contacts, on all samples; `quarters` holds one matrix.

    Attributes
    ----------
    directions : ndarray, shape (m, 3 k), optional
        What loads of the matrix's m columns forces are; forces themselves if not given.
    """

    directions: Array | None = None

    def _loads(self, values: NDArray[np.floating]) -> NDArray[np.floating]:
        return values if self.directions is None else self.directions @ values

    def forward(self, values: NDArray[np.floating]) -> Single:
        """Spline coefficients of the modes under forces, shape (3 k,)."""
        (columns,), loads = self.quarters, self._loads(values).astype(np.float32)
        # a product with one number takes BLAS ten times as long
        found = columns[:, 0] * loads[0] if len(loads) == 1 else columns @ loads
        return found.reshape(self.shapes[1])

    def adjoint(self, values: Single) -> Array:
        """From coefficients, shape (2, modes, ny, nx), to forces, shape (3 k,)."""
        found = (self.quarters[0].T @ values.ravel()).astype(float)
        return found if self.directions is None else found @ self.directions

    def matrix(self, x: Array, y: Array) -> Single:
        """The whole influence at all pairs of places, as of `PadInfluence`."""
        along, across = (
            splines.basis(samples, places).astype(np.float32)
            for samples, places in ((self.x, x), (self.y, y))
        )
        columns = self.quarters[0].T.reshape(-1, len(self.y), len(self.x))
        values = (across @ columns @ along.T).reshape(-1, 2, self.modes, len(y) * len(x))
        found = np.moveaxis(values, 0, -1)
        if self.directions is not None:
            found = found @ self.directions
        return np.ascontiguousarray(found, dtype=np.float32)


class Contact(NamedTuple):
    """One contact.

    Attributes
    ----------
    place : ndarray, shape (2,)
        Along x and y [m].
    force : ndarray, shape (3,)
        N, T_x, T_y [N]; what is not force changes the light in proportion to it.
    width : float
        Of the disc, or side of the square [m].
    exponent : float
        Of the pressure, m; none on a square.
    square : bool
        Whether it is that of a tactel.
    """

    place: Array
    force: Array
    width: float
    exponent: float
    square: bool


class ContactChanges(NamedTuple):
    """Influence of contacts, and what is changed of it by a metre, and by a layer's logarithm.

    Attributes
    ----------
    influence : ContactInfluence
        Retardance per force.
    shapes : tuple of ContactInfluence, length 4
        Its derivatives by places along x and y, and widths [1/m], and by exponents.
    layers : tuple of pair of ContactInfluence
        First and half the second derivative by the logarithm of every value of the layers.
    """

    influence: ContactInfluence
    shapes: tuple[ContactInfluence, ...]
    layers: tuple[tuple[ContactInfluence, ContactInfluence], ...]


@dataclass(frozen=True, eq=False)
class ContactSeries:
    """What light sees of harmonic tractions on a pad, and of pads a little different.

    Attributes
    ----------
    pad : Pad
        The design, with roller sides.
    base : PadInfluence
        Whose depth profiles and samples are taken.
    weights : ndarray, shape (slices,)
        Of the depth integral of the base [m].
    paths : tuple of str
        Values of the layers.
    step : float
        Change of their logarithm that derivatives are taken from.

    Raises
    ------
    InputError
        If the sides of the pad are not rollers.
    """

    pad: Pad
    base: PadInfluence
    weights: Array
    paths: tuple[str, ...]
    step: float

    def __post_init__(self) -> None:
        if self.pad.transducer.sides != "roller":
            raise InputError(
                f'sides = "{self.pad.transducer.sides}": the light of contacts anywhere is that of '
                'the exact series; take transducer.sides = "roller".'
            )

    def _waves(self, pad: Pad) -> tuple[Array, Array, Single]:
        """Wave numbers, shape (m,) and (n,), and waves of the profiles, (2 modes, 3, m, n)."""
        cover = self.pad.transducer.compliant.thickness
        # as many harmonics of every pad
        digits = DIGITS * pad.transducer.compliant.thickness / cover
        alpha, beta, waves = profile_waves(pad, self.base.profile, self.weights, digits)
        return alpha, beta, waves.reshape(-1, *waves.shape[2:]).astype(np.float32)

    @cached_property
    def _known(self) -> tuple[Array, Array, Single]:
        return self._waves(self.pad)

    @cached_property
    def _changes(self) -> list[tuple[Single, Single]]:
        """First and half the second derivative of the waves by the logarithms of the layers."""
        here, found = self._known[2], []
        for path in self.paths:
            drawn = number_at(self.pad, path)
            assert drawn is not None
            ends = [
                self._waves(
                    with_values(self.pad, {path: drawn[0] * float(np.exp(way * self.step))})
                )
                for way in (-1.0, 1.0)
            ]
            m, n = (min(len(one[k]) for one in (self._known, *ends)) for k in (0, 1))
            low, high = (np.zeros_like(here) for _ in range(2))
            for target, (_, _, waves) in zip((low, high), ends, strict=True):
                target[..., :m, :n] = waves[..., :m, :n]
            first, second = (high - low) / 2, (high + low - 2 * here) / 2
            found.append((first / np.float32(self.step), second / np.float32(self.step**2)))
        return found

    @cached_property
    def _synthesis(self) -> tuple[tuple[Single, Single], tuple[Single, Single]]:
        """From harmonics to spline coefficients along x and along y, for A and for B."""
        alpha, beta, _ = self._known
        t = self.pad.transducer
        at_x = np.outer(self.base.x + t.length / 2, alpha)
        at_y = np.outer(self.base.y + t.width / 2, beta)
        along, across = splines.coefficients(self.base.x), splines.coefficients(self.base.y)
        (cos_x, sin_x), (cos_y, sin_y) = (
            ((to @ np.cos(at)).astype(np.float32), (to @ np.sin(at)).astype(np.float32))
            for to, at in ((along, at_x), (across, at_y))
        )
        return (cos_x, cos_y), (sin_x, sin_y)

    def _grid(self, harmonics: Single) -> Single:
        """Spline coefficients, flat, of harmonics, shape (2 modes, m, n)."""
        parts = np.split(harmonics, 2)
        fields = [
            np.swapaxes(along @ part @ across.T, 1, 2)
            for part, (along, across) in zip(parts, self._synthesis, strict=True)
        ]
        return np.stack(fields).ravel().astype(np.float32, copy=False)

    def _load(self, contact: Contact) -> list[Array]:
        """Harmonics, shape (3, m, n), of unit forces, and their derivatives as of the shapes."""
        alpha, beta, _ = self._known
        t = self.pad.transducer
        trig = []
        for wave, side, place in (
            (alpha, t.length, contact.place[0]),
            (beta, t.width, contact.place[1]),
        ):
            share, turned = np.where(wave > 0, 2.0, 1.0) / side, wave * (place + side / 2)
            trig.append((share * np.cos(turned), share * np.sin(turned), wave))
        (cos_x, sin_x, _), (cos_y, sin_y, _) = trig
        along, across = np.stack([cos_x, sin_x, cos_x]), np.stack([cos_y, cos_y, sin_y])
        by_x = np.stack([-alpha * sin_x, alpha * cos_x, -alpha * sin_x])
        by_y = np.stack([-beta * sin_y, -beta * sin_y, beta * cos_y])
        spread, by_width, by_exponent = _spread(alpha, beta, contact)
        parts = (
            (along, across, spread),
            (by_x, across, spread),
            (along, by_y, spread),
            (along, across, by_width),
            (along, across, by_exponent),
        )
        return [x[:, :, None] * y[:, None] * shape for x, y, shape in parts]

    def changes(self, contacts: Sequence[Contact]) -> ContactChanges:
        """Influence of some contacts, and what changes of it."""
        _, _, waves = self._known
        columns: list[list[Single]] = [[] for _ in range(5 + 2 * len(self.paths))]
        for contact in contacts:
            loads = [one.astype(np.float32) for one in self._load(contact)]
            force = contact.force.astype(np.float32)
            columns[0] += [self._grid(waves[:, c] * loads[0][c]) for c in range(3)]
            for number, load in enumerate(loads[1:], 1):
                columns[number].append(self._grid(_sum(waves, load, force)))
            for number, parts in enumerate(self._changes):
                for power, part in enumerate(parts):
                    grid = self._grid(_sum(part, loads[0], force))
                    columns[5 + 2 * number + power].append(grid)
        directions = np.zeros((len(contacts), 3 * len(contacts)))
        for k, contact in enumerate(contacts):
            square = max(float(contact.force @ contact.force), np.finfo(float).tiny)
            directions[k, 3 * k : 3 * k + 3] = contact.force / square
        forces, *changes = columns
        influence = self._influence(forces, None)
        made = [self._influence(part, directions) for part in changes]
        layers = tuple(zip(made[4::2], made[5::2], strict=True))
        return ContactChanges(influence, tuple(made[:4]), layers)

    def _influence(self, columns: list[Single], directions: Array | None) -> ContactInfluence:
        count = len(columns) // 3 if directions is None else len(columns)
        base, size = self.base, 2 * self.base.modes * len(self.base.y) * len(self.base.x)
        # column by column in memory, for there are few
        grid = np.stack(columns).T if columns else np.zeros((size, 0), np.float32)
        return ContactInfluence(
            (count, 1), base.x, base.y, base.profile, (grid,), directions=directions
        )


def _sum(waves: Single, load: Single, force: Single) -> Single:
    """Harmonics of a force, summed over its components, shape (2 modes, m, n)."""
    weighted = force[:, None, None] * load
    return np.asarray(np.einsum("kcmn,cmn->kmn", waves, weighted))


def _spread(alpha: Array, beta: Array, contact: Contact) -> tuple[Array, Array, Array]:
    """Fourier transform of a unit traction, (m, n), and its derivatives by width and exponent."""
    half = contact.width / 2
    if contact.square:
        x, y = (spherical_jn(0, wave * half) for wave in (alpha, beta))
        # the derivative of j_0 is -j_1 (NIST Handbook, 10.51.2)
        by_x, by_y = (-wave / 2 * spherical_jn(1, wave * half) for wave in (alpha, beta))
        whole = np.outer(x, y)
        return whole, np.outer(by_x, y) + np.outer(x, by_y), np.zeros_like(whole)
    t = np.maximum(np.hypot(alpha[:, None], beta) * half, SMALL_ARGUMENT)
    order = contact.exponent + 1
    # the derivative of t^-n J_n is -t^-n J_n+1 (NIST Handbook, 10.6.6)
    by_width = -gamma(order + 1) * (2 / t) ** order * jv(order + 1, t) * t / contact.width
    low, whole, high = (bessel(order + way * EXPONENT_STEP, t) for way in (-1, 0, 1))
    return whole, by_width, (high - low) / (2 * EXPONENT_STEP)


def bessel(order: float, t: Array) -> Array:
    """Bessel's function, scaled to one where its argument is zero."""
    t = np.maximum(t, SMALL_ARGUMENT)
    if order in CLOSED:
        return CLOSED[order](t)
    return np.asarray(gamma(order + 1) * (2 / t) ** order * jv(order, t))
