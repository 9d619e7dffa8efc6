"""The light of a strip under large strain, and its second order in the forces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, Literal

import numpy as np
from scipy.interpolate import CubicSpline

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.contacts.press import Press, Tractions
from fringeforce.design.strip import Sensor, Transducer
from fringeforce.mechanics.finite_strain import ORDER, Changes, FiniteStrip, finite_strip
from fringeforce.mechanics.second_order import STEEP, expansion, resolved_share
from fringeforce.mechanics.surface_loads import SurfaceLoad, Together
from fringeforce.models.presses import press_phase, tractions
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant

Strain = Literal["linear", "finite"]
"""Whether the strain of a strip is small, or calculated as it is."""
ELEMENT_ORDER = 4
"""Order of the elements that give the second order, itself a small part of the phase."""
SHARE = 0.25
"""Largest element beside the ends of a contact on a skin, over its width: half of it, and two
orders more, change what strain adds to the light by 0.3 % of it at most."""
KEPT_MESHES = 8
"""Meshes of contacts that are kept, with what is factorised without load: searches come back."""
SHEARING = 0.8
"""Part of a shear that folds the surface like a pressure: a shear of half the pressure folds it at
0.6 to 0.7 of the pressure alone."""
RUNGS = 2
"""Widths in a factor of two for which elements are chosen, each for what is up to 1.41 times as
wide and asks for no finer ones."""


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
    alone = sensor.skin is None
    return _strip(sensor.transducer.model_dump_json(), places, float(width), order, alone)


@lru_cache(maxsize=8)
def _strip(
    stated: str, places: tuple[float, ...], width: float, order: int, alone: bool
) -> FiniteStrip:
    transducer, widths = Transducer.model_validate_json(stated), np.full(len(places), width)
    # a traction goes on beyond the ends of line loads side by side
    share = resolved_share(transducer, width, order) if alone else np.inf
    return finite_strip(transducer, places, widths, order=order, share=share, growth=STEEP)


def share_of_contacts(sensor: Sensor, widths: Array) -> float:
    """Elements beside the ends of contacts, over their width: `SHARE` on a skin.

    On tactels those that the light of the narrowest asks for, as of `resolved_share`; of a ladder
    of widths, for widths that are found change a little in every step.

    Parameters
    ----------
    sensor : Sensor
        The drawing.
    widths : ndarray, shape (k,)
        Of the contacts [m].
    """
    if sensor.skin is not None:
        return SHARE
    rung = np.floor(RUNGS * np.log2(widths.min()))
    return _share(sensor.transducer.model_dump_json(), float(2 ** (rung / RUNGS)))


@lru_cache(maxsize=64)
def _share(stated: str, width: float) -> float:
    return resolved_share(Transducer.model_validate_json(stated), width, ELEMENT_ORDER)


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
    found = _of_frames(lambda one: phase_of(sensor, strip, x, strip.solved(one)), list(loads))
    return found.reshape(*forces.shape[:-2], len(x))


def _of_frames(phase: Callable[[Any], Array], frames: Sequence[Any]) -> Array:
    """Phases of frames, shape (F, m) [rad]; what one of several cannot bear names the frame."""
    found = list[Array]()
    for number, one in enumerate(frames):
        try:
            found.append(phase(one))
        except InputError as error:
            if len(frames) == 1:
                raise
            raise InputError(f"Frame {number} (the first is 0): {error}") from error
    return np.array(found)


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
    return phase_lead(strip.light.integrated_stress(moved, x), constant)


def _at(sensor: Sensor, strip: FiniteStrip, x: Array, stress: Array) -> Array:
    """Phase lead at places of a stress at the stations, shape (m, ...) [rad]; 0 off the strip."""
    constant = stress_optic_constant(sensor.transducer.photoelastic, sensor.polariscope.wavelength)
    half = sensor.transducer.length / 2
    inside = (np.abs(x) <= half).reshape(-1, *[1] * (stress.ndim - 1))
    smooth = CubicSpline(strip.mesh.stations, stress)
    return phase_lead(smooth(np.clip(x, -half, half)) * inside, constant)


def added_phase(sensor: Sensor, strip: FiniteStrip, x: Array, forces: Array) -> Array:
    """What large strain adds to the phase of small strain on the same elements, shape (m,) [rad].

    Parameters
    ----------
    sensor : Sensor
        The strip.
    strip : FiniteStrip
        Its elements.
    x : ndarray, shape (m,)
        Positions along it [m].
    forces : ndarray, shape (n, 2)
        Of the patches [N].

    Raises
    ------
    InputError
        If the strip has no stable state under the forces.
    """
    return _at(sensor, strip, x, strip.beside_linear(strip.load(forces))[0])


def strain_phase(sensor: Sensor, x: Array, forces: Array) -> Array:
    """What large strain adds to the phase under forces on tactels; parameters as `finite_phase`."""
    strip = strip_of_tactels(sensor)
    loads = forces.reshape(-1, *forces.shape[-2:])
    found = _of_frames(lambda one: added_phase(sensor, strip, x, one), list(loads))
    return found.reshape(*forces.shape[:-2], len(x))


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
    strip = strip_of_tactels(sensor, ELEMENT_ORDER)
    return _at(sensor, strip, x, expansion(strip).second)


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
    strip = strip_of_tactels(sensor, ELEMENT_ORDER)
    return _at(sensor, strip, x, expansion(strip).rest(forces))


@dataclass(frozen=True, eq=False)
class SkinStrain:
    """What large strain adds to the light of contacts anywhere on a skin.

    Elements follow the contacts: theirs is the strain that they must resolve.

    Attributes
    ----------
    sensor : Sensor
        The strip.
    places : ndarray, shape (s,)
        Where light is wanted [m]; none beyond the strip.
    shown : callable
        What is told of phases there, shape (k, s), as an array (k, m); linear.
    """

    sensor: Sensor
    places: Array
    shown: Callable[[Array], Array] = field(default_factory=lambda: np.asarray)

    def strip(self, centres: Array, widths: Array) -> FiniteStrip:
        """The strip on elements for contacts, shape (n,) [m].

        Raises
        ------
        InputError
            If a contact has no width or reaches beyond the strip.
        """
        key = np.concatenate([centres, widths]).tobytes()
        if key not in self._strips:
            while len(self._strips) >= KEPT_MESHES:
                del self._strips[next(iter(self._strips))]
            self._strips[key] = finite_strip(
                self.sensor.transducer, centres, widths, order=ELEMENT_ORDER, share=SHARE
            )
        return self._strips[key]

    @cached_property
    def _strips(self) -> dict[bytes, FiniteStrip]:
        return {}

    def added(
        self, strip: FiniteStrip, load: SurfaceLoad, changes: Changes | None = None
    ) -> tuple[Array, Array]:
        """What it adds to the phase, shape (m,), and how that changes, shape (k, m) [rad].

        Parameters
        ----------
        strip : FiniteStrip
            As of `strip`.
        load : SurfaceLoad
            On it.
        changes : callable, optional
            Changes of the load, as of `FiniteStrip.beside_linear`.

        Raises
        ------
        InputError
            If the strip has no stable state under the load.
        """
        stress, slopes = strip.beside_linear(load, changes)
        both = np.concatenate([stress[:, None], slopes], axis=1)
        phases = self.shown(_at(self.sensor, strip, self.places, both).T)
        return phases[0], phases[1:]

    def squash(self, forces: Array, widths: Array) -> Array:
        """Mean pressure of contacts over the modulus of the cover, shape (n,).

        With `SHEARING` times the shear, which folds the surface as well.

        Parameters
        ----------
        forces : ndarray, shape (n, 2)
            Normal and tangential [N].
        widths : ndarray, shape (n,)
            Of the contacts [m].
        """
        normal, tangential = np.abs(forces).T
        transducer = self.sensor.transducer
        stiffness = widths * transducer.width * transducer.compliant.youngs_modulus
        return np.asarray((normal + SHEARING * tangential) / stiffness, dtype=float)

    def under(self, acting: Sequence[Tractions]) -> Array:
        """What it adds to the phase under tractions, shape (m,) [rad]; as of `added`."""
        centres, widths = _extents(acting)
        strip = self.strip(centres, widths)
        return self.added(strip, _pressing(strip, acting))[0]


def _extents(acting: Sequence[Tractions]) -> tuple[Array, Array]:
    """Middles and widths of tractions [m]."""
    ends = np.array([one.ends for one in acting]).reshape(-1, 2)
    return ends.mean(axis=1), np.diff(ends, axis=1)[:, 0]


def _pressing(strip: FiniteStrip, acting: Sequence[Tractions]) -> SurfaceLoad:
    """Tractions as the strip takes them."""
    places = np.concatenate([np.zeros(0), *(one.places for one in acting)])
    forces = np.concatenate([np.zeros((0, 2)), *(one.forces for one in acting)])
    return strip.pressed(places, forces)


def finite_press_phase(sensor: Sensor, x: Array, presses: Sequence[Any]) -> Array:
    """Phase lead under presses, of one frame or of several, shape (..., m) [rad].

    That of small strain, and what large strain adds on elements for the contacts.
    """
    if len(presses) and not isinstance(presses[0], Press):
        return _of_frames(lambda one: finite_press_phase(sensor, x, one), presses)
    if not len(presses):
        return np.zeros(len(x))
    acting = [tractions(sensor, press) for press in presses]
    strip = finite_strip(sensor.transducer, *_extents(acting), share=SHARE)
    load = _pressing(strip, acting)
    if sensor.skin is None and sensor.transducer.loads == "follower":
        # an even traction is the patch of a tactel, whose chord it follows
        patched = np.array([_is_even(press) for press in presses])
        forces = np.array([one.forces.sum(axis=0) for one in acting]) * patched[:, None]
        small = [one for one, even in zip(acting, patched, strict=True) if not even]
        load = Together((strip.load(forces), _pressing(strip, small)))
    added = _at(sensor, strip, x, strip.beside_linear(load, exact=True)[0])
    return press_phase(sensor, x, presses) + added


def _is_even(press: Press) -> bool:
    """Whether the traction of a press is uniform."""
    return press.profile == "flat" and press.radius is None and press.width is not None
