"""Starts for contacts whose light is faint: places and directions all over the skin.

Grey levels of small phases p are nearly quadratic in p, so that they hardly tell the sign of any
stretch of it: a push looks like shear beside it, or like a pull.  Such contacts are looked for by
their light, not by their phase.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.ndimage import minimum_filter

from fringeforce.base.arrays import Array, Mask
from fringeforce.estimation.frame_exposure import expose
from fringeforce.models.skin import PLACE, Contacts, SkinModel
from fringeforce.reading.skin_fit import Explanation, Seen

FAINT = 1.0
"""Largest phase of faint contacts: light is within 8 % of quadratic there [rad]."""
DIRECTIONS = np.linspace(-1, 1, 17)
"""Shares of the largest tangential force that are tried."""
SPACING = 1.0
"""Distance of the places, in thicknesses of the cover: a width as drawn."""
AMOUNTS = np.arange(1, 33) / 32
"""Forces that are tried, over that of the largest faint phase."""
RIVALS = 6
"""Starts of one kind that are tried; in frames looked at, up to four explained light as well."""
MOST_REPLACED = 2
"""Neighbours that one contact may take the place of: two stretches of either sign look like one."""


def is_faint(seen: Seen, one: Explanation) -> bool:
    """Whether contacts cause so little phase that light hardly tells its sign."""
    return bool(np.abs(one.phase - seen.skin.uncertain.frame.fixed).max() < FAINT)


def faint_starts(seen: Seen, one: Explanation) -> list[Contacts]:
    """Contacts that may explain a frame as well as some of which one or more are faint.

    Each has one in the place of a faint one, where it leaves less light than its neighbours in
    place and direction.  Where all are faint, each has one more, or one in the place of one, of two
    neighbours or of all; beside strong ones these would take a third more of every search.

    Parameters
    ----------
    seen : Seen
        The frame.
    one : Explanation
        Of it.

    Returns
    -------
    list of Contacts
        The likeliest of each kind first.
    """
    contacts = one.contacts.sorted()
    (forces, geometry), faint = contacts, _faint(seen, contacts)
    if not faint.any():
        return []
    trials, count, found = _Trials.on(seen.skin), len(forces), list[Contacts]()
    taken: tuple[int, ...] = (1,)
    if faint.all():
        found += _beside(seen, one, one.contacts, trials)
        taken = *range(1, min(count, MOST_REPLACED + 1)), count
    for many in taken:
        for k in range(count - many + 1):
            if faint[k : k + many].all():
                rest = np.r_[:k, k + many : count]
                found += _beside(seen, one, Contacts(forces[rest], geometry[rest]), trials)
    return found


def _faint(seen: Seen, contacts: Contacts) -> Mask:
    """Which contacts cause so little phase by themselves, shape (k,)."""
    forces, geometry = contacts
    units = seen.skin.touched(geometry).moments[:, :, 0]
    caused = np.einsum("kc,kcm->km", forces, units)
    return np.asarray(np.abs(caused).max(axis=1) < FAINT)


class _Trials(NamedTuple):
    """Single contacts that are tried.

    Attributes
    ----------
    geometry : ndarray, shape (k, GEOMETRY)
        Of each, from one end of the skin to the other.
    units : ndarray, shape (k, 2, m)
        Phase at the nodes under unit forces [rad/N].
    forces : ndarray, shape (k, directions, amounts, 2)
        Normal and tangential ones that are tried [N].
    """

    geometry: Array
    units: Array
    forces: Array

    @classmethod
    def on(cls, skin: SkinModel) -> _Trials:
        """All over a skin."""
        count = int(np.ceil(2 * skin.half / (SPACING * skin.cover))) + 1
        geometry = np.repeat(skin.drawn[None], count, axis=0)
        geometry[:, PLACE] = np.linspace(-skin.half, skin.half, count)
        geometry = np.unique(skin.limited(geometry), axis=0)
        units = skin.touched(geometry).moments[:, :, 0]
        directions = np.column_stack([np.ones(len(DIRECTIONS)), skin.friction * DIRECTIONS])
        largest = FAINT / np.abs(directions @ units).max(axis=2)
        forces = largest[:, :, None, None] * AMOUNTS[:, None] * directions[:, None]
        return cls(geometry, units, forces)


def _beside(seen: Seen, one: Explanation, others: Contacts, trials: _Trials) -> list[Contacts]:
    """One more contact beside others, the likeliest first."""
    skin, tried = seen.skin, trials.forces
    # a frame's model has one contact at least
    dark = others if len(others.forces) else Contacts(np.zeros((1, 2)), skin.drawn[None])
    model = skin.touched(dark.geometry)
    unknowns = np.zeros(model.at.size)
    unknowns[: model.at.loads] = dark.forces.ravel()
    unknowns[model.at.fields :] = one.others[len(one.others) - (model.at.size - model.at.fields) :]
    base = expose(model, unknowns)[0]
    lit = np.isfinite(seen.frame)
    weights = np.where(lit, 1 / np.sqrt(model.variance), 0.0)
    left = np.where(lit, seen.frame - base, 0.0) * weights

    def added(phase: Array) -> Array:
        """Light by a phase more, in deviations of the noise."""
        return (expose(model._replace(fixed=model.fixed + phase), unknowns)[0] - base) * weights

    squares = np.empty(tried.shape[:3])  # less those of what the others leave
    for k, unit in enumerate(trials.units):
        scale = FAINT / 2 / np.abs(unit).max(axis=1)
        normal, tangential = scale[:, None] * unit
        odd, even = list[Array](), list[Array]()
        for phase in (normal, tangential, normal + tangential):
            more, less = added(phase), added(-phase)
            odd.append((more - less) / 2)
            even.append((more + less) / 2)
        terms = np.array([odd[0], odd[1], even[0], even[1], even[2] - even[0] - even[1]])
        n, t = np.moveaxis(tried[k] / scale, -1, 0)
        powers = np.stack([n, t, n * n, t * t, n * t], axis=-1)
        light = (powers @ (terms @ terms.T) * powers).sum(axis=-1)
        squares[k] = light - 2 * powers @ (terms @ left)
    amounts, least = squares.argmin(axis=2), squares.min(axis=2)
    lowest = np.argwhere(least == minimum_filter(least, 3, mode="nearest"))
    likeliest = sorted(map(tuple, lowest), key=lambda at: least[at])[:RIVALS]
    return [
        Contacts(
            np.vstack([others.forces, tried[at][amounts[at]]]),
            np.vstack([others.geometry, trials.geometry[at[0]]]),
        )
        for at in likeliest
    ]
