"""What other layers change of the retardance under known forces, by harmonics of these.

`PadUncertainty` knows the change of the whole influence, by three solutions for every tactel, which
takes seconds.  Of forces that are known the harmonics are summed first: a value of the layers takes
two solutions for single waves, once, and a frame some milliseconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array, Single
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import Tolerances, with_values
from fringeforce.mechanics.solid.block import Block, Patches
from fringeforce.mechanics.solid.fourier import load_harmonics, tractions_of
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_departures import PadDeparture
from fringeforce.models.pad_slices import DIGITS, block_of, profile_waves
from fringeforce.models.pad_synthesis import Synthesis


@dataclass(frozen=True, eq=False)
class LayerChanges:
    """Derivatives of the retardance by sizes and materials of the layers, at roller sides.

    Attributes
    ----------
    model : PadModel
        Of a pad of tactels.
    departures : sequence of PadDeparture
        Values of its layers, with what counts as one of each.
    """

    model: PadModel
    departures: Sequence[PadDeparture]

    @cached_property
    def _changes(self) -> tuple[Array, Array, list[Single]]:
        """Wave numbers, and changes (2, modes, 3, m, n) of the waves with one of each value."""
        pad = self.model.sensor.model_copy(update={"tolerances": Tolerances()})
        ends = [
            self._waves(with_values(pad, {one.path: one.unit * (1 + way * one.deviation)}))
            for one in self.departures
            for way in (1.0, -1.0)
        ]
        # as many harmonics of every pad, but for rounding
        m, n = (min(len(one[axis]) for one in ends) for axis in (0, 1))
        waves = [one[2][..., :m, :n] for one in ends]
        pairs = zip(waves[::2], waves[1::2], strict=True)
        changes = [((ahead - behind) / 2).astype(np.float32) for ahead, behind in pairs]
        return ends[0][0][:m], ends[0][1][:n], changes

    def _waves(self, pad: Pad) -> tuple[Array, Array, Array]:
        drawn, profile = self._block, self.model.influence.profile
        digits = DIGITS * pad.transducer.compliant.thickness / drawn.compliant.thickness
        return profile_waves(pad, profile, drawn.depths(len(profile))[1], digits)

    @property
    def _block(self) -> Block:
        return block_of(self.model.sensor)

    @cached_property
    def _unit_loads(self) -> list[tuple[Array, Array]]:
        """Harmonics of unit forces on the tactels."""
        tactels, (alpha, beta, _) = self.model.sensor.tactels, self._changes
        return load_harmonics(self._block, Patches(tactels.places, tactels.side), alpha, beta)

    @cached_property
    def _pixels(self) -> list[Synthesis]:
        """From harmonics of tractions to the changes at the pixels."""
        first, *others = self._changes[2]
        sides = self._block.length, self._block.width
        series = Synthesis.of(first, sides, *self.model.pixel_positions)
        return [series, *(replace(series, waves=series.ordered(one)) for one in others)]

    def images(self, forces: Array) -> list[Single]:
        """Derivatives of the retardance of the modes, each (2, modes, rows, columns) [rad].

        Parameters
        ----------
        forces : ndarray, shape (3 n,)
            N, T_x, T_y of tactel after tactel [N].
        """
        if not self.departures:
            return []
        loads = tractions_of(self._unit_loads, forces.reshape(-1, 3)).astype(np.float32)
        return [series.modes(loads) for series in self._pixels]
