"""What happens to contacts on a skin: they appear and go, move, and are about to slip.

A contact of a reading is one of the last reading if the two overlap; what does not is new.  Touch,
release and slip are decided in standard deviations, as of tactels.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from fringeforce.contacts.contact import RELEASE, SLIP, STICK, TOUCH, Event, EventKind, Friction
from fringeforce.contacts.resultant import Resultant


class ContactEstimate(Protocol):
    """Contacts as a frame says them; `fringeforce.Reading` of a skin is one."""

    @property
    def contacts(self) -> tuple[Resultant, ...]:
        """Single contacts, the strongest first."""
        ...

    @property
    def trusted(self) -> bool:
        """Whether they may be used: they explain the frame, or nothing touches."""
        ...


@dataclass(frozen=True, eq=False)
class SkinContacts:
    """Contacts on a skin by numbers that they keep, and which of them are about to slip.

    Attributes
    ----------
    touching : mapping of int to Resultant
        Contacts of the last reading, by numbers in the order in which they appeared, from zero.
    slipping : frozenset of int
        Those about to slip.
    friction : Friction
        What is known of the surface.  While nothing is known no slip is announced.
    count : int
        Contacts that there have been so far.

    Examples
    --------
    >>> model = ff.characterize(ff.load_sensor("skin"))
    >>> finger = ff.Press(x=1e-3, normal=2.0, tangential=0.4, width=0.8e-3)
    >>> reader, contacts = ff.Reader(model), ff.SkinContacts()
    >>> for frame in model.expose([[finger], []], rng=0):
    ...     contacts, events = contacts.follow(reader.read(frame))
    ...     print([(event.kind.value, event.tactel) for event in events])
    [('touch', 0)]
    [('release', 0)]
    """

    touching: Mapping[int, Resultant] = field(default_factory=dict)
    slipping: frozenset[int] = frozenset()
    friction: Friction = field(default_factory=Friction)
    count: int = 0

    def follow(self, reading: ContactEstimate) -> tuple[SkinContacts, tuple[Event, ...]]:
        """Contacts after one more reading, and what happened.

        Readings that are not `trusted` say nothing and change nothing.
        """
        if not reading.trusted:
            return self, ()
        known, count = self._met(reading.contacts), self.count
        new = [one for one in reading.contacts if not any(one is old for old in known.values())]
        touching = {k: one for k, one in known.items() if one.force[0] > RELEASE * one.std[0]}
        for one in new:
            if one.force[0] > TOUCH * one.std[0]:
                touching[count] = one
                count += 1
        slipping = frozenset(k for k, one in touching.items() if self._slips(k, one))
        kept = self.slipping & touching.keys()
        events = [
            *((EventKind.TOUCH, k) for k in touching.keys() - self.touching.keys()),
            *((EventKind.RELEASE, k) for k in self.touching.keys() - touching.keys()),
            *((EventKind.SLIP, k) for k in slipping - kept),
            *((EventKind.STICK, k) for k in kept - slipping),
        ]
        after = replace(self, touching=touching, slipping=slipping, count=count)
        return after, tuple(Event(kind, k) for kind, k in events)

    def slid(self, reading: ContactEstimate) -> SkinContacts:
        """Learn the friction from a reading during which all contacts that touch slid."""
        if not reading.trusted:
            return self
        friction = self.friction
        for one in self._met(reading.contacts).values():
            found = one.slip_ratio
            spread = one.slip_ratio_std
            if spread > 0:
                friction = friction.joined(found, spread**-2)
        return replace(self, friction=friction)

    def _met(self, contacts: tuple[Resultant, ...]) -> dict[int, Resultant]:
        """Contacts of a reading that touched before, by their numbers; the nearest go together."""
        pairs = sorted(
            (apart, k, number)
            for k, old in self.touching.items()
            for number, one in enumerate(contacts)
            if (apart := float(np.linalg.norm(one.centre - old.centre))) < _reach(one) + _reach(old)
        )
        found, taken = dict[int, Resultant](), set[int]()
        for _, k, number in pairs:
            if k not in found and number not in taken:
                found[k] = contacts[number]
                taken.add(number)
        return found

    def _slips(self, number: int, one: Resultant) -> bool:
        """Whether a contact is about to slip, given whether it was."""
        friction = self.friction
        if not np.isfinite(friction.variance):
            return False
        normal, tangential = one.force[0], one.force[1:]
        size = np.linalg.norm(tangential)
        along = tangential / size if size > 0 else np.zeros(len(tangential))
        slope = np.concatenate([[friction.coefficient], -along])
        variance = slope @ one.force_covariance @ slope + normal**2 * friction.variance
        margin = slope @ one.force / np.sqrt(variance)
        return bool(margin < SLIP or (number in self.slipping and margin <= STICK))


def _reach(one: Resultant) -> float:
    """Half the width of a contact on a strip, half the mean of the axes of one on a pad [m]."""
    return float(one.width or 0) / 2 if one.axes is None else float(one.axes.mean()) / 2
