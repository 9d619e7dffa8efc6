"""The light of a strip under large strain, and its second order in the forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from scipy.interpolate import CubicSpline

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.contacts.press import Press, Tractions
from fringeforce.design.strip import Sensor, Transducer
from fringeforce.mechanics.finite_strain import ORDER, FiniteStrip, finite_strip
from fringeforce.models.presses import tractions
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

Strain = Literal["linear", "finite"]
"""Whether the strain of a strip is small, or calculated as it is."""
COARSE = 4
"""Order of the elements that give the second order, itself a small part of the phase."""
CELL = 0.8
"""Width of the elements under a skin, in thicknesses of the cover: half of it, and one order more,
change what strain adds to the light by 1.5 % of it at most."""
PATCHES = 8
"""Patches that stand for a press whose pressure is not uniform."""


def checked_strain(strain: str) -> Strain:
    """The kind of strain by its name.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if strain == "linear" or strain == "finite":
        return strain
    raise InputError(f"strain = {strain!r} is no kind of strain; take 'linear' or 'finite'.")


def strip_of_tactels(sensor: Sensor, order: int = ORDER) -> FiniteStrip:
    """The hyperelastic strip with a patch for every tactel of a design, made once.

    Line loads of a skin are as wide as they are apart.
    """
    tactels = sensor.tactels
    places = tuple(float(x) for x in tactels.positions + tactels.placement)
    width = tactels.contact_width if sensor.skin is None else tactels.pitch
    return _strip(sensor.transducer.model_dump_json(), places, float(width), order)


@lru_cache(maxsize=8)
def _strip(stated: str, places: tuple[float, ...], width: float, order: int) -> FiniteStrip:
    transducer = Transducer.model_validate_json(stated)
    return finite_strip(transducer, places, np.full(len(places), width), order=order)


def finite_phase(sensor: Sensor, x: Array, forces: Array) -> Array:
    """Phase lead under forces on the tactels of a design, shape (..., m) [rad].

    Parameters
    ----------
    sensor : Sensor
        The strip, its contacts of some width.
    x : ndarray, shape (m,)
        Positions along it [m].
    forces : ndarray, shape (..., n, 2)
        Of the tactels [N].
    """
    strip = strip_of_tactels(sensor)
    loads = forces.reshape(-1, *forces.shape[-2:])
    found = np.array([phase_of(sensor, strip, x, strip.solved(one)) for one in loads])
    return found.reshape(*forces.shape[:-2], len(x))


def phase_of(sensor: Sensor, strip: FiniteStrip, x: Array, moved: Array) -> Array:
    """Phase lead of a deformed strip, shape (m,) [rad].

    Parameters
    ----------
    sensor : Sensor
        The strip.
    strip : FiniteStrip
        Its elements.
    x : ndarray, shape (m,)
        Positions along it [m].
    moved : ndarray
        Coefficients of the displacements [m].
    """
    constant = stress_optic_constant(sensor.transducer.photoelastic, sensor.polariscope.wavelength)
    return phase_lead(strip.integrated_stress(moved, x), constant)


def _at(sensor: Sensor, strip: FiniteStrip, x: Array, stress: Array) -> Array:
    """Phase lead at places of a stress at the stations, shape (m, ...) [rad]; 0 off the strip."""
    constant = stress_optic_constant(sensor.transducer.photoelastic, sensor.polariscope.wavelength)
    half = sensor.transducer.length / 2
    inside = (np.abs(x) <= half).reshape(-1, *[1] * (stress.ndim - 1))
    smooth = CubicSpline(strip.mesh.stations, stress)
    return phase_lead(smooth(np.clip(x, -half, half)) * inside, constant)


def second_order_influence(sensor: Sensor, x: Array) -> Array:
    """Second order of the phase in the forces, shape (m, 2n, 2n) [rad/N^2].

    The phase is Psi f + f' H f up to third order.

    Parameters
    ----------
    sensor : Sensor
        The strip, its contacts of some width.
    x : ndarray, shape (m,)
        Positions along it [m].
    """
    strip = strip_of_tactels(sensor, COARSE)
    return _at(sensor, strip, x, strip.expansion.second)


def beyond_second_order(sensor: Sensor, x: Array, forces: Array) -> Array:
    """What the second order leaves of the phase under forces, shape (m,) [rad].

    Parameters
    ----------
    sensor : Sensor
        The strip, its contacts of some width.
    x : ndarray, shape (m,)
        Positions along it [m].
    forces : ndarray, shape (n, 2)
        Of the tactels [N].

    Raises
    ------
    InputError
        If the strip has no stable state under the forces.
    """
    strip = strip_of_tactels(sensor, COARSE)
    return _at(sensor, strip, x, strip.expansion.rest(forces))


@dataclass(frozen=True, eq=False)
class SkinStrain:
    """What large strain adds to the light of contacts anywhere on a skin.

    Attributes
    ----------
    strip : FiniteStrip
        With elements of equal width all over the skin.
    shown : ndarray, shape (M, m)
        Phase at some places of a unit stress at each station [rad / (Pa m)].
    """

    strip: FiniteStrip
    shown: Array

    def spread(self, places: Array) -> tuple[Array, Array]:
        """Nodal forces of unit forces at places (...), shape (..., C), and their slopes [1/m]."""
        value, slope = self.strip.surface(places.ravel())
        shape = (*places.shape, -1)
        return value.toarray().reshape(shape), slope.toarray().reshape(shape)

    def added(self, load: Array, changes: Array) -> tuple[Array, Array]:
        """What it adds to the phase, shape (m,), and how that changes, shape (k, m) [rad].

        Parameters
        ----------
        load : ndarray, shape (2, C)
            Normal and tangential nodal forces [N].
        changes : ndarray, shape (k, 2, C)
            Changes of them.

        Raises
        ------
        InputError
            If the strip has no stable state under the load.
        """
        stress, slopes = self.strip.beside_linear(load, changes)
        return stress @ self.shown, slopes.T @ self.shown

    def under(self, acting: Sequence[Tractions]) -> Array:
        """What it adds to the phase under tractions, shape (m,) [rad]; as of `added`."""
        load = np.zeros((2, self.strip.shape[1]))
        for one in acting:
            load += one.forces.T @ self.spread(one.places)[0]
        return self.added(load, np.zeros((0, *load.shape)))[0]


def skin_strain(sensor: Sensor, x: Array) -> SkinStrain:
    """What large strain adds to the light of a skin, at positions x (m,) along it [m]."""
    assert sensor.skin is not None
    transducer, extent = sensor.transducer, sensor.skin.extent
    count = int(np.ceil(extent / (CELL * transducer.compliant.thickness)))
    width = extent / count
    centres = (np.arange(count) - (count - 1) / 2) * width
    strip = finite_strip(transducer, centres, np.full(count, width), order=COARSE)
    return SkinStrain(strip, _at(sensor, strip, x, np.eye(len(strip.mesh.stations))).T)


def finite_press_phase(sensor: Sensor, x: Array, presses: Sequence[Any]) -> Array:
    """Phase lead under presses, of one frame or of several, shape (..., m) [rad]."""
    if len(presses) and not isinstance(presses[0], Press):
        return np.array([finite_press_phase(sensor, x, one) for one in presses])
    if not len(presses):
        return np.zeros(len(x))
    parts = [_patches(sensor, press) for press in presses]
    centres, widths, forces = (np.concatenate(part) for part in zip(*parts, strict=True))
    strip = finite_strip(sensor.transducer, centres, widths)
    return phase_of(sensor, strip, x, strip.solved(forces))


def _patches(sensor: Sensor, press: Press) -> tuple[Array, Array, Array]:
    """Centres and widths of patches [m], and their forces, that together do what a press does."""
    found = tractions(sensor, press)
    if press.profile == "flat" and press.width is not None:
        shear = [[press.normal, press.shear[0]]]
        return np.array([press.x]), np.atleast_1d(press.width).astype(float), np.array(shear)
    order = np.argsort(found.places)
    places, forces = found.places[order], found.forces[order]
    if press.width is None and len(places) > 1:
        reach = (places[[0, -1]] * 3 - places[[1, -2]]) / 2
    else:
        reach = press.x + np.array([-0.5, 0.5]) * np.max(press.width or 0.0)
    step = float(reach[1] - reach[0]) / PATCHES
    if step <= 0:
        raise InputError(
            "A press without a width is a line, under which large strain has no solution; give it "
            "a width or a radius."
        )
    edges = reach[0] + step * np.arange(PATCHES + 1)
    sums = np.cumsum(forces, axis=0) - forces / 2
    ends, sums = (
        np.concatenate([reach[:1], places, reach[1:]]),
        np.concatenate([np.zeros((1, 2)), sums, forces.sum(axis=0)[None]]),
    )
    reached = np.column_stack([np.interp(edges, ends, part) for part in sums.T])
    return edges[:-1] + step / 2, np.full(PATCHES, step), np.diff(reached, axis=0)
