"""Contacts that explain a frame: the climb over forces and geometry from a start."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.special import pdtrc

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.estimation.frame_climb import CONVERGED
from fringeforce.estimation.linearised_frame import Linearised
from fringeforce.estimation.posterior import Posterior, Top
from fringeforce.estimation.residual_test import FALSE_VERDICT
from fringeforce.models.creep import Crept
from fringeforce.models.skin import (
    GEOMETRY,
    PLACE,
    WIDTH,
    YIELDING,
    Contacts,
    SkinModel,
)

LONGEST_STEP = 0.5
"""Change of place and half width in a step, in half widths and thicknesses of the cover."""
FOLDING, EASED = 0.6, 0.25
"""Squashes of the cover (`SkinStrain.squash`) beyond which its surface folds under contacts of any
width up to eight covers, and to which contacts are widened where it does: a single one folds it at
0.32 to 0.6."""
WIDER = 3
"""Widths, each larger by `LONGEST_STEP`, at which large strain is tried from there on."""
LINEARISATIONS = 12
"""Linearisations of a climb."""
LEFT = 4.0
"""Falls of the last round that a climb may still have before it."""


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
    crept : Crept or None
        What creep of earlier loads adds; None of a skin that does not relax.
    """

    skin: SkinModel
    frame: Array
    push: float
    crept: Crept | None = None

    @property
    def known(self) -> Array | float:
        """Phase at the nodes that contacts do not cause now, shape (m,) [rad]."""
        return 0.0 if self.crept is None else self.crept.left

    @property
    def linear(self) -> Seen:
        """The same of small strain."""
        return self._replace(skin=self.skin.linear)

    def posterior(
        self, contacts: Contacts, beyond: Array | float = 0.0, others: Array | None = None
    ) -> tuple[Posterior, Array]:
        """The posterior, linear about contacts and others, and their unknowns."""
        model, start = self.skin.frame(contacts, beyond, self.crept, others)
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
    solved : bool
        Whether the strip is solved at its contacts where its strain is large; what strain adds to
        the phase is that of other contacts if not, or nothing.
    folded : bool
        Whether its surface folds, so that it explains nothing.
    """

    posterior: Posterior
    top: Top
    contacts: Contacts
    centre: Contacts
    solved: bool = True
    folded: bool = False

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

    @property
    def about(self) -> Linearised:
        """The loss about the estimate."""
        return self.posterior.linearised(self.top)

    @cached_property
    def chance(self) -> float:
        """Chance that noise leaves as much: of all residuals and of smooth waves."""
        if self.folded:
            return 0.0
        if self.top.chance < 1e-9:
            return self.top.chance
        return min(self.top.chance, self.posterior.waves_chance(self.top))

    def spoilt(self, before: float) -> bool:
        """Whether more pixels show anything than did in earlier frames, and chance adds.

        A wrong explanation fits a part of a frame, and takes the rest for broken.
        """
        chance = len(self.posterior.frame) * self.posterior.model.broken
        return bool(pdtrc(max(self.top.broken - before, 0.0), chance) < FALSE_VERDICT)

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
    beyond: Array | float = 0.0,
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
    beyond : ndarray, shape (m,), optional
        Phase beyond that of a skin of small strain [rad].
    """
    count, skin = len(contacts.forces), seen.skin
    best: Explanation | None = None
    rest = others
    for number in range(LINEARISATIONS):
        try:
            posterior, start = seen.posterior(contacts, beyond, rest)
        except InputError:  # the surface folds under them
            if best is None:
                contacts = _wider(skin, contacts)
            else:
                contacts = between(skin, best.contacts, contacts)
            continue
        first = posterior.model.at.fields + count * GEOMETRY
        here = posterior.climbed(start, heats=(), steps=(0, 0))
        if best is not None and rest is not None and here.loss > best.top.loss + CONVERGED / 10:
            # too far: half way back
            contacts = between(skin, best.contacts, contacts)
            rest = (best.top.unknowns[first:] + rest) / 2
            continue
        fall = np.inf if best is None else best.top.loss - here.loss
        done = number > 1 and (fall < CONVERGED or here.loss - LEFT * fall > bound)
        best = Explanation(posterior, here, contacts, contacts)
        if done:
            break
        top = posterior.climbed(start, heats=(), steps=(0, 4), bound=bound)
        contacts = limited_step(skin, contacts, skin.contacts(posterior.model, top.unknowns))
        rest = top.unknowns[first:]
    if best is None:
        found = climbed(seen.linear, contacts, bound=bound)
        return replace(found, solved=False, folded=True)
    return best


def renewed(seen: Seen, one: Explanation) -> Explanation:
    """An explanation of a frame, linear about where the contacts of one are now."""
    try:
        posterior, start = seen.posterior(one.contacts, others=one.others)
    except InputError:  # the surface folds under them
        return replace(one, solved=False, folded=True)
    top = posterior.climbed(start, heats=(), steps=(0, 2))
    contacts = seen.skin.contacts(posterior.model, top.unknowns)
    return Explanation(posterior, top, contacts, one.contacts)


def strained(skin: SkinModel, contacts: Contacts) -> Array | None:
    """What large strain adds to the phase at the nodes, under wider contacts where these fold.

    Small strain finds contacts that are too narrow, or several in the place of one.  None is
    returned if the surface folds under contacts several times as wide.
    """
    if skin.strain is None:
        return skin.strained(contacts)
    squash = skin.strain.squash(contacts.forces, 2 * contacts.geometry[:, WIDTH])
    if squash.max(initial=0.0) < FOLDING:
        try:
            return skin.strained(contacts)
        except InputError:
            pass
    geometry = contacts.geometry.copy()
    geometry[:, WIDTH] *= np.maximum(squash / EASED, 1)
    contacts = Contacts(contacts.forces, skin.limited(geometry))
    for _ in range(WIDER):
        try:
            return skin.strained(contacts)
        except InputError:
            contacts = _wider(skin, contacts)
    return None


def _wider(skin: SkinModel, one: Contacts) -> Contacts:
    """Contacts that press less."""
    geometry = one.geometry.copy()
    geometry[:, WIDTH] *= 1 + LONGEST_STEP
    return Contacts(one.forces, skin.limited(geometry))


def between(skin: SkinModel, one: Contacts, other: Contacts) -> Contacts:
    """Contacts half way from some to others."""
    return Contacts(
        (one.forces + other.forces) / 2, skin.limited((one.geometry + other.geometry) / 2)
    )


def limited_step(skin: SkinModel, before: Contacts, after: Contacts) -> Contacts:
    """The step from some contacts to others, as far as a linearisation holds."""
    geometry = after.geometry.copy()
    reach = LONGEST_STEP * np.maximum(before.geometry[:, WIDTH], skin.drawn[WIDTH])
    for which in (PLACE, WIDTH):
        moved = geometry[:, which] - before.geometry[:, which]
        geometry[:, which] = before.geometry[:, which] + np.clip(moved, -reach, reach)
    return Contacts(after.forces, skin.limited(geometry))
