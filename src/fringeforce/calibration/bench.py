"""A bench: what was measured, how it is modelled, and where its shared unknowns stand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from fringeforce.base.arrays import Array, Index
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.columns import Columns
from fringeforce.calibration.contact_phase import ContactPhases
from fringeforce.calibration.strain_phase import StrainPhases
from fringeforce.estimation.frame_model import FrameModel, Layout

SHIFT, SCALE = 1e-3, 1e-2
"""Units of the camera's shift [m] and scale."""
LAMP = 2
"""Unknowns of the lamp of one frame: gain and offset."""


class Parts(NamedTuple):
    """Where the shared unknowns stand; `size` is their number."""

    design: int
    camera: int
    height: int
    slope: int
    residual: int
    bright: int
    dark: int
    blur: int
    gamma: int
    crosstalk: int
    written: int
    size: int

    def own(self, name: str) -> slice:
        """Unknowns of one part."""
        number = self._fields.index(name)
        return slice(self[number], self[number + 1])

    def resized(self, name: str, count: int) -> Parts:
        """The same with so many unknowns of one part."""
        number = self._fields.index(name)
        more = count - (self[number + 1] - self[number])
        return Parts(*(place + more * (k > number) for k, place in enumerate(self)))


def parts(
    design: int, columns: int, fields: int, bright: int, dark: int, crosstalk: int, written: int
) -> Parts:
    """Places of the shared unknowns, from the numbers of each; columns have two kinds of errors."""
    light = bright, dark, 1, 1, crosstalk
    return Parts(*accumulate([0, design, 2, columns, columns, fields, *light, written]))


class BenchContacts:
    """Contacts of the frames of a bench."""

    if TYPE_CHECKING:  # fields of frozen dataclasses, which a property would be a default of

        @property
        def loads(self) -> BenchLoads:
            """What was measured of the loads."""
            ...

        @property
        def which(self) -> Index:
            """Contacts of every frame."""
            ...

    @cached_property
    def largest(self) -> float:
        """Largest force of a contact [N]."""
        return float(np.nanmax(np.linalg.norm(self.loads.forces, axis=-1), initial=1e-3))

    @cached_property
    def contacts_of(self) -> list[Index]:
        """Which of the k contacts each frame has."""
        return [np.flatnonzero(row >= 0) for row in self.which]


@dataclass(frozen=True, eq=False)
class Bench(BenchContacts):
    """What was measured and how it is modelled; F frames of at most k contacts, P pixels, m nodes.

    Attributes
    ----------
    frames : ndarray, shape (F, P)
        Grey levels; not finite where a pixel is not used.
    which : ndarray of int, shape (F, k)
        Which of the places of `contacts` each contact has; -1 where there is none.
    beside : ndarray, shape (F, k)
        How far contacts are written down beside those places [m].
    loads : BenchLoads
        As written down.
    contacts : ContactPhases
        Phase of contacts at these places.
    template : FrameModel
        Of a frame: nodes, fields, light without that of single frames, lens.
    places : ndarray, shape (s,)
        Of the samples between the nodes along the frame, where a camera as drawn looks [m].
    at : Parts
        Where the shared unknowns stand.
    lamp : ndarray, shape (2, 2, C m)
        Changes of amplitude and offset with the gain and the offset of one frame.
    averaged : ndarray, shape (F,)
        How many frames each row is the mean of.
    turned : ndarray, shape (F,)
        Phase that the analyser adds [rad].
    moves : tuple of ndarray, length F, shape (l, w) each
        What unknowns of the loads' list, such as the zero of its places, change in what is expected
        of the own unknowns of a frame.
    columns : Columns, optional
        Errors that the columns of tactels may have.
    strain : StrainPhases, optional
        What large strain adds; none where strain is small.
    """

    frames: Array
    which: Index
    beside: Array
    loads: BenchLoads
    contacts: ContactPhases
    template: FrameModel
    places: Array
    at: Parts
    lamp: Array
    averaged: Array
    turned: Array
    moves: tuple[Array, ...]
    columns: Columns | None = None
    strain: StrainPhases | None = None

    @cached_property
    def layouts(self) -> list[Layout]:
        """Where the unknowns of a frame's model stand, by the number of its contacts."""
        fields, modes = len(self.template.fields), len(self.template.brightness) + LAMP
        more = np.array([fields, modes, 0, 1, 1, len(self.template.leaks)])
        return [
            Layout(2 * k, 2 * k, 3 * k, 4 * k, *(4 * k + np.cumsum(more)).tolist())
            for k in range(self.which.shape[1] + 1)
        ]

    @cached_property
    def splits(self) -> list[tuple[Index, Index]]:
        """Which of these are a frame's own, and which are shared."""
        found = []
        for at in self.layouts:
            lamp = np.arange(at.modes, at.modes + LAMP)
            mine = np.concatenate([np.arange(at.fields), lamp])
            found.append((mine, np.delete(np.arange(at.size), mine)))
        return found

    @cached_property
    def light(self) -> tuple[Array, Array]:
        """Changes of amplitude and offset with the lamp of one frame, and with what is shared."""
        bright, dark = self.lamp
        return (
            np.concatenate([bright, self.template.brightness]),
            np.concatenate([dark, self.template.darkness]),
        )

    def positions(self, shared: Array, drawn: Array) -> Array:
        """Where pixels or samples look that look at `drawn` as designed [m]."""
        shift, scale = shared[self.at.own("camera")]
        return shift * SHIFT + (1 + scale * SCALE) * drawn
