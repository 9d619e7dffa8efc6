"""Presses on a skin at random: what a learner is shown."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from fringeforce.base.errors import InputError
from fringeforce.contacts.press import Press
from fringeforce.design.fields import Finite, Force, Length, Range, Share
from fringeforce.design.parts import Part

ATTEMPTS = 1000
"""Draws of all places before there is said to be no room."""


class PressRanges(Part):
    """What presses on a skin are drawn from: places evenly, forces and radii by their ratio."""

    count: Range[Annotated[int, Field(ge=0)]] = Field(
        default=(1, 3), description="contacts at once"
    )
    normal: Range[Force] = Field(default=(0.3, 5.0), description="normal force of each [N]")
    radius: Range[Length] = Field(
        default=(1e-3, 10e-3), description="of the rigid cylinder that presses [m]"
    )
    friction: Range[Annotated[Finite, Field(gt=0)]] = Field(
        default=(0.3, 0.9), description="of every contact its own"
    )
    sliding: Range[Share] = Field(
        default=(0.0, 0.9), description="share of the friction that shear uses, either way"
    )
    apart: Length = Field(default=2.5e-3, description="least distance between axes [m]")


def random_presses(
    extent: float, rng: int | np.random.Generator | None = None, ranges: PressRanges | None = None
) -> list[Press]:
    """Presses apart from each other, from left to right.

    Parameters
    ----------
    extent : float
        Length of the skin, on which axes stay half their distance from the ends [m].
    rng : int, numpy.random.Generator or None
        Source of the randomness.
    ranges : PressRanges, optional
        What they are drawn from.

    Raises
    ------
    InputError
        If there is no room for as many.
    """
    drawn, generator = ranges or PressRanges(), np.random.default_rng(rng)
    count, half = int(generator.integers(drawn.count[0], drawn.count[1] + 1)), extent / 2
    room = half - drawn.apart / 2
    for _ in range(ATTEMPTS):
        places = np.sort(generator.uniform(-room, room, count)) if room > 0 else np.empty(0)
        if len(places) == count and (np.diff(places) > drawn.apart).all():
            break
    else:
        raise InputError(
            f"{count} presses {drawn.apart * 1e3:g} mm apart find no room on a skin of "
            f"{extent * 1e3:g} mm; take fewer, or a smaller presses.apart."
        )
    return [_press(float(x), drawn, generator) for x in places]


def _press(x: float, ranges: PressRanges, rng: np.random.Generator) -> Press:
    normal = _by_ratio(ranges.normal, rng)
    friction = float(rng.uniform(*ranges.friction))
    used = float(rng.choice([-1.0, 1.0]) * rng.uniform(*ranges.sliding))
    return Press(
        x=x,
        normal=normal,
        tangential=used * friction * normal,
        radius=_by_ratio(ranges.radius, rng),
        friction=friction,
    )


def _by_ratio(between: tuple[float, float], rng: np.random.Generator) -> float:
    return float(np.exp(rng.uniform(*np.log(between))))
