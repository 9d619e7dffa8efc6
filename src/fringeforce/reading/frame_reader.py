"""One frame to one reading: the check of frames and masks, and what strips and pads have to add."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import isfinite, prod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.arrays import Index
from fringeforce.base.errors import InputError
from fringeforce.estimation.hypotheses import CONFIDENCE
from fringeforce.models.creep import Creep
from fringeforce.reading.batch import Batch, Progress, grey_levels
from fringeforce.reading.creep import CreepFilter
from fringeforce.reading.reading import Reading, Status

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FOLLOWING_STEPS = 12
"""Steps in which an explanation must be reached from that of another frame; slow motion takes
three."""


def check_friction(sensor: Any, friction: float | None) -> None:
    """Raise InputError for a coefficient of friction that readings of a sensor do not take."""
    if friction is None:
        return
    if not friction > 0:
        raise InputError(
            f"friction = {friction}: must be greater than 0; leave it out for no limits."
        )
    if sensor.dimensions > 1:
        if sensor.skin is None:
            raise InputError("friction is for strips; read a pad without it.")
        raise InputError("The friction of a pad's skin is that of its design; change it there.")


@dataclass(frozen=True, eq=False)
class FrameReader(ABC):
    """Reads frames of one sensor, each for itself.

    Attributes
    ----------
    model : SensorModel or PadModel
        The characterised sensor.
    friction : float or None
        If given, forces are limited to N >= 0 and |T| <= friction N; strips only.
    confidence : float
        Probability from which a reading is OK.
    """

    model: Any
    friction: float | None = None
    confidence: float = CONFIDENCE

    def __post_init__(self) -> None:
        check_friction(self.model.sensor, self.friction)
        if not 0 < self.confidence < 1:
            raise InputError(
                f"confidence = {self.confidence}: must be a probability between 0 and 1, such as "
                "0.999."
            )

    @abstractmethod
    def search(self, levels: NDArray[Any], used: Mask, start: Array | None = None) -> Reading:
        """Read a frame that was checked, or raise InputError if it cannot be read like this.

        Parameters
        ----------
        levels : ndarray, shape (P,)
            Grey levels in one row.
        used : ndarray of bool, shape (P,)
            Pixels to use.
        start : ndarray, shape (n, components), optional
            Forces to start from instead of a search [N].
        """

    @abstractmethod
    def bound(self, forces: ArrayLike) -> Array:
        """Smallest deviations that an unbiased reading can have, shape (n, components) [N]."""

    @abstractmethod
    def phase(self, forces: Array) -> Array:
        """Phase lead, or retardance, that forces (n, components) cause [rad]."""

    @abstractmethod
    def trial(self, share: float, rng: np.random.Generator) -> NDArray[Any]:
        """A frame of a share of the loads that take a reader through all that it compiles."""

    @abstractmethod
    def turned(self, pixels: Index) -> Iterator[tuple[str, Index]]:
        """Other ways in which a camera may look at the sensor, in words, and what it then sees.

        Parameters
        ----------
        pixels : ndarray of int, shape (channels, P) or (channels, rows, columns)
            Numbers of the pixels of a frame.
        """

    @cached_property
    def relaxes(self) -> bool:
        """Whether frames show earlier loads too."""
        return len(Creep.of(self.model.sensor.transducer).amounts) > 0

    def creep_filter(self, history: float) -> CreepFilter | None:
        """What takes creep out of readings in a row, of a sensor that relaxes.

        Parameters
        ----------
        history : float
            Standard deviation of the forces that acted for long before the first frame [N].
        """
        return CreepFilter(self.model.sensor, history) if self.relaxes else None

    def read(
        self, frame: ArrayLike, mask: ArrayLike | None = None, start: ArrayLike | None = None
    ) -> Reading:
        """Read one frame without any earlier state; see `fringeforce.Reader.search`."""
        used = self.usable(mask)
        if isinstance(levels := self.checked(frame, used), Reading):
            return levels
        return self.search(levels, used, None if start is None else np.asarray(start, dtype=float))

    @property
    def forces_shape(self) -> tuple[int, int]:
        """Shape of the forces of one frame, (n, components)."""
        sensor = self.model.sensor
        return sensor.tactels.total, len(sensor.components)

    @cached_property
    def usable_pixels(self) -> Mask:
        """Pixels that may be used where there is no mask, in one row."""
        return np.ones(prod(self.model.frame_shape), dtype=bool)

    @cached_property
    def _complete(self) -> bool:
        return bool(self.usable_pixels.all())

    def complete(self, used: Mask) -> bool:
        """Whether all pixels are used; known without a look where there is no mask."""
        return self._complete if used is self.usable_pixels else bool(used.all())

    def usable(self, mask: ArrayLike | None) -> Mask:
        """Pixels of a frame to use, in one row, under a mask of those to leave out.

        Raises
        ------
        InputError
            If the mask does not fit the sensor, or leaves fewer than two pixels for each unknown.
        """
        usable, shape = self.usable_pixels, self.model.frame_shape
        if mask is None:
            return usable
        masked, least = np.asarray(mask, dtype=bool), 2 * prod(self.forces_shape)
        last = self._masked.get("last")
        if last is not None and np.array_equal(masked, last[0]):
            return last[1]
        if masked.shape != shape or (usable & ~masked.ravel()).sum() <= least:
            raise InputError(
                f"A mask of shape {masked.shape} with {int((~masked).sum())} pixels to use does "
                f"not fit; this sensor's frames have the shape {shape} and need more than {least} "
                "of them."
            )
        self._masked["last"] = masked.copy(), usable & ~masked.ravel()
        return self._masked["last"][1]

    @cached_property
    def _masked(self) -> dict[str, tuple[Mask, Mask]]:
        """The last mask and the pixels that it leaves, for a mask that stays is known at once."""
        return {}

    def checked(self, frame: ArrayLike, used: Mask) -> NDArray[Any] | Reading:
        """A frame's grey levels in one row if they can be used, or a reading that says why not."""
        try:
            levels = grey_levels(frame)
        except (TypeError, ValueError):  # an InputError is one
            return self.bad(f"It holds {type(frame).__name__}, not grey levels.")
        if levels.shape != (shape := self.model.frame_shape):
            return self.bad(f"It has the shape {levels.shape}; this sensor's frames have {shape}.")
        levels = levels.ravel()
        problem = self._problem(levels, used)
        return self.bad(problem) if problem else levels

    def suspicious(self, levels: NDArray[Any], used: Mask) -> Mask:
        """Which of k frames, shape (k, P), may be unusable; `checked` tells."""
        bad = np.zeros(len(levels), dtype=bool)
        seen = levels if self.complete(used) else levels[:, used]
        doubtful = np.arange(len(levels))
        if self._always_in_range(levels):
            doubtful = np.flatnonzero(seen[:, 0] == seen[:, -1])
        if len(doubtful):
            low, high = seen[doubtful].min(axis=1), seen[doubtful].max(axis=1)
            full_scale = self.model.sensor.camera.full_scale
            bad[doubtful] = ~((low >= 0) & (high <= full_scale) & (low < high))
        return bad

    def bad(self, detail: str) -> Reading:
        """The reading of a frame that cannot be used."""
        nothing = np.zeros(self.forces_shape)
        return Reading.of(
            forces=nothing * np.nan,
            chi2=np.nan,
            status=Status.BAD_FRAME,
            detail=detail,
            covariance=np.full((nothing.size, nothing.size), np.nan),
            phase=lambda: np.nan * self.phase(nothing),
        )

    def _always_in_range(self, levels: NDArray[Any]) -> bool:
        """Whether all grey levels of this type are in the converter's range."""
        return levels.dtype.str in self._types_in_range

    @cached_property
    def _types_in_range(self) -> list[str]:
        types = (np.dtype(kind) for kind in ("u1", "u2"))
        most = self.model.sensor.camera.full_scale
        return [kind.str for kind in types if np.iinfo(kind).max <= most]

    def _problem(self, levels: NDArray[Any], used: Mask) -> str:
        camera = self.model.sensor.camera
        seen = levels if self.complete(used) else levels[used]
        if self._always_in_range(levels) and seen[0] != seen[-1]:
            return ""  # without a look at all pixels
        darkest, brightest = float(seen.min()), float(seen.max())
        if not isfinite(darkest + brightest):
            return f"{int((~np.isfinite(seen)).sum())} pixels are not a number."
        if darkest < 0 or brightest > camera.full_scale:
            return (
                f"Grey levels from {darkest:g} to {brightest:g} exceed the converter's 0 to "
                f"{camera.full_scale}."
            )
        if darkest == brightest and self.model.sensor.noise.max() > 0.5:
            return f"All pixels are {darkest:g}."
        return ""


class Follower(ABC):
    """Reads the frames of one sensor in the order in which they were taken."""

    @abstractmethod
    def reset(self) -> None:
        """Forget the last reading: the next frame is searched."""

    def expect(self, times: Array, scales: Array) -> None:  # noqa: B027, most need not know
        """Take the times of the next frames of a sensor that relaxes, in the place of others.

        Parameters
        ----------
        times : ndarray, shape (k,)
            Of the frames [s].
        scales : ndarray, shape (k,)
            Of their phases, over those at the temperature of the design.
        """

    @abstractmethod
    def read(self, levels: NDArray[Any], used: Mask) -> Reading:
        """Read the next frame, which was checked, shape (P,)."""

    @abstractmethod
    def read_on(
        self, levels: NDArray[Any], used: Mask, batch: Batch, progress: Progress | None = None
    ) -> None:
        """Fill in the readings of the next frames, shape (k, P), which were not checked."""


class FrameByFrame(Follower):
    """Reads frames one by one.

    Parameters
    ----------
    single : FrameReader
        What reads single ones.
    """

    def __init__(self, single: FrameReader) -> None:
        self.single = single
        self.reset()

    def skip(self) -> None:
        """Let a frame pass that cannot be used."""

    def read_on(
        self, levels: NDArray[Any], used: Mask, batch: Batch, progress: Progress | None = None
    ) -> None:
        """Fill in the readings of the next frames, shape (k, P), which were not checked."""
        for row, frame in enumerate(levels):
            found = self.single.checked(frame.reshape(self.single.model.frame_shape), used)
            if isinstance(found, Reading):
                self.skip()
            else:
                found = self.read(found, used)
            batch.store(row, found)
            if progress is not None:
                progress(1)
