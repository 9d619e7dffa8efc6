"""Influence of tactels by the exact series, summed over harmonics when forces are known.

A change of the layers changes the waves that harmonics of tractions cause, which takes two more
solutions for single waves, but none for a tactel; one of the pitch, the harmonics of the forces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Single
from fringeforce.base.linear_map import LinearMap
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import Tolerances, number_at, with_values
from fringeforce.mechanics.solid.block import Patches
from fringeforce.mechanics.solid.fourier import load_harmonics
from fringeforce.models import splines
from fringeforce.models.pad_influence import PadInfluence
from fringeforce.models.pad_slices import DIGITS, block_of, profile_waves
from fringeforce.models.pad_synthesis import Synthesis

Loads = tuple[tuple[Single, Single], ...]
"""Harmonics of unit N, T_x and T_y: along x for the columns of tactels, shape (r, m, columns), and
along y for their rows, (r, n, rows); those of r pairs are added up."""
POWERS = (-0.5, 0.0, 0.5), (0.5, -1.0, 0.5)
"""Half the first and half the second difference of what is behind, at and ahead of a value."""
ROUNDING = 1e-12
"""Share by which a series is longer, so that rounding takes no harmonic from it."""


@dataclass(frozen=True, eq=False)
class PadSeries:
    """Harmonics of tractions on a pad of tactels, and what light sees of them, at roller sides.

    Attributes
    ----------
    pad : Pad
        The design.
    base : PadInfluence
        Whose depth profiles and samples are taken.
    """

    pad: Pad
    base: PadInfluence

    @cached_property
    def _known(self) -> tuple[Array, Array, Array]:
        """Wave numbers, shape (m,) and (n,), and waves, shape (2, modes, 3, m, n) [rad/Pa]."""
        weights = block_of(self.pad).depths(len(self.base.profile))[1]
        return profile_waves(self.pad, self.base.profile, weights)

    @cached_property
    def synthesis(self) -> Synthesis:
        """From harmonics of tractions to spline coefficients."""
        block, (x, y) = block_of(self.pad), (self.base.x, self.base.y)
        waves = self._known[2].astype(np.float32)
        return Synthesis.of(waves, (block.length, block.width), x, y).splines(x, y)

    def at(self, x: Array, y: Array) -> list[tuple[Single, Single]]:
        """From harmonics, in their order, to A and B at places.

        Parameters
        ----------
        x, y : ndarray, shape (c,), (r,)
            Places [m].

        Returns
        -------
        list of (ndarray, ndarray), length 2
            Along x, shape (c, m), and along y, (r, n).
        """
        columns, rows = (
            splines.basis(samples, places).astype(np.float32)
            for samples, places in ((self.base.x, x), (self.base.y, y))
        )
        axes = zip(self.synthesis.along, self.synthesis.across, strict=True)
        return [(columns @ along.whole, rows @ across.whole) for along, across in axes]

    def loads(self, pad: Pad, odd: tuple[int, int] | None = None) -> Loads:
        """Harmonics of unit forces on the tactels of a pad.

        Parameters
        ----------
        pad : Pad
            Whose tactels are taken.
        odd : (int, int), optional
            Mirror signs, as of `Shape`, of point loads in the place of the squares.
        """
        (alpha, beta, _), rows = self._known, pad.tactels.count[1]
        patches = Patches(pad.tactels.places, pad.tactels.side)
        found = load_harmonics(block_of(self.pad), patches, alpha, beta, odd)
        return tuple(
            (x[None, :, ::rows].astype(np.float32), y[None, :, :rows].astype(np.float32))
            for x, y in found
        )

    @cached_property
    def _changes(self) -> dict[tuple[str, float], tuple[SeriesInfluence, ...]]:
        """Those of `changes` that were asked for."""
        return {}

    def changes(self, path: str, std: float) -> tuple[SeriesInfluence, ...]:
        """What the influence changes by with a value and with its square, in deviations.

        Parameters
        ----------
        path : str
            Of a value of the layers.
        std : float
            Its standard deviation, about what the design states.
        """
        if (path, std) not in self._changes:
            drawn = self.pad.model_copy(update={"tolerances": Tolerances()})
            value = number_at(drawn, path)
            assert value is not None
            ends = [with_values(drawn, {path: value[0] + way * std}) for way in (-1.0, 1.0)]
            self._changes[path, std] = self._other(*ends)
        return self._changes[path, std]

    def _other(self, behind: Pad, ahead: Pad) -> tuple[SeriesInfluence, ...]:
        """`changes` from pads with other layers."""
        each = self._waves(behind), self._known[2], self._waves(ahead)
        sums = (np.tensordot(shares, each, 1).astype(np.float32) for shares in POWERS)
        loads = self.loads(self.pad)
        return tuple(SeriesInfluence(self, self.synthesis.ordered(one), loads) for one in sums)

    def _waves(self, pad: Pad) -> Array:
        """Waves of a pad with other layers, for the same harmonics and depth profiles."""
        drawn, profile = block_of(self.pad), self.base.profile
        longer = (1 + ROUNDING) * pad.transducer.compliant.thickness / drawn.compliant.thickness
        weights = drawn.depths(len(profile))[1]
        m, n = self._known[2].shape[-2:]
        return profile_waves(pad, profile, weights, DIGITS * longer)[2][..., :m, :n]


@dataclass(frozen=True, eq=False)
class SeriesInfluence(LinearMap):
    """Retardance per force on tactels, as spline coefficients.

    Attributes
    ----------
    series : PadSeries
        Of the pad.
    waves : ndarray, shape (2, modes, 3, m, n)
        Retardance (A, B) of every depth profile per harmonic of N, T_x and T_y, in their order.
    loads : Loads
        Harmonics of unit forces.
    """

    series: PadSeries
    waves: Single
    loads: Loads

    @property
    def shapes(self) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """As of `PadInfluence`."""
        return self.series.base.shapes

    def forward(self, values: NDArray[np.floating]) -> Single:
        """Spline coefficients (2, modes, ny, nx) under forces (3 n,), as of `PadInfluence`."""
        forces = values.astype(np.float32).reshape(*self.series.base.count, 3)
        harmonics = np.array(
            [
                (x @ forces[..., component] @ y.swapaxes(1, 2)).sum(axis=0)
                for component, (x, y) in enumerate(self.loads)
            ]
        )
        return self._synthesis.modes(harmonics)

    def adjoint(self, values: Single) -> Array:
        """From coefficients, shape (2, modes, ny, nx), to forces, shape (3 n,)."""
        harmonics = self._synthesis.adjoint(values)
        found = [
            (x.swapaxes(1, 2) @ own @ y).sum(axis=0)
            for own, (x, y) in zip(harmonics, self.loads, strict=True)
        ]
        return np.stack(found, axis=-1, dtype=float).ravel()

    def matrix(self, x: Array, y: Array) -> Single:
        """The whole influence at all pairs of places, as of `PadInfluence`."""
        modes, (columns, rows) = self.waves.shape[1], self.series.base.count
        first, second = self.series.synthesis.orders
        found = np.zeros((2, modes, len(y), len(x), columns, rows, 3), dtype=np.float32)
        for part, waves, (to_x, to_y) in zip(found, self.waves, self.series.at(x, y), strict=True):
            for component, pairs in enumerate(self.loads):
                own = waves[:, component].swapaxes(1, 2)
                for load_x, load_y in zip(*pairs, strict=True):
                    # tactels beside each other share half of the sum
                    above = (load_y[second].T[:, None] * to_y).reshape(-1, len(second))
                    along = (load_x[first].T[:, None] * to_x).reshape(-1, len(first))
                    image = (above @ own) @ along.T
                    each = image.reshape(modes, rows, len(y), columns, len(x))
                    part[..., component] += each.transpose(0, 2, 4, 3, 1)
        return found.reshape(2, modes, len(y) * len(x), -1)

    @cached_property
    def _synthesis(self) -> Synthesis:
        return replace(self.series.synthesis, waves=self.waves)
