"""What an explanation of a skin's frame amounts to: line loads, contacts, and the total."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array, Index
from fringeforce.contacts.resultant import Resultant
from fringeforce.models.skin import GEOMETRY, PLACE, WIDTH, SkinModel
from fringeforce.reading.reading import Traction
from fringeforce.reading.skin_fit import Explanation

NOTHING = 1e-6
"""Share of the largest line load below which one is none."""


@dataclass(frozen=True, eq=False)
class SkinResult:
    """What is stated of an explanation, computed when it is asked for.

    Attributes
    ----------
    skin : SkinModel
        What contacts do.
    one : Explanation
        The explanation.
    like : SkinResult, optional
        Of an earlier frame, nearly the same, whose covariance is as good.
    """

    skin: SkinModel
    one: Explanation
    like: SkinResult | None = None

    @cached_property
    def values(self) -> Array:
        """Forces and geometry of the contacts, shape (k, 2 + GEOMETRY)."""
        return np.concatenate([self.one.contacts.forces, self.one.contacts.geometry], axis=1)

    @cached_property
    def joint(self) -> Array:
        """Covariance of these, one contact after the other."""
        if self.like is not None:
            return self.like.joint
        at, count = self.one.posterior.model.at, len(self.one.contacts.forces)
        spread = self.one.posterior.spread(self.one.top)
        forces = np.arange(at.loads).reshape(count, 2)
        geometry = at.fields + np.arange(count * GEOMETRY).reshape(count, GEOMETRY)
        own = np.concatenate([forces, geometry], axis=1).ravel()
        units = np.concatenate([np.ones((count, 2)), self.skin.units(count).reshape(count, -1)], 1)
        return np.asarray(spread[np.ix_(own, own)] * np.outer(units, units))

    @property
    def forces(self) -> Array:
        """Forces of the line loads, shape (n, 2) [N]."""
        shares = self.skin.shares(self.one.contacts.geometry)
        found = (shares * self.one.contacts.forces[:, :, None]).sum(axis=0).T
        # the spline of line loads dies away, and never ends
        return np.where(np.abs(found) > NOTHING * np.abs(found).max(), found, 0.0)

    @cached_property
    def _rows(self) -> Array:
        """Derivatives of the line loads by the values, shape (k (2 + GEOMETRY), 2n)."""
        geometry = self.one.contacts.geometry
        loads, change = self.skin.shares(geometry), self.skin.derivatives(geometry)
        count, size = self.values.shape
        rows = np.zeros((count, size, len(self.skin.places), 2))
        rows[:, 0, :, 0], rows[:, 1, :, 1] = loads[:, 0], loads[:, 1]
        moved = change * self.one.contacts.forces[:, None, :, None]
        rows[:, 2:] = moved.transpose(0, 1, 3, 2)
        return rows.reshape(count * size, -1)

    def covariance(self) -> Array:
        """Covariance of the line loads, shape (2n, 2n) [N^2]."""
        return self._rows.T @ self.joint @ self._rows

    @cached_property
    def _std(self) -> Array:
        if self.like is not None:
            return self.like._std
        variance = np.einsum("rn,rn->n", self._rows, self.joint @ self._rows)
        return np.sqrt(np.maximum(variance, 0)).reshape(-1, 2)

    def std(self) -> Array:
        """Deviations of the line loads, shape (n, 2) [N]."""
        return self._std

    def traction(self, width: float) -> Traction:
        """Pressure and shear along a strip of some width [m]."""
        places = self.skin.places
        area = (places[1] - places[0]) * width
        return Traction(places, self.forces / area, self._std / area)

    def contacts(self) -> tuple[Resultant, ...]:
        """Single contacts, the strongest first."""
        count = len(self.one.contacts.forces)
        found = [self._resultant(np.arange(k, k + 1)) for k in range(count)]
        return tuple(sorted(found, key=lambda one: -one.force[0]))

    def total(self) -> Resultant:
        """Everything together."""
        return self._resultant(np.arange(len(self.one.contacts.forces)))

    def _resultant(self, which: Index) -> Resultant:
        joint, values = self.joint, self.values
        size = values.shape[1]
        forces, place, half = values[which, :2], values[which, 2 + PLACE], values[which, 2 + WIDTH]
        force = forces.sum(axis=0)
        moment = np.array([0.0, forces[:, 0] @ place, 0.0])
        # of the sum: one contact is where it is, however little it presses
        push, shares = force[0], np.ones(len(which))
        if len(which) > 1:
            shares = forces[:, 0] / push if push > 0 else np.full(len(which), np.nan)
        centre = shares @ place
        square = np.square(half) / 4 + np.square(place - centre)
        variance = shares @ square
        width = 4 * np.sqrt(variance) if variance > 0 else np.nan
        rows = np.zeros((7, len(values), size))
        rows[0, which, 0] = rows[1, which, 1] = 1
        rows[3, which, 0], rows[3, which, 2 + PLACE] = place, forces[:, 0]
        slope = 8 / width
        if len(which) > 1:
            rows[5, which, 0] = (place - centre) / push
            rows[6, which, 0] = slope * (square - variance) / push
        rows[5, which, 2 + PLACE] = shares
        rows[6, which, 2 + PLACE] = slope * 2 * shares * (place - centre)
        rows[6, which, 2 + WIDTH] = slope * shares * half / 2
        flat = rows.reshape(7, -1)
        lines = self.skin.places
        reach = np.maximum(half, (lines[1] - lines[0]) / 2)
        near = np.abs(lines - place[:, None]) <= reach[:, None]
        return Resultant(
            np.flatnonzero(near.any(axis=0)),
            force,
            moment,
            np.array([centre]),
            flat @ joint @ flat.T,
            width=float(width),
        )
