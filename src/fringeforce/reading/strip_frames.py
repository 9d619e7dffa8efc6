"""What readers of strips have in common, whether forces act at tactels or anywhere on a skin."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.base.errors import InputError
from fringeforce.contacts.loads import checked_loads
from fringeforce.estimation.bounds import bounds_of
from fringeforce.estimation.frame_exposure import expose
from fringeforce.estimation.frame_information import information
from fringeforce.models.line_moments import FOLLOWED_STDS
from fringeforce.models.strip import SensorModel
from fringeforce.models.uncertainty import Uncertainty, uncertainty
from fringeforce.reading.frame_light import Lines
from fringeforce.reading.frame_reader import FrameReader
from fringeforce.reading.posterior_search import DENSE
from fringeforce.reading.reading import Reading, Status

HOPELESS_LOSS = 4.0
"""Loss per pixel or bin after a round from which a climb without loads reaches no explanation."""
MISSED = 0.02
"""Share of frames whose best explanation the search misses, measured under many tolerances: it goes
on where the chance that noise leaves as much is smaller."""
STILL_MISSED = 0.001
"""Share that it misses although it goes on: of 4,800 frames under many tolerances 17 were left with
so small a chance, and one of these was read wrong."""
SATURATION = 0.1
"""Share of pixels at full scale that tells of saturation."""


def doubted(probability: float, chance: float, missed: float = MISSED) -> float:
    """Probability of an explanation that leaves what noise leaves with so small a chance.

    A right one leaves as much by chance, and a wrong one, where the right one was missed, often.
    """
    return probability * chance / (chance + missed)


@dataclass(frozen=True, eq=False)
class StripFrames(FrameReader):
    """Reads frames of one strip, each for itself.

    Attributes
    ----------
    noise : float
        Variance of the noise of what is read over that of a frame: 1 / k for the mean of k frames.
    centre : Uncertainty, optional
        What is uncertain, exact at other values than those drawn; about those drawn if not given.
    """

    model: SensorModel
    noise: float = 1.0
    centre: Uncertainty | None = None

    @cached_property
    def uncertain(self) -> Uncertainty:
        """What is uncertain about the strip."""
        found = uncertainty(self.model) if self.centre is None else self.centre
        frame = found.frame._replace(variance=self.noise * found.frame.variance)
        return replace(found, frame=frame)

    @cached_property
    def usable_pixels(self) -> Mask:
        """Pixels that the calibration left in and that surely see the strip, in one row.

        A camera that may be shifted or scaled may see what is beside the strip.
        """
        model, std = self.model, self.model.sensor.tolerances
        half, x = model.sensor.transducer.length / 2, model.pixel_positions
        apart = np.hypot(std.get("camera.shift", 0.0), std.get("camera.scale", 0.0) * x)
        seen = (np.abs(x) > half) | (np.abs(x) + FOLLOWED_STDS * apart <= half)
        whole = np.ones(model.frame_shape, bool) & seen
        return whole.ravel() if model.imaging is None else whole.ravel() & model.imaging.usable

    def turned(self, pixels: Index) -> Iterator[tuple[str, Index]]:
        """End for end, where that is not as well of other forces."""
        x = self.model.pixel_positions
        if self.model.imaging is not None or not np.allclose(x, -x[::-1], rtol=0, atol=x[1] - x[0]):
            yield "it is turned end for end", pixels[:, ::-1]

    def phase(self, forces: Array) -> Array:
        """Phase lead that forces cause, to second order, shape (n_pixels,) [rad]."""
        linear, frame = self.model.phase(forces, strain="linear"), self.uncertain.frame
        if not len(frame.curvature):
            return linear
        loads = forces.ravel()
        return linear + self.at_pixels(np.einsum("a,b,abm->m", loads, loads, frame.curvature))

    def at_pixels(self, nodes: Array) -> Array:
        """Values along the strip from coefficients at the nodes, shape (..., m) to (..., P)."""
        frame, pixels = self.uncertain.frame, slice(self.model.sensor.camera.pixels)
        around = nodes[..., frame.first[pixels, None] + np.arange(4)]
        return np.asarray((around * frame.weights[pixels]).sum(axis=-1))

    @abstractmethod
    def alone(self, levels: NDArray[Any], used: Mask) -> Reading:
        """Read a frame that was checked, without any earlier state."""

    def search(self, levels: NDArray[Any], used: Mask, start: Array | None = None) -> Reading:
        """Read a frame that was checked; strips need no start, and take none."""
        if start is not None:
            raise InputError("start is for pads; a strip is searched as fast without it.")
        return self.alone(levels, used)

    def bound(self, forces: ArrayLike) -> Array:
        """Smallest deviations that an unbiased reading can have, shape (n, 2) [N]."""
        loads = checked_loads(forces, self.model.sensor.tactels.count).ravel()
        model = self.uncertain.under(loads)
        unknowns = np.zeros(model.at.size)
        unknowns[: len(loads)] = loads
        known = information(model, expose(model, unknowns)[0], unknowns, model.fields[:0])
        known[len(loads) :, len(loads) :] += np.eye(len(known) - len(loads))
        return bounds_of(known)[: len(loads)].reshape(self.forces_shape)

    def refusal(self, frame: Array, lines: Lines) -> Status:
        """What is the matter with a frame that nothing explains."""
        seen = np.isfinite(frame)
        if np.mean(frame[seen] >= self.uncertain.frame.full_scale) > SATURATION:
            return Status.SATURATED
        if lines.pace.max() > DENSE:
            return Status.FRINGES_TOO_DENSE
        return Status.MODEL_MISMATCH
