"""Contacts anywhere on a strip: what each does to the phase, and a frame's model of several.

A contact has a force, a place, a half width and a shape.  On its half width a its tractions are

    p = 2 N / (pi a) sqrt(1 - t^2) (1 + sum_k c_k U_k(t)),    t = (x - place) / a,

and likewise of the shear force, with Chebyshev's polynomials U_k of the second kind: the first term
is Hertz's pressure (K. L. Johnson, Contact Mechanics, 1985, section 4.2), the others are what real
contacts add: friction, partial slip, edges, a cover that is thin beside the contact.  U_1 of the
pressure is left out, for the place is as good.  So is the width for U_2 of narrow contacts, but not
beneath covers that a contact is wider than.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline

from fringeforce.base.arrays import Array, Mask
from fringeforce.design.strip import Sensor
from fringeforce.estimation.binning import binned
from fringeforce.estimation.frame_exposure import node_phase
from fringeforce.estimation.frame_loss import Prior
from fringeforce.estimation.frame_model import FrameModel, Layout
from fringeforce.mechanics.finite_strain import FiniteStrip
from fringeforce.mechanics.surface_loads import SurfaceLoad
from fringeforce.models.creep import Crept
from fringeforce.models.finite_strain import SkinStrain
from fringeforce.models.node_splines import coefficients
from fringeforce.models.skin_influence import (
    DEGREE,
    FIRST_SHAPE,
    GEOMETRY,
    PLACE,
    PRESSURE,
    SECOND,
    SHEAR,
    WIDTH,
    fill_contacts,
)
from fringeforce.models.skin_modes import SkinModes
from fringeforce.models.uncertainty import Uncertainty

SHAPES = np.array([-0.05, 0.0, 0.0, 0.0, 0.5, 0.0, 0.1])
"""Means of the coefficients c_k, pressure first."""
SHAPE_STDS = np.array([0.1, 0.03, 0.12, 0.05, 0.35, 0.06, 0.25])
"""Their standard deviations.  Under rigid cylinders of 1 to 10 mm with friction, on half widths of
their own, the pressure has c_2 = -0.01, -0.04, -0.09 and -0.14 at half widths of 0.3, 1, 2 and 3
covers, within 0.02, c_3 = 0 within 0.03, and c_4 = -0.01 within 0.01; the shear has c_1 = 0 within
0.03, c_2 = 0.5 within 0.25, c_3 = 0 within 0.05, c_4 = 0.15 within 0.3, and c_6 = 0.05 within 0.25,
which the cover hides (`benchmarks/contact_shapes.py`).  A uniform pressure has c_2 = 1/3 and
c_4 = 1/5, but c_2 = 0 and c_4 = -0.2 on half widths 1.15 times as large; c_4 of a soft finger is
0.15."""
LEAST_SPREAD = -0.45
"""Least coefficient of degree 2 of a pressure; it is -0.43 on a cover that is incompressible and
thin beside the contact, where pressure goes as (1 - t^2)^2."""
QUADRATURE = 24
"""Line loads that stand for a traction; exact for polynomials of degree 47 in the influence, so
that the phase of contacts of any width is within 3e-4 rad/N."""
FINE_QUADRATURE = 100
"""The same for the nodal forces of elements, over several of which a contact may reach; one more is
a prime, so that none lies at a half or a quarter of the width, where elements meet."""
HALF_WIDTH = 0.5, 0.5
"""Mean and standard deviation of half widths, in thicknesses of the cover."""
NARROWEST, WIDEST = 0.02, 5.0
"""Limits of half widths, in thicknesses of the cover."""
LOADS = 4.0
"""Standard deviation of the force of a contact over the push that the pace of the fringes tells."""
YIELDING = 0.02
"""Share of that push by which a contact may miss the friction cone at one standard deviation."""
MESH = 0.02
"""Standard deviation of what large strain adds to the phase, over that: what its elements miss."""
Spread = Callable[[Array], tuple[NDArray[Any], NDArray[Any]]]
"""Loads (..., n) that stand for unit forces at places (...), and their slopes [1/m]."""
_ONE = np.eye(1)


class Contacts(NamedTuple):
    """Several contacts.

    Attributes
    ----------
    forces : ndarray, shape (k, 2)
        Normal and tangential [N].
    geometry : ndarray, shape (k, GEOMETRY)
        Place and half width [m], and coefficients of the shapes.
    """

    forces: Array
    geometry: Array

    def sorted(self) -> Contacts:
        """The same from left to right."""
        order = np.argsort(self.geometry[:, PLACE])
        return Contacts(self.forces[order], self.geometry[order])


@dataclass(frozen=True, eq=False)
class SkinModel:
    """What contacts anywhere on a strip do, with all that is uncertain about it.

    Attributes
    ----------
    uncertain : Uncertainty
        Of the strip, whose tactels are line loads all over the skin.
    places : ndarray, shape (n,)
        Of the line loads, evenly spaced [m].
    cover : float
        Thickness of the cover [m].
    friction : float
        Largest |tangential| / normal force.
    half : float
        Half the length of the skin, on which the middles of contacts lie; line loads may go on
        beyond it [m].
    strain : SkinStrain, optional
        What large strain adds, at the nodes; none where strain is small.
    as_seen : bool
        Whether places among the unknowns are those where the camera sees contacts; on the strip if
        not.
    """

    uncertain: Uncertainty
    places: Array
    cover: float
    friction: float
    half: float
    strain: SkinStrain | None = None
    as_seen: bool = True

    @cached_property
    def linear(self) -> SkinModel:
        """The same of small strain."""
        return self if self.strain is None else replace(self, strain=None)

    @cached_property
    def plain(self) -> SkinModel:
        """The same of small strain, whose influence is as drawn."""
        frame = self.uncertain.frame
        certain = frame._replace(influence=frame.influence[:0])
        return replace(self.linear, uncertain=replace(self.uncertain, frame=certain))

    @cached_property
    def lines(self) -> Array:
        """Phase at the nodes under line loads, shape (2, n, m) [rad/N]."""
        return np.ascontiguousarray(self.uncertain.frame.moments[:, :, 0].transpose(1, 0, 2))

    def in_bins(self, size: int) -> SkinModel:
        """The same of frames in bins of so many pixels."""
        if size not in self._binned:
            frame = binned(self.uncertain.frame, size)
            self._binned[size] = replace(self, uncertain=replace(self.uncertain, frame=frame))
        return self._binned[size]

    @cached_property
    def _binned(self) -> dict[int, SkinModel]:
        return {1: self}

    @cached_property
    def _unit(self) -> tuple[BSpline, BSpline]:
        spline: BSpline = make_interp_spline(self.places, np.eye(len(self.places)), k=DEGREE)
        return spline, spline.derivative()

    @property
    def narrowest(self) -> float:
        """Smallest half width [m]."""
        return NARROWEST * self.cover

    def limited(self, geometry: Array) -> Array:
        """Geometry with middles on the skin and half widths that make sense.

        Beside the end of the line loads a contact becomes narrower and keeps its place.
        """
        found, least = geometry.copy(), self.narrowest
        last = self.places[-1]
        farthest = min(self.half, last - least)
        place = found[:, PLACE] = np.clip(found[:, PLACE], -farthest, farthest)
        beside = last - np.abs(place)
        most = np.maximum(np.minimum(beside, WIDEST * self.cover), least)
        found[:, WIDTH] = np.clip(np.abs(found[:, WIDTH]), least, most)
        found[:, SECOND] = np.maximum(found[:, SECOND], LEAST_SPREAD)
        return found

    def shares(self, geometry: Array) -> Array:
        """Line loads that act like a unit normal and a unit tangential force of each contact.

        Parameters
        ----------
        geometry : ndarray, shape (k, GEOMETRY)
            Of the contacts.

        Returns
        -------
        ndarray, shape (k, 2, n)
            Shares of the line loads.
        """
        return _divided(geometry, QUADRATURE, self._spread)[0]

    def line_shares(self, places: Array) -> Array:
        """Line loads that act like unit forces at places [m], shape (..., n)."""
        return self._unit[0](places)

    @cached_property
    def _modes(self) -> SkinModes:
        return SkinModes(self.uncertain, self.places, _quadrature(QUADRATURE))

    def _spread(self, places: Array) -> tuple[Array, Array]:
        """Line loads that act like unit forces at places, and their slopes."""
        unit, slope = self._unit
        return unit(places), slope(places)

    def derivatives(self, geometry: Array) -> Array:
        """Change of `shares` with place and half width [1/m] and shapes, (k, GEOMETRY, 2, n)."""
        return _divided(geometry, QUADRATURE, self._spread)[1]

    def units(self, count: int) -> Array:
        """Standard deviations of the geometry of contacts before a frame, shape (k GEOMETRY,)."""
        return np.concatenate([self._deviations] * count)

    @cached_property
    def _deviations(self) -> Array:
        """Of one contact, shape (GEOMETRY,)."""
        return np.array([self.half / np.sqrt(3), HALF_WIDTH[1] * self.cover, *SHAPE_STDS])

    @cached_property
    def drawn(self) -> Array:
        """Geometry of a contact before a frame, shape (GEOMETRY,)."""
        return np.array([0.0, HALF_WIDTH[0] * self.cover, *SHAPES])

    def touched(self, geometry: Array) -> FrameModel:
        """The model of a frame with contacts of a certain geometry in the place of tactels."""
        base, contacts = self.uncertain.frame, Contacts(np.zeros((len(geometry), 2)), geometry)
        moments = self._phases(contacts)[0]
        influence = np.zeros((*base.influence.shape[:2], *moments.shape[:2], moments.shape[3]))
        if influence.size:
            loads = self.shares(geometry)
            for c in range(2):
                influence[:, :, :, c] = loads[:, c] @ base.influence[:, :, :, c]
        more = contacts.forces.size - base.at.loads
        return self._of_contacts(moments, influence, Layout(*(begin + more for begin in base.at)))

    def _phases(self, contacts: Contacts) -> tuple[Array, Array]:
        """Phase at the nodes under unit forces, and its change with the geometry under forces.

        Returns
        -------
        moments : ndarray, shape (k, 2, 1, m)
            Of contacts [rad/N].
        fields : ndarray, shape (k, GEOMETRY, m)
            Per metre of places and half widths, and of shapes [rad].
        """
        count, nodes = len(contacts.forces), self.lines.shape[2]
        moments, fields = np.empty((count, 2, 1, nodes)), np.empty((count, GEOMETRY, nodes))
        t, weights = _quadrature(QUADRATURE)
        forces, geometry = (np.ascontiguousarray(part, dtype=float) for part in contacts)
        fill_contacts(*self._modes.spline, t, weights, forces, geometry, moments, fields)
        return moments, fields

    def _strained(
        self, strain: SkinStrain, contacts: Contacts, moments: Array, changes: Array
    ) -> tuple[Array, Array, Array, Array]:
        """The same of large strain, its phase beyond these, and what large strain adds to it.

        Returns
        -------
        moments, changes : ndarray
            As of `_phases`.
        left : ndarray, shape (m,)
            Phase beyond that of unit forces times the forces [rad].
        added : ndarray, shape (1, m)
            Phase by large strain [rad].
        """
        forces, geometry = contacts
        count, size = len(forces), changes.shape[2]
        strip = strain.strip(geometry[:, PLACE], 2 * geometry[:, WIDTH])

        def turned(moved: Array) -> Array:
            unit, change = _divided(geometry, FINE_QUADRATURE, partial(strip.spread, moved=moved))
            by_geometry = change * forces[:, None, :, None]
            pulls = (-1j * unit[:, 0], unit[:, 1])  # into the surface and along it, x + i z
            bent = by_geometry[:, :, 1] - 1j * by_geometry[:, :, 0]
            pulled = np.concatenate(
                [np.stack(pulls, axis=1).reshape(2 * count, -1), bent.reshape(count * GEOMETRY, -1)]
            )
            return np.stack([pulled.real, pulled.imag], axis=1)

        added, slopes = strain.added(strip, _pressing(strip, contacts), turned)
        by_force, by_geometry = slopes[: 2 * count], slopes[2 * count :]
        return (
            moments + by_force.reshape(moments.shape),
            changes + by_geometry.reshape(count, GEOMETRY, size),
            added - forces.ravel() @ by_force,
            added[None],
        )

    def _of_contacts(self, moments: Array, influence: Array, at: Layout) -> FrameModel:
        """The model of a frame with contacts in the place of tactels."""
        return self.uncertain.frame._replace(
            moments=moments,
            profiles=moments,
            mixing=_ONE,
            influence=influence,
            moving=np.empty((0, len(moments))),
            origin=np.empty(0),
            drawn=np.empty(0),
            scaling=np.empty(0),
            at=at,
        )

    def frame(
        self,
        contacts: Contacts,
        beyond: Array | float = 0.0,
        crept: Crept | None = None,
        others: Array | None = None,
    ) -> tuple[FrameModel, Array]:
        """The model of a frame, linear about contacts and others, and their unknowns.

        Its tactels are the contacts, and its first fields what a standard deviation of each value
        of their geometry changes.

        Parameters
        ----------
        contacts : Contacts
            About whose geometry it is linear.
        beyond : ndarray, shape (m,), optional
            Phase beyond that of small strain, where this model is of small strain [rad].
        crept : Crept, optional
            What creep of earlier loads adds.
        others : ndarray, optional
            The last unknowns, after those of the contacts; zero if not given.

        Returns
        -------
        model : FrameModel
            Of k contacts.
        unknowns : ndarray, shape (size,)
            Those of the contacts and the others.
        """
        count = len(contacts.forces)
        moments, changes = self._phases(contacts)
        left, bent = beyond, changes[0, :0]
        if self.strain is not None:
            moments, changes, left, bent = self._strained(self.strain, contacts, moments, changes)
        doubts = MESH * bent
        if crept is not None:
            left, doubts = left + crept.left, np.concatenate([doubts, crept.modes])
        drawn, units = self.uncertain.frame, self.units(count)
        contacting = 2 * count - drawn.at.loads
        more = contacting + len(units) + len(doubts)
        at = Layout(*(b + contacting for b in drawn.at[:4]), *(b + more for b in drawn.at[4:]))
        unknowns = np.zeros(at.size)
        unknowns[: at.loads] = contacts.forces.ravel()
        if others is not None:
            unknowns[at.size - len(others) :] = others
        geometry, modes = contacts.geometry.copy(), unknowns[at.modes :][: len(drawn.influence)]
        influence = np.zeros((0, 1, count, 2, len(drawn.fixed)))
        if len(modes):
            turned = self._modes.turned(*contacts, modes, changes, self.as_seen)
            moments, changes = moments + turned.moments[:, :, None], turned.changes
            influence = turned.influence
            if self.as_seen:
                geometry[:, PLACE] = self._modes.seen(geometry[:, PLACE], modes)
        known = (geometry - self.drawn).ravel() / units
        unknowns[at.fields : at.fields + len(units)] = known
        fields = changes.reshape(len(units), -1) * units[:, None]
        frame = self._of_contacts(moments, influence, at)._replace(
            origin=modes,
            fields=np.concatenate([fields, doubts, drawn.fields]),
            fixed=drawn.fixed + left - known @ fields,
        )
        return frame, unknowns

    def crept_on(self, model: FrameModel, before: Crept, now: Crept) -> FrameModel:
        """The model of a frame of small strain, as of `frame`, with other creep than it had."""
        fields, first = model.fields.copy(), model.at.loads // 2 * GEOMETRY
        fields[first : first + len(now.modes)] = now.modes
        return model._replace(fixed=model.fixed + now.left - before.left, fields=fields)

    def phase_of_lines(self, forces: Array) -> Array:
        """Phase at the nodes that forces of line loads (n, 2) cause, shape (m,) [rad]."""
        return np.asarray(np.tensordot(forces.T, self.lines, 2))

    def phase(self, contacts: Contacts) -> Array:
        """Phase at the nodes that contacts cause, shape (m,) [rad]."""
        return node_phase(*self.frame(contacts)) - self.uncertain.frame.fixed

    def strained(self, contacts: Contacts) -> Array:
        """What large strain adds to that, shape (m,) [rad]; as of `SkinStrain.added`."""
        if self.strain is None:
            return np.zeros(self.lines.shape[2])
        geometry = contacts.geometry
        strip = self.strain.strip(geometry[:, PLACE], 2 * geometry[:, WIDTH])
        return self.strain.added(strip, _pressing(strip, contacts))[0]

    def contacts(self, model: FrameModel, unknowns: Array) -> Contacts:
        """Contacts of unknowns, to first order as of `frame`."""
        at, count = model.at, model.at.loads // 2
        standard = unknowns[at.fields : at.fields + count * GEOMETRY]
        geometry = (standard * self.units(count)).reshape(count, GEOMETRY) + self.drawn
        if self.as_seen and len(model.influence):
            modes = unknowns[at.modes : at.modes + len(model.influence)]
            geometry[:, PLACE] = self._modes.on_strip(geometry[:, PLACE], modes)
        return Contacts(unknowns[: at.loads].reshape(count, 2), self.limited(geometry))

    def slopes(self, model: FrameModel, unknowns: Array) -> Array:
        """Derivatives of forces and geometry by unknowns, shape (k, 2 + GEOMETRY, size).

        Parameters
        ----------
        model : FrameModel
            As of `frame`.
        unknowns : ndarray, shape (size,)
            Where.
        """
        at, count, size = model.at, model.at.loads // 2, model.at.size
        found = np.zeros((count, 2 + GEOMETRY, size))
        found[:, :2, : at.loads] = np.eye(at.loads).reshape(count, 2, at.loads)
        own = slice(at.fields, at.fields + count * GEOMETRY)
        found[:, 2:, own] = np.diag(self.units(count)).reshape(count, GEOMETRY, -1)
        if self.as_seen and len(model.influence):
            turning = slice(at.modes, at.modes + len(model.influence))
            places, stretch = found[:, 2 + PLACE], self._modes.stretch(unknowns[turning])
            places[:, turning] = -self._modes.rates(
                self.contacts(model, unknowns).geometry[:, PLACE]
            ).T
            places /= stretch
        return found

    def prior(self, model: FrameModel, push: float) -> Prior:
        """What is known of the unknowns of contacts that push with about this force [N]."""
        precision = np.ones(model.at.size)
        precision[: model.at.loads : 2] = 1 / np.square(LOADS * push)
        precision[1 : model.at.loads : 2] = 1 / np.square(self.friction * LOADS * push)
        return Prior(np.zeros(model.at.size), precision, self.friction, YIELDING * push)


def large_strain(sensor: Sensor, uncertain: Uncertainty) -> SkinStrain | None:
    """What large strain adds at the nodes of a skin; none where its strain is small."""
    if sensor.transducer.strain != "finite":
        return None
    shown = partial(_at_nodes, shown=uncertain.shown, nodes=len(uncertain.frame.fixed))
    return SkinStrain(sensor, uncertain.places, shown)


def _at_nodes(phases: Array, shown: Mask, nodes: int) -> Array:
    return coefficients(phases * shown, nodes)


@cache
def _quadrature(count: int) -> tuple[Array, Array]:
    """Places within the half width, and weights of all shapes there, shape (Q, 1 + shapes)."""
    angle = np.pi * np.arange(1, count + 1) / (count + 1)
    t, weights = np.cos(angle), 2 / (count + 1) * np.square(np.sin(angle))
    shapes = [np.sin((k + 1) * angle) / np.sin(angle) for k in (*PRESSURE, *SHEAR)]
    return t, weights[:, None] * np.column_stack([np.ones(count), *shapes])


def _pressing(strip: FiniteStrip, contacts: Contacts) -> SurfaceLoad:
    """Contacts as the strip takes them."""
    where, profile = _profiles(contacts.geometry, FINE_QUADRATURE)
    forces = contacts.forces[:, :, None] * profile
    return strip.pressed(where.ravel(), forces.transpose(0, 2, 1).reshape(-1, 2))


def variances(geometry: Array) -> Array:
    """Variances of the places of the pressure in contacts of a geometry, shape (...) [m^2]."""
    return np.asarray(np.square(geometry[..., WIDTH]) * (1 + geometry[..., SECOND]) / 4)


def _profiles(geometry: Array, count: int) -> tuple[Array, Array]:
    """Places of small forces in contacts, shape (k, Q), and their shares, shape (k, 2, Q)."""
    t, weights = _quadrature(count)
    where = geometry[:, PLACE, None] + geometry[:, WIDTH, None] * t
    shapes, pressed = geometry[:, FIRST_SHAPE:], len(PRESSURE)
    parts = (
        weights[:, 0] + shapes[:, :pressed] @ weights[:, 1 : 1 + pressed].T,
        weights[:, 0] + shapes[:, pressed:] @ weights[:, 1 + pressed :].T,
    )
    return where, np.stack(parts, axis=1)


def _divided(geometry: Array, count: int, spread: Spread) -> tuple[NDArray[Any], NDArray[Any]]:
    """Contacts of unit forces as loads that stand for forces at any place, and their changes.

    Parameters
    ----------
    geometry : ndarray, shape (k, GEOMETRY)
        Of the contacts.
    count : int
        Small forces in each contact.
    spread : callable
        What loads stand for forces.

    Returns
    -------
    shares : ndarray, shape (k, 2, n)
        Of a unit normal and a unit tangential force.
    change : ndarray, shape (k, GEOMETRY, 2, n)
        With place and half width [1/m] and shapes.
    """
    t, weights = _quadrature(count)
    where, profile = _profiles(geometry, count)
    pressed, (own, rising) = len(PRESSURE), spread(where)
    normal = FIRST_SHAPE + pressed
    change = np.zeros((len(geometry), GEOMETRY, 2, own.shape[-1]), own.dtype)
    change[:, PLACE] = profile @ rising
    change[:, WIDTH] = (profile * t) @ rising
    bent = weights[:, 1:].T @ own
    change[:, FIRST_SHAPE:normal, 0] = bent[:, :pressed]
    change[:, normal:, 1] = bent[:, pressed:]
    return profile @ own, change
