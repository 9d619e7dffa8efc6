"""Contacts at random: what a study of a pad, or a learner, is shown."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from fringeforce.base.errors import InputError
from fringeforce.contacts.indenters import Indenter
from fringeforce.contacts.shapes import Edge, Point, Punch, Ridges, Sphere
from fringeforce.design.fields import Count, Finite, Force, Length, Pressure, Range, Share
from fringeforce.design.pad import Pad
from fringeforce.design.parts import Part

IndenterKind = Literal["point", "sphere", "edge", "punch", "ridges"]
Positive = Annotated[Finite, Field(ge=0)]
ATTEMPTS = 100
"""Draws of one contact before it is left out because there is no room."""


class ContactRanges(Part):
    """What contacts are drawn from: evenly between two values, sizes and moduli by their ratio."""

    count: Range[Count] = Field(default=(1, 5), description="contacts on the pad at once")
    kinds: tuple[IndenterKind, ...] = Field(
        default=("point", "sphere", "edge", "punch", "ridges"), min_length=1
    )
    normal: Range[Force] = Field(default=(0.1, 3.0), description="normal force of a contact [N]")
    friction: Range[Positive] = Field(default=(0.3, 0.9), description="of every contact its own")
    sliding: Range[Share] = Field(
        default=(0.0, 1.0), description="share of the friction that shear and moment use"
    )
    twisted: Share = Field(default=0.5, description="share of contacts that bear a moment")
    radius: Range[Length] = Field(
        default=(2e-3, 12e-3), description="of spheres, smooth and ridged [m]"
    )
    modulus: Range[Pressure] = Field(
        default=(1e6, 1e8), description="E / (1 - nu^2) of spheres, smooth and ridged [Pa]"
    )
    punch: Range[Length] = Field(default=(0.5e-3, 3e-3), description="radius of flat punches [m]")
    edge: Range[Length] = Field(default=(2e-3, 1e-2), description="length of edges [m]")
    period: Range[Length] = Field(default=(0.5e-3, 2e-3), description="from ridge to ridge [m]")
    depth: Range[Share] = Field(default=(0.2, 1.0), description="of ridges")


def random_contacts(
    pad: Pad,
    rng: int | np.random.Generator | None = None,
    ranges: ContactRanges | None = None,
    count: tuple[int, int] | None = None,
) -> list[Indenter]:
    """Contacts that do not overlap, each wholly on the tactels.

    Parameters
    ----------
    pad : Pad
        What they press on.
    rng : int, numpy.random.Generator or None
        Source of the randomness.
    ranges : ContactRanges, optional
        What they are drawn from.
    count : (int, int), optional
        Fewest and most contacts, in place of those of the ranges.

    Returns
    -------
    list of Indenter
        Forces follow from `imprint`.  Where there is no room for one more, fewer than were drawn.

    Raises
    ------
    InputError
        If not even one finds room.
    """
    drawn, generator = ranges or ContactRanges(), np.random.default_rng(rng)
    fewest, most = count or drawn.count
    found: list[Indenter] = []
    for _ in range(int(generator.integers(fewest, most + 1))):
        one = _placed(pad, generator, drawn, found)
        if one is not None:
            found.append(one)
    if not found:
        raise InputError(
            "No contact of these ranges fits on the tactels; take smaller radii and lengths, "
            "stiffer spheres, smaller forces, or a larger pad."
        )
    return found


def _placed(
    pad: Pad, rng: np.random.Generator, ranges: ContactRanges, others: list[Indenter]
) -> Indenter | None:
    """A contact that fits beside others; none if there is no room."""
    sides = np.array(pad.tactels.count) * pad.tactels.pitch
    for _ in range(ATTEMPTS):
        try:
            body = _body(pad, rng, ranges)
        except InputError:  # a sphere that would be flattened too far
            continue
        room = sides / 2 - body.reach(pad)
        if (room <= 0).any():
            continue
        x, y = rng.uniform(-room, room)
        apart = (
            np.hypot(x - other.place[0], y - other.place[1]) > body.reach(pad) + other.reach(pad)
            for other in others
        )
        if all(apart):
            return _rubbing(pad, rng, ranges, body.at((float(x), float(y))))
    return None


def _body(pad: Pad, rng: np.random.Generator, ranges: ContactRanges) -> Indenter:
    """A body in the middle of the pad that only presses."""
    kind = ranges.kinds[rng.integers(len(ranges.kinds))]
    common: Any = {
        "place": (0.0, 0.0),
        "normal": float(rng.uniform(*ranges.normal)),
        "friction": float(rng.uniform(*ranges.friction)),
    }
    angle = float(rng.uniform(0, np.pi))
    if kind == "point":
        return Point(**common)
    if kind == "edge":
        return Edge(**common, length=_by_ratio(rng, ranges.edge), angle=angle)
    if kind == "punch":
        return Punch(**common, radius=_by_ratio(rng, ranges.punch))
    sphere: Any = {
        "radius": _by_ratio(rng, ranges.radius),
        "modulus": _by_ratio(rng, ranges.modulus),
    }
    if kind == "sphere":
        found: Indenter = Sphere(**common, **sphere)
    else:
        found = Ridges(
            **common,
            **sphere,
            period=_by_ratio(rng, ranges.period),
            angle=angle,
            depth=float(rng.uniform(*ranges.depth)),
            phase=float(rng.uniform(0, 2 * np.pi)),
        )
    found.reach(pad)  # refuses what Hertz's theory does not cover
    return found


def _rubbing(pad: Pad, rng: np.random.Generator, ranges: ContactRanges, body: Indenter) -> Indenter:
    """A body with shear and moment that its friction allows."""
    used = body.friction * rng.uniform(*ranges.sliding)
    turn, direction, sign = rng.uniform(size=2), rng.uniform(0, 2 * np.pi), rng.choice((-1, 1))
    arm = body.arm(pad)
    turned = used * turn[1] if turn[0] < ranges.twisted and arm > 0 else 0.0
    shear = (used - turned) * body.normal * np.array([np.cos(direction), np.sin(direction)])
    return body.rubbing(
        (float(shear[0]), float(shear[1])), float(sign * turned * body.normal * arm)
    )


def _by_ratio(rng: np.random.Generator, ends: tuple[float, float]) -> float:
    return float(ends[0] * (ends[1] / ends[0]) ** rng.uniform())
