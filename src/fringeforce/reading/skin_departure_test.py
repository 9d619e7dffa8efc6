"""Whether a skin's frame that contacts explain shows a departure from the design all the same."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fringeforce.estimation.score_test import Score
from fringeforce.models.skin import GEOMETRY, PLACE, SkinModel
from fringeforce.reading.departure_test import StripDepartureTest, plain
from fringeforce.reading.findings import Sized, sentence
from fringeforce.reading.skin_fit import Explanation


@dataclass(frozen=True, eq=False)
class SkinDepartureTest(StripDepartureTest):
    """Score tests beside forces and geometry of contacts.

    Attributes
    ----------
    skin : SkinModel
        What contacts do.
    """

    skin: SkinModel

    @cached_property
    def _skin(self) -> SkinModel:
        """The same skin, where what is tested is uncertain as well, and places are on the strip."""
        return replace(self.skin, uncertain=self._wide, as_seen=False)

    def finding(self, one: Explanation) -> str:
        """What is said of departures that a frame shows plainly; nothing if it shows none."""
        found = self.shown(one)
        return sentence(found, self.model) if found else ""

    def shown(self, one: Explanation) -> list[Sized]:
        """Departures that a frame shows plainly and cannot tell apart, the likeliest first."""
        if not self.tested:
            return []
        count = len(one.contacts.forces)
        places = 2 * count + PLACE + GEOMETRY * np.arange(count)
        stated = np.append(np.arange(2 * count), places)
        return plain(self.tested, self.scores(one), stated, self._size)

    def scores(self, one: Explanation) -> list[Score]:
        """What a frame tells of everything that is tested, in its deviations, beside the rest."""
        contacts, base = one.contacts, self._wide.frame.at
        others = np.zeros(base.size)
        others[self._fitted[base.loads :]] = one.others
        wide, start = self._skin.frame(contacts, others=others[base.fields :])
        own = wide.at.fields + len(contacts.forces) * GEOMETRY
        lines = (self.skin.shares(contacts.geometry) * contacts.forces[:, :, None]).sum(axis=0)
        found = np.append(start[:own], one.others)
        return self._told(one.posterior, wide, found, lines.T.ravel())
