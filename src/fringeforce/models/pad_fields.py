"""Smooth random fields of a pad: uneven light and residual retardance, as unknowns."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array, Single
from fringeforce.design.pad import Pad
from fringeforce.models import splines
from fringeforce.models.as_built import LIGHT_LENGTH, RESIDUAL
from fringeforce.models.pad_influence import PadInfluence
from fringeforce.models.pad_slices import block_of
from fringeforce.models.smooth_field import SmoothField

FAINTEST = 2e-6
"""Variance of a mode of a smooth field, relative to the largest, below which it is left out: of an
unevenness of 5 % that leaves .1 grey levels in the corners.  The .8 that 1e-4 would leave there are
more than the noise of a calibration's frames together."""


def shades_of(pad: Pad) -> SmoothField:
    """Share by which every pixel of a pad under uneven light is brighter."""
    (x, y), block = pad.pixel_positions, pad.transducer
    lengths = LIGHT_LENGTH * block.width, LIGHT_LENGTH * block.length
    return SmoothField.of((y, x), lengths, pad.camera.unevenness, FAINTEST)


@dataclass(frozen=True, eq=False)
class PadResidual:
    """Residual retardance, the same at all depths: two parts of k unknowns, one after the other.

    Attributes
    ----------
    base : PadInfluence
        Whose nodes and depth profiles are taken.
    field : SmoothField
        One part at the nodes [rad], over both passes.
    even : ndarray, shape (modes,)
        Depth profiles of a retardance of unit depth integral over both passes that is the same at
        all depths.
    """

    base: PadInfluence
    field: SmoothField
    even: Array

    @classmethod
    def of(cls, pad: Pad, base: PadInfluence) -> PadResidual:
        """That of a pad's tolerance, in depth profiles of which one is even."""
        length, std = pad.polariscope.residual_length, pad.tolerances[RESIDUAL]
        weights = block_of(pad).depths(len(base.profile))[1]
        even, *_ = np.linalg.lstsq(base.profile, weights / (2 * weights.sum()))
        return cls(base, SmoothField.of((base.y, base.x), (length, length), std, FAINTEST), even)

    def __len__(self) -> int:
        return 2 * len(self.field)

    @cached_property
    def _splines(self) -> SmoothField:
        """The field as coefficients of splines."""
        across, along = (splines.coefficients(nodes).T for nodes in (self.base.y, self.base.x))
        return self.field.turned(across, along)

    def coefficients(self, unknowns: Array) -> Single:
        """Spline coefficients of the retardance, shape (2, modes, ny, nx) [rad]."""
        fields = self._splines.field(unknowns.reshape(2, -1))
        return np.asarray(self.even[:, None, None] * fields[:, None], dtype=np.float32)

    def adjoint(self, grid: Single) -> Array:
        """Derivatives by the unknowns (2 k,) from that by spline coefficients."""
        fields = np.einsum("fkyx,k->fyx", grid, self.even)
        return self._splines.adjoint(fields).ravel()

    def at(self, x: Array, y: Array) -> tuple[Single, Single]:
        """Modes of one part at all pairs of places [m], and depth profiles.

        The modes have shape (k, len(y) * len(x)).
        """
        across, along = (
            splines.basis(nodes, places).T for nodes, places in ((self.base.y, y), (self.base.x, x))
        )
        return self._splines.turned(across, along).modes(), self.even.astype(np.float32)

    def square(self, squares: Array) -> float:
        """Mean square of both parts over the pad, from those of the unknowns (2 k,) [rad^2]."""
        return self.field.square(squares.reshape(2, -1).sum(axis=0) / 2)
