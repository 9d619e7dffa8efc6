"""What light along straight lines sees of a strip under large strain."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.sparse import csr_array

from fringeforce.base.arrays import Array
from fringeforce.design.strip import Plane
from fringeforce.mechanics.elements import (
    along,
    each_at,
    each_from_gauss,
    gauss_line,
    interpolation,
)
from fringeforce.mechanics.hyperelasticity import GRADIENT_STEP, Hyperelastic
from fringeforce.mechanics.mesh import Mesh


@dataclass(frozen=True, eq=False)
class DeformedLight:
    """Stress of the photoelastic layer along the camera's lines.

    Attributes
    ----------
    mesh : Mesh
        Of the strip.
    rows : int
        Of its elements, those of the layer, which are the lowest.
    material : Hyperelastic
        Of the layer.
    plane : {"stress", "strain"}
        Of the strip.
    """

    mesh: Mesh
    rows: int
    material: Hyperelastic
    plane: Plane

    @cached_property
    def heights(self) -> Array:
        """Gauss heights of the layer without load [m]."""
        return gauss_line(self.mesh.order, self.mesh.z[: self.rows + 1])[0]

    @cached_property
    def weights(self) -> Array:
        """Their weights [m]."""
        return gauss_line(self.mesh.order, self.mesh.z[: self.rows + 1])[1]

    def integrated_stress(self, coefficients: Array, x: ArrayLike) -> Array:
        """What light along straight lines sees of the deformed strip.

        A line at the camera's x meets the material point X(Z) with X + u(X, Z) = x at every height
        Z.  Along it dz = (det F / F11) dZ, and sigma = P F^T / (det F s), s the stretch across.

        Parameters
        ----------
        coefficients : ndarray
            Displacements, as of `FiniteStrip`.
        x : array_like, shape (m,)
            Where the camera looks [m].

        Returns
        -------
        ndarray, shape (m,)
            Integral of sigma_x - sigma_y over the photoelastic layer [Pa m]; 0 where a line passes
            beside the strip.
        """
        mesh, points = self.mesh, np.asarray(x, dtype=float)
        seen, _, _ = self.by_height(coefficients)
        u = along(interpolation(mesh.order, mesh.z, self.heights)[0], coefficients[0], 1)
        half = mesh.x[-1]
        wanted = np.repeat(points[:, None], len(self.heights), axis=1)
        place = np.clip(wanted, -half, half)
        inside = np.ones(place.shape, dtype=bool)
        for _ in range(3):  # quadratic convergence from strains of a few percent
            here, rising = each_at(mesh.order, mesh.x, u, place)
            place = place - (place + here - wanted) / (1 + rising)
            inside = np.abs(place) <= half * (1 + 1e-9)
            place = np.clip(place, -half, half)
        return (each_from_gauss(mesh.order, mesh.x, seen, place) * inside) @ self.weights

    def by_height(self, coefficients: Array) -> tuple[Array, Array, Array]:
        """Stress difference by height of the undeformed layer, displacement and strain along x.

        At the stations of the mesh and the Gauss heights of the photoelastic layer.
        """
        moved, f = self._layer_gradients(coefficients)
        f[0, 0] += 1
        f[1, 1] += 1
        return self._shown(f), moved, f[0, 0] - 1

    def _layer_gradients(self, coefficients: Array) -> tuple[Array, Array]:
        """Displacement along x and gradients of both, at the stations and heights of the layer.

        Of coefficients of shape (..., 2, along x, along z); gradients have the shape
        (2, 2, ..., M, heights).
        """
        at, sloping, value, slope = self._at_stations
        u, w = coefficients[..., 0, :, :], coefficients[..., 1, :, :]
        (u, du), (w, dw) = ((along(value, one, -1), along(slope, one, -1)) for one in (u, w))
        rows = [[along(sloping, one, -2), along(at, rise, -2)] for one, rise in ((u, du), (w, dw))]
        return along(at, u, -2), np.array(rows)

    def _shown(self, gradients: Array) -> Array:
        """Stress difference by height of the undeformed layer under deformation gradients."""
        response = self.material.plane(gradients, self.plane)
        (a, b), (c, d) = gradients
        j = a * d - b * c
        sigma = (response.stress[0] * gradients[0]).sum(axis=0) / (j * response.across)
        return (sigma - response.stress_across) * j / a

    @cached_property
    def _at_stations(self) -> tuple[csr_array, csr_array, csr_array, csr_array]:
        mesh = self.mesh
        return (
            *interpolation(mesh.order, mesh.x, mesh.stations),
            *interpolation(mesh.order, mesh.z, self.heights),
        )

    def at_stations(self, coefficients: Array) -> Array:
        """`integrated_stress` at the stations of the mesh, smooth in the forces, shape (M,).

        Splines carry the stress from where the material was to where the camera looks.
        """
        seen, moved, _ = self.by_height(coefficients)
        x, found = self.mesh.stations, np.zeros(len(self.mesh.stations))
        for weight, column, shift in zip(self.weights, seen.T, moved.T, strict=True):
            found += weight * CubicSpline(x + shift, column)(x)
        return found

    def _turned(self, gradients: Array, changes: Array) -> tuple[Array, Array]:
        """Displacement along x by changes of the displacements, and change of what light sees.

        At the stations and heights of the layer under deformation gradients.
        """
        carried, tilts = self._layer_gradients(changes)
        turned = np.zeros(carried.shape)
        for i in range(2):
            for j in range(2):
                tilt = np.zeros((2, 2, 1, 1))
                tilt[i, j] = GRADIENT_STEP
                slope = (self._shown(gradients + tilt) - self._shown(gradients - tilt)) / (
                    2 * GRADIENT_STEP
                )
                turned += slope * tilts[i, j]
        return carried, turned

    def linear_slopes(self, changes: Array) -> Array:
        """`slopes` without load."""
        return (self._turned(np.eye(2)[:, :, None, None], changes)[1] @ self.weights).T

    def slopes(self, coefficients: Array, changes: Array) -> Array:
        """Derivatives of `at_stations` along changes of the displacements, shape (M, k).

        Parameters
        ----------
        coefficients : ndarray
            Displacements, as of `FiniteStrip`.
        changes : ndarray, shape (k, ...)
            Changes of them.
        """
        seen, moved, _ = self.by_height(coefficients)
        _, gradients = self._layer_gradients(coefficients)
        gradients[0, 0] += 1
        gradients[1, 1] += 1
        carried, turned = self._turned(gradients, changes)
        x, found = self.mesh.stations, np.zeros((len(self.mesh.stations), len(changes)))
        for k, weight in enumerate(self.weights):
            place = x + moved[:, k]
            rising = CubicSpline(place, seen[:, k]).derivative()(place)
            own = turned[..., k] - rising * carried[..., k]
            found += weight * CubicSpline(place, own, axis=1)(x).T
        return found
