"""What happens at each tactel: touch, release, incipient slip.

Events are decided in standard deviations, with one limit to begin and another to end.  The two are
eight apart, so that noise does not toggle them, not even at rest half way.  The state is a value:
`follow` returns the next one and what happened.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import InputError
from fringeforce.contacts.force_estimate import ForceEstimate

TOUCH, RELEASE = 9.0, 1.0
"""Deviations above which a normal force begins to be a touch, and below which it ends."""
SLIP, STICK = 1.0, 9.0
"""Deviations of the margin of friction below which slip is near, and above which it is not."""


class EventKind(Enum):
    """What happened."""

    TOUCH = "touch"
    RELEASE = "release"
    SLIP = "slip"
    STICK = "stick"


@dataclass(frozen=True)
class Event:
    """What happened at one tactel, or contact of a skin, counted from zero."""

    kind: EventKind
    tactel: int


@dataclass(frozen=True)
class Friction:
    """Coefficient of friction and its variance.

    Attributes
    ----------
    coefficient : float
        Coefficient of Coulomb's law, |T| = coefficient N where a contact slides.
    variance : float
        Variance of the coefficient; infinite while nothing is known.

    Examples
    --------
    >>> ff.Friction(coefficient=0.4, variance=0.01)
    Friction(coefficient=0.4, variance=0.01)
    """

    coefficient: float = 0.5
    variance: float = np.inf

    def __post_init__(self) -> None:
        if not self.coefficient > 0 or not self.variance >= 0:
            raise InputError(
                f"coefficient = {self.coefficient}, variance = {self.variance}: a coefficient of "
                "friction must be greater than 0 and its variance not negative."
            )

    def slid(self, reading: ForceEstimate, tactels: Mask) -> Friction:
        """Learn from a reading during which some tactels slid, such as a stroke over a surface.

        Generalised least squares of |T| = coefficient N with the covariance of the forces, joined
        with what was known before in proportion to the information.

        Parameters
        ----------
        reading : fringeforce.Reading
            Taken while they slid; its noise independent of that of earlier ones.
        tactels : ndarray of bool, shape (n,)
            Tactels that slid.
        """
        if not reading.ok or not tactels.any():
            return self
        normal, tangential = reading.forces[tactels].T
        start = float(np.abs(tangential).sum() / normal.sum())
        spread = _margin_covariance(reading, start)[np.ix_(tactels, tactels)]
        weight = np.linalg.solve(spread, normal)
        information = float(weight @ normal)
        found = float(weight @ np.abs(tangential)) / information
        return self.joined(found, information)

    def joined(self, found: float, information: float) -> Friction:
        """Learn from a coefficient that was found, with its information, 1 / variance."""
        before = 1 / self.variance if self.variance > 0 else np.inf
        if found <= 0 or not np.isfinite(before):
            return self
        total = before + information
        mean = (before * self.coefficient + information * found) / total
        return Friction(mean, 1 / total)


@dataclass(frozen=True, eq=False)
class Contact:
    """Which tactels touch something and which are about to slip.

    Attributes
    ----------
    touching, slipping : ndarray of bool, shape (n,)
        The state after the last reading.
    friction : Friction
        What is known of the surface.  While nothing is known no slip is announced.

    Examples
    --------
    >>> model = ff.characterize(ff.load_sensor("saad"))
    >>> forces = np.zeros((11, 2))
    >>> forces[5, 0] = 1.0
    >>> reading = ff.Reader(model).read(model.expose(forces, rng=0))
    >>> contact, events = ff.Contact.none(11).follow(reading)
    >>> [(event.kind.value, event.tactel) for event in events]
    [('touch', 5)]
    """

    touching: Mask
    slipping: Mask
    friction: Friction

    @classmethod
    def none(cls, tactels: int, friction: Friction | None = None) -> Contact:
        """No contact yet."""
        nothing = np.zeros(tactels, dtype=bool)
        return cls(nothing, nothing, friction or Friction())

    def follow(self, reading: ForceEstimate) -> tuple[Contact, tuple[Event, ...]]:
        """State after one more reading, and what happened.

        Readings that are not `trusted` say nothing and change nothing.
        """
        if not reading.trusted:
            return self, ()
        pressed = reading.forces[:, 0] / reading.std[:, 0]
        touching = _latched(self.touching, pressed > TOUCH, pressed < RELEASE)
        margin = self._margin(reading)
        slipping = touching & _latched(self.slipping, margin < SLIP, margin > STICK)
        events = (
            *_events(self.touching, touching, EventKind.TOUCH, EventKind.RELEASE),
            *_events(self.slipping & touching, slipping, EventKind.SLIP, EventKind.STICK),
        )
        return replace(self, touching=touching, slipping=slipping), events

    def slid(self, reading: ForceEstimate) -> Contact:
        """Learn the friction from a reading during which all tactels that touch slid."""
        return replace(self, friction=self.friction.slid(reading, self.touching))

    def _margin(self, reading: ForceEstimate) -> Array:
        """How far each tactel is from slipping, in deviations, shape (n,)."""
        normal, tangential = reading.forces.T
        if not np.isfinite(self.friction.variance):
            return np.full(len(normal), np.inf)
        coefficient = self.friction.coefficient
        variance = np.diag(_margin_covariance(reading, coefficient))
        variance = variance + normal**2 * self.friction.variance
        return (coefficient * normal - np.abs(tangential)) / np.sqrt(variance)


def _margin_covariance(reading: ForceEstimate, coefficient: float) -> Array:
    """Covariance of coefficient N - |T|, shape (n, n) [N^2]."""
    n = len(reading.forces)
    gradient = np.zeros((n, n, 2))
    each = np.arange(n)
    gradient[each, each, 0] = coefficient
    gradient[each, each, 1] = np.where(reading.forces[:, 1] < 0, 1.0, -1.0)
    rows = gradient.reshape(n, -1)
    return rows @ reading.covariance @ rows.T


def _latched(before: Mask, begins: Mask, ends: Mask) -> Mask:
    return begins | (before & ~ends)


def _events(before: Mask, after: Mask, begun: EventKind, ended: EventKind) -> list[Event]:
    return [
        Event(begun if after[tactel] else ended, int(tactel))
        for tactel in np.flatnonzero(before != after)
    ]
