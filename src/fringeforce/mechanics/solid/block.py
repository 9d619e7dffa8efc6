"""A layered block on a rigid base, the tactels on its top, and what unit forces on them do inside.

Axes: x along, y across, both from the middle of the block; z upwards from the loaded top surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array
from fringeforce.design.strip import Layer

Sides = Literal["free", "roller", "bonded"]


@dataclass(frozen=True)
class Block:
    """A compliant cover on a photoelastic layer that is bonded to a rigid base."""

    length: float  # along x [m]
    width: float  # along y [m]
    compliant: Layer
    photoelastic: Layer
    sides: Sides  # no traction; no normal displacement and no friction; or no displacement at all
    across: Sides | None = None  # the two at y = +-width/2, where they differ from those along x

    @property
    def interface(self) -> float:
        """Height of the plane between cover and photoelastic layer [m]."""
        return -self.compliant.thickness

    @property
    def base(self) -> float:
        """Height of the bonded bottom [m]."""
        return self.interface - self.photoelastic.thickness

    def depths(self, slices: int) -> tuple[Array, Array]:
        """Heights and weights of a Gauss-Legendre rule over the photoelastic layer.

        Parameters
        ----------
        slices : int
            Number of points.

        Returns
        -------
        heights : ndarray, shape (slices,)
            From the interface down to the base [m].
        weights : ndarray, shape (slices,)
            Weights of the slices, whose sum is the thickness of the layer [m].
        """
        points, weights = np.polynomial.legendre.leggauss(slices)
        half = self.photoelastic.thickness / 2
        return self.interface - half * (1 + points), half * weights


@dataclass(frozen=True)
class Patches:
    """Squares on the top surface, each under a traction of one shape.

    A uniform one sums up to a unit force.  Others are P_a(xi) P_b(eta) times the uniform one, with
    Legendre's polynomials of the orders (a, b) and xi, eta from -1 to 1 over the square: they sum
    up to nothing, and say how a traction of the same sum is spread.
    """

    places: Array  # (n, 2): centres along x and y [m]
    size: float = 0.0  # side of a square [m]; zero is a point
    orders: tuple[int, int] = (0, 0)  # along x and along y


@dataclass(frozen=True)
class SolidInfluence:
    """The stresses that light along z sees, per unit force on every tactel.

    Attributes
    ----------
    x, y : ndarray, shape (nx,), (ny,)
        Places of the samples [m].
    z, weights : ndarray, shape (slices,)
        Heights of the samples and the weights of their depth integral [m], from the interface down.
    difference, shear : ndarray, shape (nx, ny, slices, n, 3)
        sigma_x - sigma_y and tau_xy [Pa/N] for a unit normal force, a tangential one along x and
        one along y, on each of n tactels.
    """

    x: Array
    y: Array
    z: Array
    weights: Array
    difference: NDArray[np.floating]
    shear: NDArray[np.floating]
