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
"""Newton steps for the stretch across the strip; four are usual."""


@dataclass(frozen=True)
class PlaneResponse:
    """Energy of deformation gradients in a plane, and its derivatives.

    Attributes
    ----------
    energy : ndarray, shape (...)
        Per reference volume [Pa].
    stress : ndarray, shape (2, 2, ...)
        First Piola-Kirchhoff stress P, the derivative with respect to F [Pa].
    across : ndarray, shape (...)
        Stretch across the strip; 1 in plane strain.
    stress_across : ndarray, shape (...)
        Cauchy stress across the strip [Pa]; 0 in plane stress.
    gradient : ndarray, shape (2, 2, ...)
        F itself.
    slope, curve : ndarray, shapes (2, ...) and (2, 2, ...)
        First and second derivatives of the energy by F:F and det F [Pa].
    """

    energy: Array
    stress: Array
    across: Array
    stress_across: Array
    gradient: Array
    slope: Array
    curve: Array

    @cached_property
    def tangent(self) -> Array:
        """Derivative of P with respect to F, shape (2, 2, 2, 2, ...) [Pa]."""
        parts = (2 * self.gradient, _cofactor(self.gradient))
        found = np.zeros((2, 2, 2, 2, *self.energy.shape))
        for m, left in enumerate(parts):
            right = self.curve[m, 0] * parts[0] + self.curve[m, 1] * parts[1]
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
        across = np.ones_like(j)
        if plane == "stress":
            across = self._free_stretch(t, j)
        energy, slope, curve = self._derivatives(t, j, across)
        stress_across = slope[2] / j
        if plane == "stress":  # the stretch follows, so that slope[2] stays 0
            curve = curve[:2, :2] - curve[:2, None, 2] * curve[None, 2, :2] / curve[2, 2]
            stress_across = np.zeros_like(j)
        stress = 2 * slope[0] * gradient + slope[1] * _cofactor(gradient)
        return PlaneResponse(
            energy, stress, across, stress_across, gradient, slope[:2], curve[:2, :2]
        )

    def _free_stretch(self, t: Array, j: Array) -> Array:
        """Stretch across at which nothing pulls or presses there."""
        # what a material that hardly changes its volume does; the modulus bounds the steps
        across = j ** -(1 - 2 * self.shear / (3 * self.bulk + 2 * self.shear))
        for _ in range(ITERATIONS):
            slope, curve = self._across(t, j, across)
            step = np.clip(-slope / np.abs(curve), -across / 2, across)
            across = across + step
            if np.max(np.abs(step) / across, initial=0.0) < 1e-12:
                return across
        raise InputError(
            f"No stretch across the strip is free of stress at an area ratio of {np.min(j):g}; "
            "take smaller loads or wider contacts."
        )

    def _powers(self, excess: Array) -> tuple[Array, Array, Array]:
        """Sum of Ci0 excess^i, and its first and second derivative."""
        energy, rise, turn = np.zeros((3, *excess.shape))
        for i, c in enumerate(self.coefficients, 1):
            energy += c * excess**i
            rise += i * c * excess ** (i - 1)
            turn += i * (i - 1) * c * excess ** max(i - 2, 0)
        return energy, rise, turn

    def _across(self, t: Array, j: Array, s: Array) -> tuple[Array, Array]:
        """First and second derivative of W by the stretch across alone, as of `_derivatives`."""
        square, volume = s**2, j * s
        scale = volume ** (-2 / 3)
        first = scale * (t + square)
        by, twice = (
            scale * (4 * square - 2 * t) / (3 * s),
            scale * (10 * t + 4 * square) / (9 * square),
        )
        _, rise, turn = self._powers(first - 3)
        slope, curve = rise * by, rise * twice + turn * by**2
        if self.second:  # (j s)^(-4/3) (s^2 t + j^2)
            scale = self.second * scale**2
            slope += scale * (2 * square * t - 4 * j**2) / (3 * s)
            curve += scale * (28 * j**2 - 2 * square * t) / (9 * square)
        return slope + self.bulk * j * (volume - 1), curve + self.bulk * j**2

    def _derivatives(self, t: Array, j: Array, s: Array) -> tuple[Array, Array, Array]:
        """W and its derivatives by t = F:F, j = det F and the stretch s across, of a plane F."""
        zero, one = np.zeros_like(t), np.ones_like(t)
        first = _isochoric(
            t + s**2,
            [one, zero, 2 * s],
            [[zero, zero, zero], [zero, zero, zero], [zero, zero, 2 * one]],
            -2 / 3,
            j,
            s,
        )
        energy, rise, turn = self._powers(first[0] - 3)
        energy = energy + self.bulk / 2 * (j * s - 1) ** 2
        slope = rise * first[1]
        curve = rise * first[2] + turn * first[1][:, None] * first[1][None]
        if self.second:
            other = _isochoric(
                s**2 * t + j**2,
                [s**2, 2 * j, 2 * s * t],
                [[zero, zero, 2 * s], [zero, 2 * one, zero], [2 * s, zero, 2 * t]],
                -4 / 3,
                j,
                s,
            )
            energy = energy + self.second * (other[0] - 3)
            slope, curve = slope + self.second * other[1], curve + self.second * other[2]
        pressure = self.bulk * (j * s - 1)
        volume = np.array([zero, s, j])
        slope = slope + pressure * volume
        curve = curve + self.bulk * volume[:, None] * volume[None]
        curve[1, 2] += pressure
        curve[2, 1] += pressure
        return energy, slope, curve


def _cofactor(gradient: Array) -> Array:
    """Derivative of det F with respect to F, shape (2, 2, ...)."""
    (a, b), (c, d) = gradient
    return np.array([[d, -c], [-b, a]])


def _isochoric(
    value: Array, slope: list[Array], curve: list[list[Array]], power: float, j: Array, s: Array
) -> tuple[Array, Array, Array]:
    """(j s)^power times a function of (t, j, s), with first and second derivatives."""
    d, dd = np.array(slope), np.array(curve)
    log = power * np.array([np.zeros_like(j), 1 / j, 1 / s])
    scale = (j * s) ** power
    bend = log[:, None] * log[None]
    for k in (1, 2):
        bend[k, k] -= log[k] ** 2 / power
    mixed = log[:, None] * d[None] + d[:, None] * log[None]
    return scale * value, scale * (d + value * log), scale * (dd + mixed + value * bend)
