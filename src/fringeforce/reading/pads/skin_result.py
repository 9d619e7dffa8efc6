"""What contacts on a pad amount to: forces on squares, contacts, the total, and tractions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from fringeforce.base.arrays import Array, Index
from fringeforce.contacts.resultant import Resultant
from fringeforce.design.pad import Pad
from fringeforce.models.pad_skin import (
    FIRST_SHAPE,
    PLACE,
    PRESSURES,
    SHAPE,
    SHEARS,
    SIZE_OF,
    TERMS,
    matrix_of,
)
from fringeforce.reading.reading import Traction

HERTZ_WIDTH = 2 * np.sqrt(5.0)
"""Whole width of a Hertz contact over the standard deviation of its pressure along an axis."""
RINGS, SPOKES = 24, 48
"""Small forces that stand for a contact where it is divided among squares."""
STD_STEP = 1e-2
"""Step of numerical derivatives, in standard deviations; what squares share among them needs a step
that is not lost between small forces, of `SQUARE_STEP`."""
SQUARE_STEP = 0.05
"""Step of a place and of the logarithm of a size for forces on squares, in sides of a square."""
TRACTION_POINTS = 2.5
"""Places at which tractions are stated, in a thickness of the cover."""
DRAWS = 48
"""Draws of the unknowns that tell how uncertain tractions are."""


@dataclass(frozen=True, eq=False)
class PadSkinResult:
    """What is stated of contacts, computed when it is asked for.

    Attributes
    ----------
    pad : Pad
        The design.
    found : ndarray, shape (k, SIZE_OF)
        Unknowns of the contacts.
    joint : callable
        Computes their covariance, shape (k SIZE_OF, k SIZE_OF).
    """

    pad: Pad
    found: Array
    joint: Callable[[], Array]

    @cached_property
    def _covariance(self) -> Array:
        return self.joint()

    @cached_property
    def forces(self) -> Array:
        """Forces on the squares, shape (n, 3) [N]."""
        return sum(
            (_on_squares(self.pad, one) for one in self.found),
            start=np.zeros((self.pad.tactels.total, 3)),
        )

    @cached_property
    def _rows(self) -> Array:
        """Derivatives of the forces on the squares by the unknowns, shape (3 n, k SIZE_OF)."""
        rows, side = [], self.pad.tactels.side
        for one in self.found:
            for k in range(SIZE_OF):
                step = np.zeros(SIZE_OF)
                step[k] = SQUARE_STEP * (side if PLACE <= k < SHAPE else 1.0)
                ahead, behind = (_on_squares(self.pad, one + s * step) for s in (1, -1))
                rows.append(((ahead - behind) / (2 * step[k])).ravel())
        return np.array(rows).reshape(-1, 3 * self.pad.tactels.total).T

    def covariance(self) -> Array:
        """Covariance of the forces on the squares, shape (3 n, 3 n) [N^2]."""
        return self._rows @ self._covariance @ self._rows.T

    def std(self) -> Array:
        """Deviations of the forces on the squares, shape (n, 3) [N]."""
        variance = np.einsum("ru,ru->r", self._rows, self._rows @ self._covariance)
        return np.sqrt(np.maximum(variance, 0)).reshape(-1, 3)

    def contacts(self) -> tuple[Resultant, ...]:
        """Single contacts, the strongest first."""
        single = [self._resultant(np.arange(k, k + 1)) for k in range(len(self.found))]
        return tuple(sorted(single, key=lambda one: -one.force[0]))

    def total(self) -> Resultant:
        """Everything together."""
        return self._resultant(np.arange(len(self.found)))

    def _resultant(self, which: Index) -> Resultant:
        numbers = (which[:, None] * SIZE_OF + np.arange(SIZE_OF)).ravel()
        covariance = self._covariance[np.ix_(numbers, numbers)]
        own = self.found[which].ravel()
        std = np.sqrt(np.maximum(np.diag(covariance), 0))
        middle = amounts(self.found[which])
        steps = STD_STEP * std
        ahead, behind = (
            amounts((own + s * np.diag(steps)).reshape(len(own), len(which), SIZE_OF))
            for s in (1, -1)
        )
        change = ahead - behind
        # an axis has no sense
        change[:, -1] = (change[:, -1] + np.pi / 2) % np.pi - np.pi / 2
        rows = (change / np.where(steps > 0, 2 * steps, np.inf)[:, None]).T
        force, moment, centre, axes = np.split(middle[:-1], [3, 6, 8])
        places = self.pad.tactels.places
        touched = np.zeros(len(places), dtype=bool)
        for one in self.found[which]:
            touched |= _on_squares(self.pad, one)[:, 0] != 0
        return Resultant(
            np.flatnonzero(touched),
            force,
            moment,
            centre,
            rows @ covariance @ rows.T,
            axes=axes,
            orientation=float(np.degrees(middle[-1])),
        )

    def traction(self) -> Traction:
        """Pressure and shear all over the skin, with deviations [Pa]."""
        skin, cover = self.pad.skin, self.pad.transducer.compliant.thickness
        assert skin is not None
        x, y = (
            (np.arange(n) + 0.5) / n * length - length / 2
            for length, n in ((e, max(round(TRACTION_POINTS * e / cover), 1)) for e in skin.extent)
        )
        places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        values = tractions_at(self.found, places)
        generator = np.random.default_rng(0)
        size, vectors = np.linalg.eigh(self._covariance)
        root = vectors * np.sqrt(np.maximum(size, 0))
        square = np.zeros_like(values)
        for draw in generator.standard_normal((DRAWS, len(size))):
            moved = self.found + (root @ draw).reshape(self.found.shape)
            square += np.square(tractions_at(moved, places) - values)
        return Traction(places, values, np.sqrt(square / DRAWS))


def amounts(contacts: Array) -> Array:
    """Force, moment, centre, axes [m] and orientation [rad] of contacts together.

    Parameters
    ----------
    contacts : ndarray, shape (..., k, SIZE_OF)
        Their unknowns.

    Returns
    -------
    ndarray, shape (..., 11)
        Centre, axes and orientation are not finite where nothing pushes.
    """
    forces, places = contacts[..., :PLACE], contacts[..., PLACE:SHAPE]
    (normal, t_x, t_y), (x, y) = (np.moveaxis(part, -1, 0) for part in (forces, places))
    force = forces.sum(axis=-2)
    turning = x * t_y - y * t_x + spin(contacts)
    moment = np.stack([-y * normal, x * normal, turning], axis=-1).sum(axis=-2)
    pushed = force[..., :1] > 0
    share = normal / np.where(pushed, force[..., :1], 1.0)
    centre = (share[..., None] * places).sum(axis=-2)
    apart, matrices = places - centre[..., None, :], matrix_of(contacts[..., SHAPE:FIRST_SHAPE])
    each = matrices @ matrices / 5 + apart[..., :, None] * apart[..., None, :]
    size, vectors = np.linalg.eigh((share[..., None, None] * each).sum(axis=-3))
    axes = HERTZ_WIDTH * np.sqrt(np.maximum(size[..., ::-1], 0))
    turn = np.arctan2(vectors[..., 1, 1], vectors[..., 0, 1])
    turn = (turn + np.pi / 2) % np.pi - np.pi / 2
    middle = np.concatenate([centre, axes, turn[..., None]], axis=-1)
    return np.concatenate([force, moment, np.where(pushed, middle, np.nan)], axis=-1)


def spin(contacts: Array) -> Array:
    """Moments of contacts' shears about z through their centres, shape (..., k) [N m]."""
    matrices = matrix_of(contacts[..., SHAPE:FIRST_SHAPE])
    xx, xy, yy = matrices[..., 0, 0], matrices[..., 0, 1], matrices[..., 1, 1]
    shears = contacts[..., FIRST_SHAPE + len(PRESSURES) :]
    shears = shears.reshape(*contacts.shape[:-1], 2, len(SHEARS))
    first = [SHEARS.index(i) for i, term in enumerate(TERMS) if term.degree == 1]
    # the polynomials of the first degree are sqrt(5) times the place on the disc
    by_x, by_y = np.moveaxis(shears[..., first] / np.sqrt(5), -2, 0)
    one = xx * by_y[..., 0] + xy * by_y[..., 1]
    return np.asarray(contacts[..., 0] * (one - xy * by_x[..., 0] - yy * by_x[..., 1]))


def tractions_at(contacts: Array, places: Array) -> Array:
    """Pressure and shear of contacts at places, shape (n, 2), as (n, 3) [Pa]."""
    total = np.zeros((len(places), 3))
    for one in contacts:
        matrix = matrix_of(one[SHAPE:FIRST_SHAPE])
        t = (places - one[PLACE:SHAPE]) @ np.linalg.inv(matrix)
        inside = np.square(t).sum(axis=1) < 1
        r = np.hypot(*t[inside].T)
        hertz = 1.5 / np.pi / np.linalg.det(matrix) * np.sqrt(1 - r**2)
        total[inside] += hertz[:, None] * _mixed_at(one, r, np.arctan2(*t[inside].T[::-1]))
    return total


def _mixed_at(one: Array, r: Array, turn: Array) -> Array:
    """Normal and tangential force over the weight of Hertz at places of the unit disc, (q, 3)."""
    return _mixed(one, np.stack([term.value(r, turn) for term in TERMS]))


def _mixed(one: Array, terms: Array) -> Array:
    """The same from values of the polynomials, shape (terms, q)."""
    first = FIRST_SHAPE + len(PRESSURES)
    shears = one[first:].reshape(2, -1) @ terms[list(SHEARS)]
    pressure = one[0] * (1 + one[FIRST_SHAPE:first] @ terms[list(PRESSURES)])
    return np.column_stack([pressure, one[1] + one[0] * shears[0], one[2] + one[0] * shears[1]])


@cache
def _disc() -> tuple[Array, Array, Array]:
    """Places of small forces on the unit disc, shares under the weight of Hertz, polynomials."""
    nodes, weights = np.polynomial.legendre.leggauss(RINGS)
    r = (nodes + 1) / 2
    shares = weights * r * np.sqrt(1 - r**2)
    radius = np.repeat(r, SPOKES)
    turn = np.tile(2 * np.pi * np.arange(SPOKES) / SPOKES, RINGS)
    unit = np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])
    terms = np.stack([term.value(radius, turn) for term in TERMS])
    return unit, np.repeat(shares / shares.sum() / SPOKES, SPOKES), terms


def _on_squares(pad: Pad, one: Array) -> Array:
    """Forces of a contact on the squares of a skin, the nearest one for each place, (n, 3)."""
    unit, shares, terms = _disc()
    places = one[PLACE:SHAPE] + unit @ matrix_of(one[SHAPE:FIRST_SHAPE])
    (nx, ny), pitch = pad.tactels.count, pad.tactels.pitch
    ix, iy = (
        np.clip(np.round(place / pitch + (n - 1) / 2).astype(int), 0, n - 1)
        for place, n in zip(places.T, (nx, ny), strict=True)
    )
    found = np.zeros((nx * ny, 3))
    np.add.at(found, ix * ny + iy, shares[:, None] * _mixed(one, terms))
    return found
