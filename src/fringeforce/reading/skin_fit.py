"""Contacts that explain a frame: the climb over forces and geometry from a start."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.estimation.linearised_frame import Linearised
from fringeforce.estimation.posterior import Posterior, Top
from fringeforce.models.skin import GEOMETRY, PLACE, WIDTH, YIELDING, Contacts, SkinModel

STEP = 0.5
"""Change of place and half width in a step, in half widths and thicknesses of the cover."""
ROUNDS = 12
"""Linearisations of a climb."""
LEFT = 4.0
"""Falls of the last round that a climb may still have before it."""
SETTLED = 0.1
"""Fall of the loss below which a climb is at its top."""


class Seen(NamedTuple):
    """A frame of a skin, in bins of pixels or not.

    Attributes
    ----------
    skin : SkinModel
        What contacts do to such frames.
    frame : ndarray, shape (P,)
        Grey levels; not finite where a pixel is not used.
    push : float
        Force that the pace of the fringes tells [N].
    """

    skin: SkinModel
    frame: Array
    push: float

    def posterior(self, contacts: Contacts) -> tuple[Posterior, Array]:
        """The posterior, linear about the geometry of contacts, and their unknowns."""
        model, start = self.skin.frame(contacts)
        return Posterior(model, self.skin.prior(model, self.push), self.frame), start


@dataclass(frozen=True, eq=False)
class Explanation:
    """Contacts that explain a frame, as far as they do.

    Attributes
    ----------
    posterior : Posterior
        Of the frame, linear about their geometry.
    top : Top
        The estimate.
    contacts : Contacts
        Its contacts.
    centre : Contacts
        Those about whose geometry it is linear.
    """

    posterior: Posterior
    top: Top
    contacts: Contacts
    centre: Contacts

    @cached_property
    def phase(self) -> Array:
        """At the nodes [rad]."""
        return self.posterior.phase(self.top)

    @property
    def push(self) -> float:
        """Force that the pace of the fringes told [N]."""
        return self.posterior.prior.yielding / YIELDING

    @property
    def others(self) -> Array:
        """What is uncertain besides the contacts."""
        first = self.posterior.model.at.fields + len(self.contacts.forces) * GEOMETRY
        return self.top.unknowns[first:]

    @cached_property
    def about(self) -> Linearised:
        """The loss about the estimate."""
        return self.posterior.linearised(self.top)

    @cached_property
    def chance(self) -> float:
        """Chance that noise leaves as much: of all residuals and of smooth waves."""
        if self.top.chance < 1e-9:
            return self.top.chance
        return min(self.top.chance, self.posterior.waves_chance(self.top, self.about))

    @cached_property
    def evidence(self) -> float:
        """Logarithm of the probability of the frame, by Laplace's approximation."""
        precision = self.posterior.prior.precision
        return self.posterior.evidence(self.top, self.about) + float(np.log(precision).sum()) / 2


def climbed(
    seen: Seen,
    contacts: Contacts,
    others: Array | None = None,
    bound: float = np.inf,
) -> Explanation:
    """The explanation that contacts lead to.

    Every round is linear in the geometry, but not in the fringes, and moves no contact further than
    that holds; a round that does not lower the loss is tried with half the change.

    Parameters
    ----------
    seen : Seen
        The frame.
    contacts : Contacts
        Where to start.
    others : ndarray, optional
        Where to start with what is uncertain besides.
    bound : float
        Loss above which an explanation is of no use.
    """
    count, skin = len(contacts.forces), seen.skin
    best: Explanation | None = None
    rest = others
    for number in range(ROUNDS):
        posterior, start = seen.posterior(contacts)
        first = posterior.model.at.fields + count * GEOMETRY
        if rest is not None:
            start[first:] = rest
        here = posterior.climbed(start, heats=(), steps=(0, 0))
        if best is not None and rest is not None and here.loss > best.top.loss + SETTLED / 10:
            # too far: half way back
            contacts = _between(skin, best.contacts, contacts)
            rest = (best.top.unknowns[first:] + rest) / 2
            continue
        fall = np.inf if best is None else best.top.loss - here.loss
        done = number > 1 and (fall < SETTLED or here.loss - LEFT * fall > bound)
        best = Explanation(posterior, here, contacts, contacts)
        if done:
            break
        top = posterior.climbed(start, heats=(), steps=(0, 4), bound=bound)
        contacts = _limited(skin, contacts, skin.contacts(posterior.model, top.unknowns))
        rest = top.unknowns[first:]
    assert best is not None
    return best


def renewed(seen: Seen, one: Explanation) -> Explanation:
    """An explanation of a frame, linear about where the contacts of one are now."""
    posterior, start = seen.posterior(one.contacts)
    start[len(start) - len(one.others) :] = one.others
    top = posterior.climbed(start, heats=(), steps=(0, 2), tolerance=SETTLED)
    contacts = seen.skin.contacts(posterior.model, top.unknowns)
    return Explanation(posterior, top, contacts, one.contacts)


def _between(skin: SkinModel, one: Contacts, other: Contacts) -> Contacts:
    return Contacts(
        (one.forces + other.forces) / 2, skin.limited((one.geometry + other.geometry) / 2)
    )


def _limited(skin: SkinModel, before: Contacts, after: Contacts) -> Contacts:
    """The step from some contacts to others, as far as a linearisation holds."""
    geometry = after.geometry.copy()
    reach = STEP * np.maximum(before.geometry[:, WIDTH], skin.drawn[WIDTH])
    for which in (PLACE, WIDTH):
        moved = geometry[:, which] - before.geometry[:, which]
        geometry[:, which] = before.geometry[:, which] + np.clip(moved, -reach, reach)
    return Contacts(after.forces, skin.limited(geometry))
