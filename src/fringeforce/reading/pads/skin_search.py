"""Starts for frames of a pad's skin: forces on coarse squares, divided into contacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.cluster.vq import kmeans2
from scipy.ndimage import label

from fringeforce.base.arrays import Array, Index
from fringeforce.design.pad import Pad
from fringeforce.models.pad_skin import FIRST_SHAPE, PLACE, SHAPE, SIZE_OF

TOUCHED_SHARE = 0.05
"""Share of the largest normal force on a square above which a square is touched: what a contact
finer than the squares leaves beside it is less."""
WEAK_SHARE = 0.01
"""Share of all normal forces below which touched squares are none of a contact."""
FIRST_AXES = 0.8, 2.4
"""Half axes of a contact that is looked for at first, in thicknesses of the cover: small ones, for
contacts that are too small leave more out."""


@dataclass(frozen=True, eq=False)
class Patches:
    """Squares that belong to one contact each.

    Attributes
    ----------
    pad : Pad
        The design.
    forces : ndarray, shape (n, 3)
        Forces on all squares [N].
    members : tuple of ndarray of int
        Numbers of the squares of each contact.
    """

    pad: Pad
    forces: Array
    members: tuple[Index, ...]

    @classmethod
    def of(cls, pad: Pad, forces: Array, least: float = 0.0) -> Patches:
        """Touched squares that are neighbours belong together, if they press more than this [N]."""
        count = pad.tactels.count
        normal = forces[:, 0].reshape(count)
        labels = np.empty(count, dtype=int)
        label(normal > TOUCHED_SHARE * normal.max(), structure=np.ones((3, 3)), output=labels)
        flat = labels.ravel()
        groups = [np.flatnonzero(flat == k) for k in range(1, flat.max() + 1)]
        least = max(WEAK_SHARE * float(normal.sum()), least)
        return cls(pad, forces, tuple(g for g in groups if forces[g, 0].sum() > least))

    @property
    def strongest(self) -> Patches:
        """The same with the contact that presses hardest alone."""
        own = max(self.members, key=lambda group: float(self.forces[group, 0].sum()))
        return Patches(self.pad, self.forces, (own,))

    def divided(self, which: int) -> Patches | None:
        """The same with one contact as two, if it has squares enough."""
        own = self.members[which]
        if len(own) < 2:
            return None
        places, weights = self.pad.tactels.places[own], self.forces[own, 0]
        centre = weights @ places / weights.sum()
        apart = places - centre
        _, vectors = np.linalg.eigh((weights[:, None] * apart).T @ apart)
        side = apart @ vectors[:, -1]
        ends = places[[side.argmin(), side.argmax()]]
        _, belongs = kmeans2(places, ends, minit="matrix")
        parts = [own[belongs == k] for k in (0, 1)]
        if not all(len(part) and self.forces[part, 0].sum() > 0 for part in parts):
            return None
        rest = [group for k, group in enumerate(self.members) if k != which]
        return Patches(self.pad, self.forces, (*rest, *parts))

    @property
    def contacts(self) -> Array:
        """Unknowns of the contacts, as of `PadSkinModel`, without shapes."""
        found = np.zeros((len(self.members), SIZE_OF))
        tactels, cover = self.pad.tactels, self.pad.transducer.compliant.thickness
        for one, own in zip(found, self.members, strict=True):
            forces, places = self.forces[own], tactels.places[own]
            weights = np.maximum(forces[:, 0], 0)
            one[:PLACE] = forces.sum(axis=0)
            one[0] = weights.sum()
            one[PLACE:SHAPE] = weights @ places / one[0]
            apart = places - one[PLACE:SHAPE]
            spread = (weights[:, None] * apart).T @ apart / one[0]
            # squares spread what is finer; contacts that are too small leave more out at first
            size, vectors = np.linalg.eigh(5 * (spread - np.eye(2) * tactels.side**2 / 12))
            half = np.sqrt(
                np.clip(size, (FIRST_AXES[0] * cover) ** 2, (FIRST_AXES[1] * cover) ** 2)
            )
            log = vectors @ np.diag(np.log(half)) @ vectors.T
            one[SHAPE:FIRST_SHAPE] = np.trace(log) / 2, (log[0, 0] - log[1, 1]) / 2, log[0, 1]
        return found
