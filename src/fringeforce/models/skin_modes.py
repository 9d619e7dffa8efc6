"""What modes of the influence matrix change in contacts anywhere on a strip.

A camera that looks elsewhere sees a contact elsewhere, and with it what other values change in its
phase.  So nearly all that its shift changes is as if the contact were moved, and the place where a
contact is seen is known much better than its place on the strip.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline

from fringeforce.base.arrays import Array, Index
from fringeforce.models.line_moments import REGISTRATION
from fringeforce.models.skin_influence import DEGREE, PLACE, fill_shares
from fringeforce.models.uncertainty import Uncertainty


class Turned(NamedTuple):
    """Contacts under some modes, to first order in these.

    Attributes
    ----------
    moments : ndarray, shape (k, 2, m)
        What is added to the phase under unit forces [rad/N].
    changes : ndarray, shape (k, g, m)
        Change of the phase under the forces with the geometry.
    influence : ndarray, shape (d, 1, k, 2, m)
        As of `FrameModel`.
    """

    moments: Array
    changes: Array
    influence: Array


class _Group(NamedTuple):
    """Modes of one kind.

    Attributes
    ----------
    modes, powers : ndarray of int, shape (s,)
        Numbers of the modes, and powers of them.
    lines : ndarray, shape (2, s, n, m)
        Coefficients over the place of line loads of what these change in their influence [rad/N].
    """

    modes: Index
    powers: Index
    lines: Array

    def weights(self, modes: Array) -> Array:
        """What the rows count in what values of the modes change, and with each, (1 + d, s)."""
        own = modes[self.modes]
        found = np.zeros((1 + len(modes), len(own)))
        found[0] = own**self.powers
        found[1 + self.modes, np.arange(len(own))] = self.powers * own ** (self.powers - 1)
        return found


@dataclass(frozen=True, eq=False)
class SkinModes:
    """Modes of the influence matrix of one skin.

    Attributes
    ----------
    uncertain : Uncertainty
        Of the strip.
    places : ndarray, shape (n,)
        Of its line loads [m].
    quadrature : (ndarray, ndarray)
        As `t` and `weights` of `fill_contacts`.
    """

    uncertain: Uncertainty
    places: Array
    quadrature: tuple[Array, Array]

    @cached_property
    def spline(self) -> tuple[Array, Array]:
        """Knots, and coefficients of the influence over places, shape (n, 2, m) [rad/N]."""
        return self._over_places(self.uncertain.frame.moments[:, :, 0])

    def _over_places(self, lines: Array) -> tuple[Array, Array]:
        spline = make_interp_spline(self.places, lines, k=DEGREE)
        return spline.t, np.ascontiguousarray(spline.c)

    @cached_property
    def _groups(self) -> tuple[_Group, _Group]:
        """Modes of the camera's registration, and all others."""
        shift, scale = self._registration
        looking, influence = (shift != 0) | (scale != 0), self.uncertain.frame.influence
        some, found = influence.any(axis=(2, 3, 4)), list[_Group]()
        for which in (looking, ~looking):
            modes, powers = np.nonzero(some & which[:, None])
            lines = self._over_places(np.moveaxis(influence[modes, powers], 1, 0))[1]
            lines = np.ascontiguousarray(lines.transpose(2, 1, 0, 3))
            found.append(_Group(modes, powers + 1, lines))
        return found[0], found[1]

    @cached_property
    def _registration(self) -> tuple[Array, Array]:
        """How far a deviation moves what is at x in what the camera sees: a + b x, (d,) each."""
        frame, stated = self.uncertain.frame, self.uncertain.matrix.model.sensor.tolerances
        names = [mode.name for mode in self.uncertain.modes[: len(frame.influence)]]
        shift, scale = (
            np.array([-stated[path] if name == path else 0.0 for name in names])
            for path in REGISTRATION
        )
        return shift, scale

    def rates(self, places: Array) -> Array:
        """How far deviations move what is at places in what the camera sees, shape (d, k) [m]."""
        shift, scale = self._registration
        return np.asarray(shift[:, None] + np.outer(scale, places))

    def stretch(self, modes: Array) -> float:
        """Change of a place as it is seen with that on the strip."""
        return float(1 + self._registration[1] @ (modes - self.uncertain.frame.origin))

    def seen(self, places: Array, modes: Array) -> Array:
        """Where the camera sees places on the strip, shape (k,) [m]."""
        return np.asarray(places + (modes - self.uncertain.frame.origin) @ self.rates(places))

    def on_strip(self, places: Array, modes: Array) -> Array:
        """Places on the strip from where the camera sees them, shape (k,) [m]."""
        return (places - self.seen(np.zeros_like(places), modes)) / self.stretch(modes)

    def turned(
        self, forces: Array, geometry: Array, modes: Array, changes: Array, as_seen: bool
    ) -> Turned:
        """Contacts under the modes.

        Parameters
        ----------
        forces, geometry : ndarray, shapes (k, 2) and (k, g)
            Of the contacts.
        modes : ndarray, shape (d,)
            Values of the modes.
        changes : ndarray, shape (k, g, m)
            Change of the phase with the geometry, without modes.
        as_seen : bool
            Whether modes change the phase of contacts that stay where they are seen, rather than on
            the strip; so are the changes with the place.
        """
        rates, stretch = self.rates(geometry[:, PLACE])[:, :, None, None], self.stretch(modes)
        there = geometry.copy()
        there[:, PLACE] = self.seen(geometry[:, PLACE], modes)
        looking, other = self._groups
        here, beside = self._under(looking, geometry, modes), self._under(other, there, modes)
        influence, by_seen = here.influence + beside.influence, beside.changes[:, PLACE].copy()
        beside.changes[:, PLACE] *= stretch
        changes = changes + np.einsum("kc,kgcm->kgm", forces, here.changes + beside.changes)
        if not as_seen:
            influence += rates * by_seen
        elif len(looking.modes):
            by_place = here.changes[:, PLACE] + self._drawn_slopes(geometry)
            influence -= rates / stretch * by_place
            changes[:, PLACE] /= stretch
        moments = here.moments + beside.moments - np.tensordot(modes, influence, 1)
        return Turned(moments, changes, influence[:, None])

    def _under(self, group: _Group, geometry: Array, modes: Array) -> Turned:
        """What modes of a group add under unit forces.

        Returns
        -------
        Turned
            With changes of shape (k, g, 2, m) and influence of shape (d, k, 2, m).
        """
        size = (len(geometry), 2, self.spline[1].shape[-1])
        moments, influence = np.zeros(size), np.zeros((len(modes), *size))
        changes, weights = np.zeros((size[0], geometry.shape[1], *size[1:])), group.weights(modes)
        some = weights.any(axis=0)  # powers beyond the first have none where modes are zero
        for k, (shares, window) in enumerate(self._shares(geometry) if some.any() else ()):
            for c in range(2):
                lines = np.tensordot(weights[:, some], group.lines[c, some, window], 1)
                moments[k, c] = shares[c, 0] @ lines[0]
                influence[:, k, c] = shares[c, 0] @ lines[1:]
                changes[k, :, c] = shares[c, 1:] @ lines[0]
        return Turned(moments, changes, influence)

    def _drawn_slopes(self, geometry: Array) -> Array:
        """Change of the phase of unit forces with the place, without modes, shape (k, 2, m)."""
        lines = self.spline[1]
        return np.array([
            [shares[c, 1 + PLACE] @ lines[window, c] for c in range(2)]
            for shares, window in self._shares(geometry)
        ])  # fmt: skip

    def _shares(self, geometry: Array) -> Iterator[tuple[Array, slice]]:
        """Shares (2, 1 + g, w) of coefficients, as of `fill_shares`, and which they are."""
        count, size = len(geometry), len(self.places)
        shares, ends = np.empty((count, 2, 1 + geometry.shape[1], size)), np.empty((count, 2), int)
        fill_shares(self.spline[0], *self.quadrature, np.ascontiguousarray(geometry), shares, ends)
        for own, (low, high) in zip(shares, ends.tolist(), strict=True):
            yield own[:, :, low:high], slice(low, high)
