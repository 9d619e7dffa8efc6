"""What changes over the width of a strip, and what a camera's line makes of it.

Plane models know one phase at each place along the strip.  In three dimensions phase leads differ
across it, shear stresses tau_xy turn the principal directions off the middle, and a pixel that sees
a wide line sees the mean of the light, not the light of the mean phase.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.progress import Progress
from fringeforce.contacts.loads import checked_loads
from fringeforce.design.light import Camera
from fringeforce.design.strip import Sensor, Transducer
from fringeforce.mechanics.elements import gauss_interpolation
from fringeforce.mechanics.solid.mesh import Grading
from fringeforce.mechanics.solid.strip import STRIP, LightLine, strip_integral
from fringeforce.optics import camera as camera_optics
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant
from fringeforce.optics.polariscope import pictures, together

Array = NDArray[np.float64]

GAUSS_POINTS = 16
"""Gauss points over a line that is not narrow."""


@dataclass(frozen=True, eq=False)
class StripWidth:
    """Phases at several places across a strip, per unit tactel force.

    Light crosses depth integrals of the stress difference and of the shear.  Where the principal
    directions turn little through the depth they act as one retarder of the equivalent retardance
    sqrt(lead^2 + cross^2).

    Attributes
    ----------
    sensor : Sensor
        The design.
    breaks : ndarray, shape (e + 1,)
        Boundaries of the elements along the strip [m].
    y, weights : ndarray, shape (ny,)
        Places across the strip [m], and their shares of the light, which sum up to one.
    lead : ndarray, shape (ny, M, n, 2)
        2 K_t times the depth integral of sigma_x - sigma_y, at the stations [rad/N].
    cross : ndarray, shape (ny, M, n, 2)
        2 K_t times the depth integral of 2 tau_xy [rad/N].
    unknowns, order : int
        Number of unknowns, and order of the elements.
    """

    sensor: Sensor
    breaks: Array
    y: Array
    weights: Array
    lead: Array
    cross: Array
    unknowns: int
    order: int

    @property
    def psi(self) -> Array:
        """Influence matrix of the mean lead over the line, shape (M, n, 2) [rad/N]."""
        return np.tensordot(self.weights, self.lead, axes=1)

    def phases(self, forces: ArrayLike, x: ArrayLike) -> tuple[Array, Array]:
        """Lead and cross part at every place across the strip.

        Parameters
        ----------
        forces : array_like, shape (n, 2)
            Normal and tangential force of every tactel [N].
        x : array_like, shape (m,)
            Positions along the strip [m].

        Returns
        -------
        lead, cross : ndarray, shape (ny, m)
            Phases [rad].
        """
        at = gauss_interpolation(self.order, self.breaks, np.asarray(x, dtype=float)).toarray()
        return self._at(at, self.lead, forces), self._at(at, self.cross, forces)

    @staticmethod
    def _at(stations: Array, influence: Array, forces: ArrayLike) -> Array:
        loads = checked_loads(forces, influence.shape[-2]).ravel()
        return (influence.reshape(*influence.shape[:2], -1) @ loads) @ stations.T

    @cached_property
    def _pixels(self) -> Array:
        return gauss_interpolation(self.order, self.breaks, self.sensor.pixel_positions).toarray()

    def intensity(self, forces: ArrayLike) -> Array:
        """Mean of the light over the line that each pixel sees.

        Parameters
        ----------
        forces : array_like, shape (n, 2)
            Normal and tangential force of every tactel [N].

        Returns
        -------
        ndarray, shape (n_pixels,), or (n_channels, n_pixels) if there are several
            Share of what a perfect dark field lets through at most.
        """
        lead, cross = (self._at(self._pixels, part, forces) for part in (self.lead, self.cross))
        lead = lead + self.sensor.polariscope.residual
        seen = [
            self.weights @ p.fringe.turned(p.dispersion * lead, p.dispersion * cross)
            for p in pictures(self.sensor.polariscope)
        ]
        return camera_optics.on_sensor(self.sensor, together(self.sensor.polariscope, seen))

    def expose(
        self, forces: ArrayLike, rng: camera_optics.Rng = None
    ) -> NDArray[np.unsignedinteger]:
        """Frames of the averaged light, equation (13); arguments as for `SensorModel.expose`."""
        lighting = camera_optics.designed_lighting(self.sensor)
        noise = camera_optics.by_channel(self.sensor, self.sensor.noise)
        seen = self.intensity(forces)
        return camera_optics.expose(self.sensor.camera, seen, rng, lighting, noise=noise)


def strip_width(
    sensor: Sensor,
    mesh: Grading = STRIP,
    progress: Progress | None = None,
    places: tuple[Array, Array] | None = None,
) -> StripWidth:
    """Solve the strip in three dimensions, whatever its design says of a plane.

    Parameters
    ----------
    sensor : Sensor
        The design; its camera says where the line lies and how wide it is.
    mesh : Grading
        Sizes of the elements.
    progress : callable, optional
        Told words, the steps done and their count.
    places : (ndarray, ndarray), optional
        Places across the strip [m] and their weights in place of the camera's line.
    """
    strip = sensor.transducer
    y, weights = camera_line(sensor.camera) if places is None else places
    found = strip_integral(strip, sensor.tactels.positions, y, mesh, progress)
    constant = stress_optic_constant(strip.photoelastic, sensor.polariscope.wavelength)
    return StripWidth(
        sensor,
        found.breaks,
        y,
        weights,
        lead=phase_lead(found.difference, constant),
        cross=phase_lead(2 * found.shear, constant),
        unknowns=found.unknowns,
        order=found.order,
    )


def light_line(
    transducer: Transducer, camera: Camera, like: Transducer | None = None, mesh: Grading = STRIP
) -> LightLine | None:
    """What the camera's line sees of a strip that is solved in three dimensions, else none.

    Parameters
    ----------
    transducer : Transducer
        The strip.
    camera : Camera
        Where its line lies.
    like, mesh
        As of `LightLine`.
    """
    return LightLine(*camera_line(camera), like, mesh) if transducer.plane == "3d" else None


def camera_line(camera: Camera, points: int = GAUSS_POINTS) -> tuple[Array, Array]:
    """Gauss points over what the camera's line covers [m], and their weights, which sum up to one.

    A narrow line has a single one.
    """
    middle = camera.line_position or 0.0
    if camera.line_width is None:
        return np.array([middle]), np.ones(1)
    nodes, weights = np.polynomial.legendre.leggauss(points)
    return middle + camera.line_width / 2 * nodes, weights / 2
