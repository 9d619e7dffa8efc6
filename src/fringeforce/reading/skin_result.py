"""What an explanation of a skin's frame amounts to: line loads, contacts, and the total."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.contacts.resultant import Resultant
from fringeforce.models.skin import PLACE, SECOND, WIDTH, SkinModel, variances
from fringeforce.models.strip import SensorModel
from fringeforce.reading.reading import Traction
from fringeforce.reading.skin_fit import Explanation

NOTHING = 1e-7
"""Share of the largest line load below which one is none; the others add up to the contacts' forces
within a millionth."""


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
        posterior, top = self.one.posterior, self.one.top
        rows = self.skin.slopes(posterior.model, top.unknowns)
        rows = rows.reshape(-1, rows.shape[-1])
        return np.asarray(rows @ posterior.spread(top) @ rows.T)

    @property
    def deviations(self) -> Array:
        """Standard deviations of the normal forces of the contacts, shape (k,) [N]."""
        return np.sqrt(np.diag(self.joint)[:: self.values.shape[1]])

    @property
    def force_covariance(self) -> Array:
        """Covariance of the forces of the contacts, shape (2k, 2k) [N^2]."""
        count, size = self.values.shape
        joint = self.joint.reshape(count, size, count, size)
        return joint[:, :2, :, :2].reshape(2 * count, 2 * count)

    @cached_property
    def forces(self) -> Array:
        """Forces of the line loads, shape (n, 2) [N]."""
        shares = self.skin.shares(self.one.contacts.geometry)
        found = (shares * self.one.contacts.forces[:, :, None]).sum(axis=0).T
        # the spline of line loads dies away, and never ends
        return np.where(np.abs(found) > NOTHING * np.abs(found).max(), found, 0.0)

    def phase(self, model: SensorModel) -> Array:
        """Phase lead that the line loads cause in a model of the strip, shape (P,) [rad]."""
        return model.phase(self.forces)

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
        return self.resultants[1:]

    def total(self) -> Resultant:
        """Everything together."""
        return self.resultants[0]

    @cached_property
    def resultants(self) -> tuple[Resultant, ...]:
        """Everything together, then single contacts, the strongest first."""
        joint, values = self.joint, self.values
        count, size = values.shape
        forces, place, half = values[:, :2], values[:, 2 + PLACE], values[:, 2 + WIDTH]
        normal = forces[:, 0]
        # a row for the sum, and one for each contact, however little it presses
        own = np.concatenate([np.ones((1, count)), np.eye(count)])
        push, shares = normal.sum(), own.copy()
        if count > 1:
            shares[0] = normal / push if push > 0 else np.nan
        centre = shares @ place
        apart = place - centre[:, None]
        single = variances(values[:, 2:])
        square = single + np.square(apart)
        variance = (shares * square).sum(axis=1)
        width = 4 * np.sqrt(np.where(variance > 0, variance, np.nan))
        slope = 8 / width[:, None]
        rows = np.zeros((count + 1, 7, count, size))
        rows[:, 0, :, 0] = rows[:, 1, :, 1] = own
        rows[:, 3, :, 0], rows[:, 3, :, 2 + PLACE] = own * place, own * normal
        rows[:, 5, :, 2 + PLACE] = shares
        rows[:, 6, :, 2 + PLACE] = slope * 2 * shares * apart
        rows[:, 6, :, 2 + WIDTH] = slope * shares * 2 * single / half
        rows[:, 6, :, 2 + SECOND] = slope * shares * np.square(half) / 4
        if count > 1:
            rows[0, 5, :, 0] = apart[0] / push
            rows[0, 6, :, 0] = slope[0] * (square[0] - variance[0]) / push
        flat = rows.reshape(count + 1, 7, -1)
        covariance = flat @ joint @ flat.transpose(0, 2, 1)
        lines = self.skin.places
        reach = np.maximum(half, (lines[1] - lines[0]) / 2)
        under: Mask = np.abs(lines - place[:, None]) <= reach[:, None]
        near = [under.any(axis=0), *under]
        sums, moments = own @ forces, own @ (normal * place)
        return tuple(
            Resultant(
                np.flatnonzero(near[k]),
                sums[k],
                np.array([0.0, moments[k], 0.0]),
                centre[k : k + 1],
                covariance[k],
                width=float(width[k]),
            )
            for k in (0, *(1 + np.argsort(-normal, kind="stable")))
        )
