"""Creep of earlier loads on a skin, which is known before a frame is read.

A frame shows the contacts of its own time, and what lags behind those before:

    p = Psi f + sum_k c_k p_k,    dp_k / dt = r_k (Psi f - p_k),

the lags of `models.creep`, in the place of forces of what these cause: contacts have moved, and no
few of them cause what they left.  It is the phase at the nodes of a strip, and the harmonics of the
tractions of a pad, whose light is not linear in them.  Loads are linear from one frame to the next,
so that the lags are known, and a share of the load of the frame itself.  Contacts are found in what
they leave, and their forces are less by that share.
"""

from __future__ import annotations

from abc import abstractmethod
from collections import deque
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import InputError
from fringeforce.estimation.residual_test import FALSE_VERDICT, square_limit
from fringeforce.models.creep import Crept
from fringeforce.reading.creep import FADING, UncertainCreep
from fringeforce.reading.frame_reader import Follower, FrameByFrame, FrameReader
from fringeforce.reading.reading import Reading, Status


class EarlierLoads:
    """What earlier loads add to the frames of a sensor that relaxes.

    Parameters
    ----------
    uncertain : UncertainCreep
        Of the sensor.
    shape : tuple of int
        Of what loads cause.
    """

    def __init__(self, uncertain: UncertainCreep, shape: tuple[int, ...]) -> None:
        self._ways, self._shape = uncertain.ways(), shape
        self.reset()

    def reset(self) -> None:
        """Forget all earlier loads."""
        self._time: float | None = None
        self._lags = [np.zeros((len(way.rates), *self._shape)) for way in self._ways]
        self._before = [np.zeros(self._shape)] * len(self._ways)
        self._shown = np.zeros(self._shape)
        self.expect(0.0)

    def expect(self, time: float, scale: float = 1.0) -> None:
        """Find what creep adds to the next frame, `now`.

        Parameters
        ----------
        time : float
            Of the frame [s].
        scale : float
            Of what it shows, over that at the temperature of the design.

        Raises
        ------
        InputError
            If the time lies before that of the last frame.
        """
        interval = time - (time if self._time is None else self._time)
        if not interval >= 0:
            raise InputError(
                f"A frame at {time:g} s follows one at {self._time:g} s; times must not descend."
            )
        self._next, self._scale = time, scale
        self._left, self._new, self._shares, self._known = [], [], [], []
        for way, lags, before in zip(self._ways, self._lags, self._before, strict=True):
            kept, own, new = way.weights(interval)
            faded = kept.reshape(-1, *[1] * len(self._shape)) * lags
            left = faded + np.multiply.outer(own, before)
            self._left.append(left)
            self._new.append(new)
            self._shares.append(1 / (1 + float(way.amounts @ new)))
            self._known.append(np.tensordot(way.amounts, left, 1))
        drawn, share = self._known[0], self._shares[0]
        modes = [
            known - drawn + (share / own - 1) * self._shown
            for known, own in zip(self._known[1:], self._shares[1:], strict=True)
        ]
        missed = self._ways[0].ripple * drawn
        self.now = Crept(scale * drawn, scale * np.array([*modes, missed]))

    @property
    def share(self) -> float:
        """Load of the frame that is expected, over what it shows beside `now`."""
        return self._shares[0]

    def passed(self, shown: Array | None) -> float:
        """Take what the frame that was expected shows beside `now`; None if nothing acts.

        Returns the relative deviation of the share, of that part of it that the modes, which take
        the load of the frame before, do not have.
        """
        before, self._shown = self._shown, np.zeros(self._shape)
        relative = 0.0
        if shown is not None:
            self._shown = shown / self._scale
            change, size = np.linalg.norm(self._shown - before), np.linalg.norm(self._shown)
            ratios = np.array(self._shares) / self.share - 1
            relative = float(np.linalg.norm(ratios) * min(change / max(size, 1e-12), 1.0))
        self._time, whole = self._next, self._known[0] + self._shown
        for k, new in enumerate(self._new):
            caused = np.zeros(self._shape)
            if shown is not None:
                caused = self._shares[k] * (whole - self._known[k])
            self._lags[k] = self._left[k] + np.multiply.outer(new, caused)
            self._before[k] = caused
        return relative


class SkinFrames(FrameByFrame):
    """Follows the frames of a skin; what creep adds to the next one is set before it is read.

    Attributes
    ----------
    crept : Crept or None
        What creep of earlier loads adds; None of a skin that does not relax.
    """

    crept: Crept | None = None

    @property
    @abstractmethod
    def shape(self) -> tuple[int, ...]:
        """Shape of what contacts cause, as of `Crept`."""

    @abstractmethod
    def caused(self, reading: Reading) -> Array | None:
        """What the contacts of the last reading cause; None if they are not known."""

    @abstractmethod
    def shows(self, crept: Crept) -> bool:
        """Whether noise does not hide what creep adds to a frame without contacts."""


class CreepFollower(FrameByFrame):
    """Follows the frames of a skin that relaxes.

    Parameters
    ----------
    frames : SkinFrames
        What follows frames with what creep adds to them.
    """

    def __init__(self, frames: SkinFrames) -> None:
        self._frames = frames
        self._earlier = EarlierLoads(UncertainCreep(frames.single.model.sensor), frames.shape)
        super().__init__(frames.single)

    def reset(self) -> None:
        """Forget the last reading, and all earlier loads."""
        self._frames.reset()
        self._earlier.reset()
        self._coming = deque[tuple[float, float]]()

    def expect(self, times: Array, scales: Array) -> None:
        """Take the times of the next frames, as of `Follower.expect`."""
        self._coming = deque(zip(times.tolist(), scales.tolist(), strict=True))

    def skip(self) -> None:
        """Let a frame pass that cannot be used, with its time."""
        if self._coming:
            self._coming.popleft()

    def read(self, levels: NDArray[Any], used: Mask) -> Reading:
        """Read the next frame, which was checked, shape (P,)."""
        frames, earlier = self._frames, self._earlier
        if self._coming:
            earlier.expect(*self._coming.popleft())
        frames.crept = earlier.now
        found = frames.read(levels, used)
        if found.status is Status.NO_CONTACT:
            earlier.passed(None)
            return found.saying(FADING) if frames.shows(earlier.now) else found
        if found.ok and _is_nothing(found):
            earlier.passed(None)
            return found.scaled(earlier.share).fading(FADING)
        relative = 0.0
        if found.status.usable and (caused := frames.caused(found)) is not None:
            relative = earlier.passed(caused)
        return found.scaled(earlier.share, relative)


def _is_nothing(found: Reading) -> bool:
    """Whether the force of all contacts is no more than its deviations leave of none."""
    assert found.total is not None
    force, covariance = found.total.force, found.total.force_covariance
    square = float(force @ np.linalg.solve(covariance, force))
    return square < square_limit(len(force), FALSE_VERDICT)


def following(frames: SkinFrames) -> Follower:
    """What follows the frames of a skin, whether it relaxes or not."""
    return CreepFollower(frames) if frames.single.relaxes else frames


def check_rest(single: FrameReader, history: float) -> None:
    """Raise InputError where loads before the first frame of a skin that relaxes are stated."""
    if history and single.relaxes:
        raise InputError(
            f"history = {history:g} N is of tactels; of a skin nothing is known before its first "
            "frame: begin when it is at rest, and leave the history out."
        )
