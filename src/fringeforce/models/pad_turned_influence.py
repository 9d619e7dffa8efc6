"""Influence of a pad whose sizes and materials are off, all of them together.

Waves of harmonics belong to the layers, and harmonics of unit forces to the pitch, so that the
series with the waves of other layers and the harmonics of another pitch is that of both.  A layer's
retardance is in proportion to its optical effect.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Single
from fringeforce.base.linear_map import LinearMap
from fringeforce.design.pad import Pad
from fringeforce.models.pad_influence import PadInfluence
from fringeforce.models.pad_series import Loads, PadSeries, SeriesInfluence


@dataclass(frozen=True, eq=False)
class TurnedInfluence(LinearMap):
    """Retardance per force on tactels, as spline coefficients.

    Attributes
    ----------
    base : PadInfluence
        As drawn.
    added : tuple of SeriesInfluence
        What is added to it.
    share : float
        Optical effect over that of the drawing.
    """

    base: PadInfluence
    added: tuple[SeriesInfluence, ...] = ()
    share: float = 1.0

    @property
    def shapes(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """As of `PadInfluence`."""
        return self.base.shapes

    def forward(self, values: NDArray[np.floating]) -> Single:
        """Spline coefficients (2, modes, ny, nx) under forces (3 n,), as of `PadInfluence`."""
        grid = self.base.forward(values)
        for one in self.added:
            grid += one.forward(values)
        return grid if self.share == 1 else np.float32(self.share) * grid

    def adjoint(self, values: Single) -> Array:
        """From coefficients, shape (2, modes, ny, nx), to forces, shape (3 n,)."""
        found = np.ravel(self.base.adjoint(values)).astype(float)
        for one in self.added:
            found += one.adjoint(values)
        return self.share * found


@dataclass(frozen=True, eq=False)
class TurnedSeries:
    """The series of a pad whose layers and pitch are off.

    Attributes
    ----------
    series : PadSeries
        As drawn.
    waves : ndarray, shape (2, modes, 3, m, n), optional
        Retardance per harmonic, in the order of the series; as drawn if not given [rad/Pa].
    tactels : Pad, optional
        Whose tactels are taken; those that are drawn if not given.
    """

    series: PadSeries
    waves: Single | None = None
    tactels: Pad | None = None

    @property
    def own_waves(self) -> Single:
        """Waves, whether as drawn or not."""
        return self.series.synthesis.waves if self.waves is None else self.waves

    @property
    def own_loads(self) -> Loads:
        """Harmonics of unit forces, whether as drawn or not."""
        return self.series.loads(self.tactels or self.series.pad)

    @property
    def added(self) -> tuple[SeriesInfluence, ...]:
        """What it is more than the series as drawn."""
        found = list[SeriesInfluence]()
        loads = self.own_loads
        if self.waves is not None:
            change = self.waves - self.series.synthesis.waves
            found.append(SeriesInfluence(self.series, change, loads))
        if self.tactels is not None:
            moved = _less(loads, self.series.loads(self.series.pad), 1.0)
            found.append(SeriesInfluence(self.series, self.series.synthesis.waves, moved))
        return tuple(found)

    def by_waves(self, slopes: Single) -> SeriesInfluence:
        """Derivative by a value of the layers, from that of the waves."""
        return SeriesInfluence(self.series, slopes, self.own_loads)

    def by_pitch(self, ends: Sequence[Pad], apart: float) -> SeriesInfluence:
        """Derivative by the pitch from pads a little behind and ahead, so far apart."""
        behind, ahead = (self.series.loads(end) for end in ends)
        return SeriesInfluence(self.series, self.own_waves, _less(ahead, behind, 1 / apart))


def _less(these: Loads, those: Loads, share: float) -> Loads:
    """A share of harmonics less others."""
    some = np.float32(share)
    return tuple(
        (np.concatenate([some * x, -some * before]), np.concatenate([y, across]))
        for (x, y), (before, across) in zip(these, those, strict=True)
    )
