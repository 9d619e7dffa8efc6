"""Pressures as many small forces, none of which lies on a border between tactels.

A pressure under a curved outline is integrated over every tactel's square by Gauss's rule between
the borders of the squares and the outline, in coordinates in which the integrand is smooth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

from fringeforce.base.arrays import Array, Index
from fringeforce.base.errors import InputError
from fringeforce.design.pad import PadTactels

Profile = Literal["hertz", "punch"]
"""Pressures over a disc: (1 - r^2 / a^2) to the power of 1/2 or of -1/2."""
ORDER = 8


@dataclass(frozen=True, eq=False)
class Squares:
    """The squares of a pad's tactels, each grown to its neighbours' so that they leave no gap."""

    x: Array  # borders along x, ascending [m]
    y: Array
    pitch: float

    @classmethod
    def of(cls, tactels: PadTactels) -> Squares:
        """Squares of a design's tactels."""
        x, y = ((np.arange(n + 1, dtype=np.float64) - n / 2) * tactels.pitch for n in tactels.count)
        return cls(x, y, tactels.pitch)

    @property
    def total(self) -> int:
        """Number of squares."""
        return (len(self.x) - 1) * (len(self.y) - 1)

    def numbers(self, places: Array) -> Index:
        """Tactels in whose squares places lie, shape (k, 2) to (k,).

        Raises
        ------
        InputError
            If a place lies beyond all of them.
        """
        slack = 1e-9 * self.pitch
        columns = []
        for borders, values in ((self.x, places[:, 0]), (self.y, places[:, 1])):
            if values.min() < borders[0] - slack or values.max() > borders[-1] + slack:
                raise InputError(
                    f"A contact reaches from {values.min() * 1e3:.3g} to {values.max() * 1e3:.3g} "
                    f"mm, beyond the tactels, which end at {borders[-1] * 1e3:.3g} mm from the "
                    "middle; move it inwards or make it smaller."
                )
            found = np.searchsorted(borders, values, side="right") - 1
            columns.append(np.clip(found, 0, len(borders) - 2))
        return columns[0] * (len(self.y) - 1) + columns[1]

    def add(self, forces: Array, places: Array, small: Array) -> None:
        """Add small forces, shape (k, c), to those of the tactels, shape (n, c)."""
        numbers = self.numbers(places)
        for component, column in enumerate(small.T):
            forces[:, component] += np.bincount(numbers, column, self.total)


@dataclass(frozen=True, eq=False)
class Nodes:
    """A pressure as small forces.

    Attributes
    ----------
    places : ndarray, shape (k, 2)
        Along x and y [m].
    shares : ndarray, shape (k,)
        Shares of the whole force; they sum up to one.
    """

    places: Array
    shares: Array

    @property
    def centre(self) -> Array:
        """Centre of pressure, shape (2,) [m]."""
        return self.shares @ self.places

    def modulated(self, factor: Callable[[Array], Array]) -> Nodes:
        """Pressure times a factor of the places, with its sum kept."""
        shares = self.shares * factor(self.places)
        return Nodes(self.places, shares / shares.sum())


def disc(
    squares: Squares,
    centre: tuple[float, float],
    radius: float,
    profile: Profile = "hertz",
    order: int = ORDER,
) -> Nodes:
    """The pressure under a round contact.

    Parameters
    ----------
    squares : Squares
        Squares of the tactels.
    centre : (float, float)
        Centre of the contact [m].
    radius : float
        Radius of the contact [m].
    profile : str
        "hertz" or "punch".
    order : int
        Nodes between two borders, along x and along y.
    """
    across = squares.y - centre[1]
    turns = np.sqrt(np.clip(radius**2 - across[np.abs(across) < radius] ** 2, 0, None))
    breaks = np.concatenate([squares.x - centre[0], turns, -turns, [-radius, radius]])
    phi, weight_x = _gauss(_angles(np.sort(breaks)[None], radius), order)
    half = radius * np.cos(phi[0])  # the disc's half height at every x
    limits = np.concatenate([-half[:, None], np.repeat(across[None], len(half), 0)], axis=1)
    limits = np.sort(np.append(limits, half[:, None], axis=1), axis=1)
    psi, weight_y = _gauss(_angles(limits, half[:, None]), order)
    # dx dy = (radius cos(phi) dphi) (half cos(psi) dpsi), the pressure is (half cos(psi))^(+-1)
    pressed = (half[:, None] * np.cos(psi)) ** (2 if profile == "hertz" else 0)
    shares = (half * weight_x[0])[:, None] * weight_y * pressed
    x = np.repeat(radius * np.sin(phi[0])[:, None], psi.shape[1], axis=1)
    y = half[:, None] * np.sin(psi)
    kept = shares > 0
    places = np.stack([x[kept], y[kept]], axis=1) + centre
    return Nodes(places, shares[kept] / shares.sum())


def line(squares: Squares, centre: tuple[float, float], length: float, angle: float) -> Nodes:
    """An even pressure along a line.

    Parameters
    ----------
    squares : Squares
        Squares of the tactels.
    centre : (float, float)
        Centre of the line [m].
    length : float
        Length of the line [m].
    angle : float
        Direction of the line, from x towards y [rad].
    """
    direction = np.array([np.cos(angle), np.sin(angle)])
    breaks = [np.array([-length / 2, length / 2])]
    for borders, middle, slope in zip((squares.x, squares.y), centre, direction, strict=True):
        if abs(slope) > 1e-12:
            breaks.append((borders - middle) / slope)
    along = np.clip(np.sort(np.concatenate(breaks)), -length / 2, length / 2)
    at, weights = _gauss(along[None], 2)
    kept = weights[0] > 0
    return Nodes(np.asarray(centre) + at[0][kept, None] * direction, weights[0][kept] / length)


def _angles(limits: Array, radius: float | Array) -> Array:
    return np.arcsin(np.clip(limits / radius, -1, 1))


def _gauss(limits: Array, order: int) -> tuple[Array, Array]:
    """Nodes and weights between ascending limits, shape (k, m + 1) to (k, m order)."""
    points, weights = _rule(order)
    half, middle = np.diff(limits) / 2, (limits[:, 1:] + limits[:, :-1]) / 2
    nodes = middle[..., None] + half[..., None] * points
    return nodes.reshape(len(limits), -1), (half[..., None] * weights).reshape(len(limits), -1)


@cache
def _rule(order: int) -> tuple[Array, Array]:
    return np.polynomial.legendre.leggauss(order)
