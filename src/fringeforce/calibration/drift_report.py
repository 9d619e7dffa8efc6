"""How far a bench may have drifted since its calibration, and what frames tell of that."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fringeforce.base.arrays import Mask
from fringeforce.base.errors import InputError
from fringeforce.base.measured import measured
from fringeforce.base.words import counted

FORCES = (
    "How large forces are, only known loads tell: that stays as the calibration found it, with its "
    "deviation."
)
LARGE = (
    "Do not use this model: only a residual explains the frames that is far larger than was "
    "stated. Calibrate anew, or state a larger one where it may be so large."
)
EXPLAINED = 0.9
"""Share of the frames that must be explained for the model to be used."""
ROUNDS = 12
"""Most times that a model is moved to what the frames say of it."""
TOLD = 0.9
"""Standard deviation over that before any frame, above which frames told nothing."""


@dataclass(frozen=True)
class Drift:
    """How far a bench may have drifted since its calibration, one standard deviation each.

    Attributes
    ----------
    light : float
        Of the amplitude over itself, even and uneven alike; of several channels each drifts on its
        own, and all are uneven alike.
    offset : float
        Of the light that fringes do not modulate, over the amplitude.
    residual : float
        Of the retardance without load, smooth along the strip [rad]; of strips it may be wrong by
        a factor of four, either way.
    shift : float
        Of the camera along the strip [m].
    scale : float
        Of the camera's magnification, relative.
    crosstalk : float
        Of the share of light of each pair of channels, if the design has cross-talk.

    Examples
    --------
    >>> ff.Drift(light=0.1).light
    0.1
    """

    light: float = 0.05
    offset: float = 0.01
    residual: float = 0.1
    shift: float = 0.1e-3
    scale: float = 1e-3
    crosstalk: float = 0.01

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value >= 0):
                raise InputError(
                    f"{name} = {value:g} of a drift: must be a standard deviation, 0 or more, "
                    "and finite."
                )


class Told(NamedTuple):
    """What frames tell of one thing that may drift.

    Attributes
    ----------
    name, unit : str
        For a sentence.
    paths : tuple of str
        Values of the design that it is.
    change, std, before : float
        Its change, in the unit, and standard deviation after the frames and before.
    signed : bool
        Whether frames tell its sign.
    """

    name: str
    unit: str
    paths: tuple[str, ...]
    change: float
    std: float
    before: float
    signed: bool = True

    @property
    def known(self) -> bool:
        """Whether frames tell of it."""
        return self.signed and self.std < TOLD * self.before

    def __str__(self) -> str:
        if not self.signed:
            return (
                f"{self.name}: unloaded frames tell its size, but not its sign; readings allow for "
                "both."
            )
        if not self.known:
            return (
                f"{self.name}: these frames do not tell whether it changed; readings allow for it."
            )
        sign = "+" if self.change >= 0 else ""
        return f"{self.name} changed by {sign}{measured(self.change, self.std, self.unit)}."


def missed(explained: Mask) -> Iterator[str]:
    """What does not fit, of frames that are explained or not."""
    count, lost = len(explained), int((~explained).sum())
    if lost > (1 - EXPLAINED) * count:
        yield (
            f"Do not use this model: no drift of light, residual and camera explains {lost} of "
            f"{counted(count, 'frames')}. Calibrate anew."
        )
    elif lost:
        one, more = ("is", "was") if lost == 1 else ("are", "were")
        yield f"{lost} of {counted(count, 'frames')} {one} not explained and {more} left out."
