"""Rubber under large strain: energy, stress and tangent of isotropic layers in a plane.

One energy per volume covers three materials (Holzapfel, Nonlinear Solid Mechanics, 2000, section
6.5), with I1 and I2 the invariants of the right Cauchy-Green tensor and J the volume ratio:

    W = sum_i Ci0 (J^(-2/3) I1 - 3)^i + C01 (J^(-4/3) I2 - 3) + bulk (J - 1)^2 / 2

Neo-Hookean rubber has C10 alone, Mooney and Rivlin's C10 and C01, Yeoh's C10, C20 and C30.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.design.strip import Layer, Plane

ITERATIONS = 30
"""Newton steps for the stretch across the strip; three are usual."""
GRADIENT_STEP = 1e-5
"""Change of a deformation gradient to whose two signs a derivative is taken: errors are 1e-10."""
LAST = 1e-7
"""Relative change of that stretch after which none follows: a step leaves about its square."""


@dataclass(frozen=True)
class PlaneResponse:
    """Energy of deformation gradients in a plane, and its derivatives, each when it is asked for.

    Attributes
    ----------
    material : Hyperelastic
        What is deformed.
    gradient : ndarray, shape (2, 2, ...)
        Deformation gradient F.
    across : ndarray, shape (...)
        Stretch across the strip; 1 in plane strain.
    scale : ndarray, shape (...)
        The volume ratio to the power of -2/3.
    free : bool
        Whether nothing pulls across the strip (plane stress), so that the stretch there follows F.
    """

    material: Hyperelastic
    gradient: Array
    across: Array
    scale: Array
    free: bool

    @cached_property
    def square(self) -> Array:
        """F:F, shape (...)."""
        return (self.gradient**2).sum(axis=(0, 1))

    @cached_property
    def area(self) -> Array:
        """Area ratio det F, shape (...)."""
        (a, b), (c, d) = self.gradient
        return a * d - b * c

    @property
    def energy(self) -> Array:
        """Per reference volume, shape (...) [Pa]."""
        return self.material.energy(self.square, self.area, self.across, self.scale)

    @cached_property
    def slope(self) -> tuple[Array, Array]:
        """Derivatives of the energy by F:F and det F, shape (...) each [Pa]."""
        return self.material.slope(self.square, self.area, self.across, self.scale)

    @property
    def stress(self) -> Array:
        """First Piola-Kirchhoff stress P, derivative with respect to F, shape (2, 2, ...) [Pa]."""
        by_square, by_area = self.slope
        return 2 * by_square * self.gradient + by_area * _cofactor(self.gradient)

    @property
    def stress_across(self) -> Array:
        """Cauchy stress across the strip, shape (...) [Pa]; 0 in plane stress."""
        if self.free:
            return np.zeros_like(self.area)
        t, j, s = self.square, self.area, self.across
        return self.material.across(t, j, s, self.scale)[0] / j

    @property
    def tangent(self) -> Array:
        """Derivative of P with respect to F, shape (2, 2, 2, 2, ...) [Pa]."""
        curve = self.material.curve(self.square, self.area, self.across, self.scale, self.free)
        parts = (2 * self.gradient, _cofactor(self.gradient))
        found = np.zeros((2, 2, 2, 2, *self.area.shape))
        for m, left in enumerate(parts):
            right = curve[m] * parts[0] + curve[m + 1] * parts[1]
            found += left[:, :, None, None] * right[None, None]
        for i in range(2):
            for k in range(2):
                found[i, k, i, k] += 2 * self.slope[0]
                found[i, k, 1 - i, 1 - k] += self.slope[1] * (1 if i == k else -1)
        return found


@dataclass(frozen=True)
class Hyperelastic:
    """An isotropic material under large strain.

    Attributes
    ----------
    coefficients : tuple of float
        C10, C20, ... of the powers of the first invariant [Pa].
    bulk : float
        Bulk modulus [Pa].
    second : float
        C01 of the second invariant [Pa].

    Examples
    --------
    >>> from fringeforce.mechanics.hyperelasticity import Hyperelastic
    >>> rubber = Hyperelastic((0.5e6,), bulk=50e6)
    >>> rubber.plane(np.eye(2), "stress").stress.round(9).tolist()
    [[0.0, 0.0], [0.0, 0.0]]
    """

    coefficients: tuple[float, ...]
    bulk: float
    second: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (
            ("shear modulus 2 (C10 + C01)", self.shear),
            ("bulk modulus", self.bulk),
        ):
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"The {name} is {value:g} Pa; it has to be above 0.")

    @property
    def shear(self) -> float:
        """Shear modulus at small strain [Pa]."""
        return 2 * (sum(self.coefficients[:1]) + self.second)

    @classmethod
    def of(cls, layer: Layer) -> Hyperelastic:
        """The material of a layer, whose moduli at small strain are those of the design.

        Raises
        ------
        InputError
            If Poisson's ratio leaves no bulk modulus above 0.
        """
        found = layer.coefficients
        powers = tuple(found[name] for name in ("C10", "C20", "C30") if name in found)
        bulk = layer.youngs_modulus / (3 * (1 - 2 * layer.poissons_ratio))
        return cls(powers, bulk, second=found.get("C01", 0.0))

    def plane(self, gradient: Array, plane: Plane) -> PlaneResponse:
        """Energy, stress and tangent at deformation gradients F, shape (2, 2, ...).

        Raises
        ------
        InputError
            If a gradient turns the material inside out, or the plane is "3d".
        """
        if plane == "3d":
            raise InputError(
                'Large strain is calculated in a plane; take plane = "stress" or "strain".'
            )
        (a, b), (c, d) = gradient
        t, j = (gradient**2).sum(axis=(0, 1)), a * d - b * c
        if not np.all(j > 0):
            raise InputError(
                f"The area ratio of an element falls to {np.min(j):g}; below 0 it is inside out. "
                "Take smaller loads or wider contacts."
            )
        if plane == "strain":
            return PlaneResponse(self, gradient, np.ones_like(j), j ** (-2 / 3), free=False)
        return PlaneResponse(self, gradient, *self._free_stretch(t, j), free=True)

    def _free_stretch(self, t: Array, j: Array) -> tuple[Array, Array]:
        """Stretch across at which nothing pulls or presses there, and (j s)^(-2/3) with it."""
        # what a material that hardly changes its volume does; the modulus bounds the steps
        s = j ** -(1 - 2 * self.shear / (3 * self.bulk + 2 * self.shear))
        for _ in range(ITERATIONS):
            scale = (j * s) ** (-2 / 3)
            slope, curve = self.across(t, j, s, scale)
            step = np.clip(-slope / np.abs(curve), -s / 2, s)
            share = step / s
            s = s + step
            if np.max(np.abs(share), initial=0.0) < LAST:
                return s, scale * (1 - 2 / 3 * share + 5 / 9 * share**2)  # of (1 + share)^(-2/3)
        raise InputError(
            f"No stretch across the strip is free of stress at an area ratio of {np.min(j):g}; "
            "take smaller loads or wider contacts."
        )

    def _rise(self, excess: Array) -> Array:
        """First derivative of the sum of Ci0 excess^i."""
        found = np.zeros_like(excess)
        for i, c in reversed([*enumerate(self.coefficients, 1)]):
            found = found * excess + i * c
        return found

    def _turn(self, excess: Array) -> Array:
        """Second derivative of it."""
        found = np.zeros_like(excess)
        for i, c in reversed([*enumerate(self.coefficients[1:], 2)]):
            found = found * excess + i * (i - 1) * c
        return found

    def energy(self, t: Array, j: Array, s: Array, scale: Array) -> Array:
        """W of t = F:F and j = det F in a plane, the stretch s across and (j s)^(-2/3) [Pa]."""
        excess = scale * (t + s**2) - 3
        found = self.bulk / 2 * (j * s - 1) ** 2
        for i, c in enumerate(self.coefficients, 1):
            found = found + c * excess**i
        return found + self.second * (scale**2 * (s**2 * t + j**2) - 3)

    def slope(self, t: Array, j: Array, s: Array, scale: Array) -> tuple[Array, Array]:
        """Derivatives of W by t and j; arguments as of `energy`."""
        first = scale * (t + s**2)
        rise = self._rise(first - 3)
        by_t = rise * scale
        by_j = self.bulk * (j * s - 1) * s - 2 / 3 * rise * first / j
        if self.second:  # (j s)^(-4/3) (s^2 t + j^2)
            scale, square = self.second * scale**2, s**2
            by_t = by_t + scale * square
            by_j = by_j + scale * (2 * j**2 - 4 * square * t) / (3 * j)
        return by_t, by_j

    def across(self, t: Array, j: Array, s: Array, scale: Array) -> tuple[Array, Array]:
        """First and second derivative of W by s alone; arguments as of `energy`."""
        square, volume = s**2, j * s
        first = scale * (t + square)
        by = scale * (4 * square - 2 * t) / (3 * s)
        twice = scale * (10 * t + 4 * square) / (9 * square)
        rise = self._rise(first - 3)
        slope, curve = rise * by, rise * twice
        if len(self.coefficients) > 1:
            curve = curve + self._turn(first - 3) * by**2
        if self.second:
            scale = self.second * scale**2
            slope = slope + scale * (2 * square * t - 4 * j**2) / (3 * s)
            curve = curve + scale * (28 * j**2 - 2 * square * t) / (9 * square)
        return slope + self.bulk * j * (volume - 1), curve + self.bulk * j**2

    def curve(
        self, t: Array, j: Array, s: Array, scale: Array, free: bool
    ) -> tuple[Array, Array, Array]:
        """Second derivatives of W by t, by t and j, and by j; arguments as of `energy`.

        Where the stretch across is free, those of the energy that it leaves.
        """
        square = s**2
        first = scale * (t + square)
        rise, turn = self._rise(first - 3), self._turn(first - 3)
        by_j, by_s = -2 / 3 * first / j, scale * (4 * square - 2 * t) / (3 * s)
        tt = turn * scale**2
        tj = turn * scale * by_j - 2 / 3 * rise * scale / j
        jj = turn * by_j**2 + 10 / 9 * rise * first / j**2 + self.bulk * square
        other = self.second * scale**2
        if self.second:
            tj = tj - 4 / 3 * other * square / j
            jj = jj + other * (28 * square * t / j**2 - 2) / 9
        if not free:
            return tt, tj, jj
        ts = turn * scale * by_s - 2 / 3 * rise * scale / s
        js = turn * by_j * by_s - 2 / 3 * rise * by_s / j + self.bulk * (2 * j * s - 1)
        if self.second:
            ts = ts + 2 / 3 * other * s
            js = js - 8 / 9 * other * (j**2 + square * t) / (j * s)
        ss = self.across(t, j, s, scale)[1]
        return tt - ts**2 / ss, tj - ts * js / ss, jj - js**2 / ss


def _cofactor(gradient: Array) -> Array:
    """Derivative of det F with respect to F, shape (2, 2, ...)."""
    (a, b), (c, d) = gradient
    return np.array([[d, -c], [-b, a]])
