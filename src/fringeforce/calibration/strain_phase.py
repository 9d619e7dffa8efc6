"""What large strain adds to the phase of each frame of a bench.

Every frame is solved at its contacts as they are known, and what that adds to small strain is a
phase of its own, beside the influence of its contacts.  It is a small part of the whole: it follows
the values of the design to first order, and contacts that move ask for another solution.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.calibration.design_entries import EFFECTS, varied
from fringeforce.contacts.press import rounded
from fringeforce.design.strip import Sensor
from fringeforce.mechanics.finite_strain import finite_strip
from fringeforce.mechanics.second_order import STEEP
from fringeforce.models.finite_strain import (
    ELEMENT_ORDER,
    SkinStrain,
    added_phase,
    share_of_contacts,
)

CARRIED = 0.1
"""Share of what strain adds by which contacts may change it while slopes by the design are kept: of
a modulus that is off by a tenth that leaves a hundredth of what strain adds."""
STEP = 0.03
"""Step of an entry of the design, over which differences are taken: what strain adds is a small
part of the phase, so that slopes which are right to a tenth are enough."""


@dataclass(frozen=True, eq=False)
class FrameContacts:
    """Contacts of one frame: places and widths, shape (k,) [m], and forces, shape (k, 2) [N]."""

    places: Array
    widths: Array
    forces: Array

    def moved(self, other: FrameContacts, depth: float) -> float:
        """Share of what strain adds that changes, to first order, from these contacts to others.

        It grows with the square of the forces, falls with the width, and moves with the place,
        along the strip as smoothly as the cover is thick.

        Parameters
        ----------
        other : FrameContacts
            As many.
        depth : float
            Thickness of the cover [m].
        """
        largest = np.abs(self.forces).max(initial=np.finfo(float).tiny)
        return float(
            2 * np.abs(other.forces - self.forces).max(initial=0.0) / largest
            + np.abs(other.places - self.places).max(initial=0.0) / depth
            + np.abs(other.widths / self.widths - 1).max(initial=0.0)
        )


@dataclass(frozen=True, eq=False)
class StrainPhases:
    """What strain adds in F frames, about one design.

    Attributes
    ----------
    centre : ndarray, shape (d,)
        Entries of the design.
    solved : tuple of FrameContacts or None, length F
        At which each frame was solved; None for what has no contacts, or folds under them.
    added : ndarray, shape (1 + d, F, G)
        At the places of `ContactPhases.grid`, then its slopes by the entries [rad].
    sloped : tuple of FrameContacts or None, length F
        At which the slopes of each frame were found.
    """

    centre: Array
    solved: tuple[FrameContacts | None, ...]
    added: Array
    sloped: tuple[FrameContacts | None, ...]

    @classmethod
    def none(cls, centre: Array, frames: int, places: int) -> StrainPhases:
        """Before any frame was solved."""
        nothing = (None,) * frames
        return cls(centre, nothing, np.zeros((1 + len(centre), frames, places)), nothing)

    def added_at(self, design: Array) -> Array:
        """What strain adds at a design near the centre, shape (F, G) [rad]."""
        return np.asarray(self.added[0] + np.tensordot(design - self.centre, self.added[1:], 1))

    def about(
        self,
        sensor: Sensor,
        paths: tuple[str, ...],
        design: Array,
        grid: Array,
        contacts: Sequence[FrameContacts],
        near: float,
    ) -> StrainPhases:
        """The same about another design, with those frames solved anew whose contacts moved.

        Parameters
        ----------
        sensor : Sensor
            The drawing.
        paths : tuple of str, length d
            Values of the design that are unknown.
        design : ndarray, shape (d,)
            Their entries.
        grid : ndarray, shape (G,)
            Places along the strip [m].
        contacts : sequence of FrameContacts, length F
            As they are known.
        near : float
            Change of the phase, to first order, below which a frame is not solved anew [rad].
        """
        off = design - self.centre
        added, solved, sloped = self.added.copy(), list(self.solved), list(self.sloped)
        depth = sensor.transducer.compliant.thickness
        added[0] = self.added_at(design)
        effect = np.array([path in EFFECTS for path in paths], dtype=bool)
        made = varied(sensor, paths, design)
        beside = [
            None if own else varied(sensor, paths, design + step)
            for own, step in zip(effect, STEP * np.eye(len(paths)), strict=True)
        ]
        # slopes took care of the first order
        bent = float(np.square(off[~effect]).sum())
        for f, own in enumerate(contacts):
            size = float(np.abs(added[0, f]).max())
            moved = _moved(solved[f], own, depth)
            if np.isfinite(moved) and (moved + bent) * size < near:
                continue
            carried = _moved(sloped[f], own, depth) < CARRIED
            found = _solved(sensor, made, beside, grid, own, added[1:, f] if carried else None)
            added[:, f] = 0.0 if found is None else found
            solved[f] = None if found is None else own
            if found is None or not carried:
                sloped[f] = solved[f]
        return StrainPhases(design, tuple(solved), added, tuple(sloped))


def _moved(before: FrameContacts | None, own: FrameContacts, depth: float) -> float:
    """`FrameContacts.moved` from contacts that were solved; infinite from other numbers of them."""
    if before is None or len(before.widths) != len(own.widths):
        return np.inf
    return before.moved(own, depth)


def _solved(
    drawn: Sensor,
    made: Sensor,
    beside: Sequence[Sensor | None],
    grid: Array,
    own: FrameContacts,
    slopes: Array | None,
) -> Array | None:
    """What strain adds in a frame, and its slopes, shape (1 + d, G) [rad].

    Slopes are found, from designs beside, if not given.  None without contacts, and where the
    surface folds: then the frame will contradict the others.
    """
    if not len(own.widths):
        return None
    try:
        share = share_of_contacts(drawn, own.widths)
        here = _added(made, grid, own, share)
        if slopes is None:  # the phase is proportional to the effect
            rises = [
                here if one is None else (_added(one, grid, own, share) - here) / STEP
                for one in beside
            ]
            slopes = np.reshape(rises, (len(beside), len(grid)))
    except InputError:
        return None
    return np.concatenate([here[None], slopes])


def _added(made: Sensor, grid: Array, own: FrameContacts, share: float) -> Array:
    """What strain adds at places of a strip under contacts, shape (G,) [rad].

    On elements as of readings: contacts are patches, as those of tactels, with such a share of
    their width, or tractions of a skin.
    """
    if made.skin is not None:
        each = zip(own.places, own.widths, own.forces, strict=True)
        return SkinStrain(made, grid).under([rounded(x, width, force) for x, width, force in each])
    strip = finite_strip(
        made.transducer,
        own.places,
        own.widths,
        order=ELEMENT_ORDER,
        share=share,
        growth=STEEP,
    )
    return added_phase(made, strip, grid, own.forces)
