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
    """Rectangles on the top surface, each under a uniform traction that sums up to a unit force."""

    places: Array  # (n, 2): centres along x and y [m]
    size: float | Array = 0.0  # side of a square, or sides (n, 2) along x and y [m]; 0 is a point


@dataclass(frozen=True)
class Shape:
    """Any traction, even or odd along x and along y about its place."""

    odd: tuple[int, int]  # 1 along an axis where it is odd, else 0
    spectrum: Array  # (m, n): its mean with cosines, or sines where it is odd, at all wave numbers


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
