"""The shapes of indenters: a point, a sphere, an edge, a flat punch, and a ridged fingertip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.contacts.indenters import Indenter
from fringeforce.contacts.nodes import ORDER, Nodes, Squares, disc, line
from fringeforce.design.pad import Pad


@dataclass(frozen=True, kw_only=True)
class Point(Indenter):
    """A needle: all of the force on one tactel."""

    kind: ClassVar[str] = "point"

    def nodes(self, pad: Pad) -> Nodes:
        """The place itself."""
        return Nodes(np.array([self.place]), np.ones(1))

    def reach(self, pad: Pad) -> float:
        """Nothing."""
        return 0.0


@dataclass(frozen=True, kw_only=True)
class Round(Indenter):
    """A round body whose contact is Hertz's."""

    radius: float  # [m]
    modulus: float | None = None  # E / (1 - nu^2) of the body [Pa]; None is a rigid one

    def reach(self, pad: Pad) -> float:
        """Radius of the contact, by Hertz [m]."""
        return hertz_radius(pad, self.normal, self.radius, self.modulus)


@dataclass(frozen=True, kw_only=True)
class Sphere(Round):
    """A sphere under Hertz's pressure, and in partial slip after Cattaneo and Mindlin.

    The shear traction of a sphere that starts to slip is friction times pressure in a ring and less
    in the disc that still sticks, whose radius is a (1 - T / friction N)^(1/3); Johnson's section
    7.2.
    """

    kind: ClassVar[str] = "sphere"

    def nodes(self, pad: Pad) -> Nodes:
        """Hertz's pressure."""
        return disc(Squares.of(pad.tactels), self.place, self.reach(pad))

    def rubbed(self, pad: Pad, nodes: Nodes, friction: float) -> Nodes:
        """Traction of partial slip: that of full slip less that which the stuck disc lacks."""
        shear, largest = float(np.hypot(*self.shear)), friction * self.normal
        if shear == 0:
            return nodes
        left = max(1 - shear / largest, 0.0)
        if left == 0:
            return nodes
        stuck = disc(Squares.of(pad.tactels), self.place, self.reach(pad) * np.cbrt(left))
        return Nodes(
            np.concatenate([nodes.places, stuck.places]),
            np.concatenate([nodes.shares, -left * stuck.shares]) * largest / shear,
        )


@dataclass(frozen=True, kw_only=True)
class Edge(Indenter):
    """A straight edge with the same force on every millimetre."""

    kind: ClassVar[str] = "edge"
    length: float  # [m]
    angle: float = 0.0  # from x towards y [rad]

    def nodes(self, pad: Pad) -> Nodes:
        """An even line."""
        return line(Squares.of(pad.tactels), self.place, self.length, self.angle)

    def reach(self, pad: Pad) -> float:
        """Half of its length [m]."""
        return self.length / 2


@dataclass(frozen=True, kw_only=True)
class Punch(Indenter):
    """A rigid cylinder with a flat end: N / (2 pi a^2) (1 - r^2 / a^2)^(-1/2), Johnson's (3.34)."""

    kind: ClassVar[str] = "punch"
    radius: float  # [m]

    def nodes(self, pad: Pad) -> Nodes:
        """The pressure under a flat punch, highest along its rim."""
        return disc(Squares.of(pad.tactels), self.place, self.radius, "punch")

    def reach(self, pad: Pad) -> float:
        """Radius of the contact [m]."""
        return self.radius


@dataclass(frozen=True, kw_only=True)
class Ridges(Round):
    """A soft sphere with ridges like a fingertip's: Hertz's pressure times 1 + depth cos(...)."""

    kind: ClassVar[str] = "ridges"
    period: float  # from ridge to ridge [m]
    angle: float = 0.0  # across the ridges, from x towards y [rad]
    depth: float = 0.5  # 0 is smooth, 1 lets the valleys carry nothing
    phase: float = 0.0  # of the cosine at the place [rad]

    def nodes(self, pad: Pad) -> Nodes:
        """Hertz's pressure, modulated across the ridges."""
        if not (self.period > 0 and 0 <= self.depth <= 1):
            raise InputError(
                f"Ridges every {self.period * 1e3:g} mm, {self.depth:g} deep, are none; take a "
                "period above zero and a depth from 0 to 1."
            )
        reach = self.reach(pad)
        # Gauss's rule follows a cosine from some four nodes a period on
        widest = min(pad.tactels.pitch, 2 * reach)
        order = ORDER + int(np.ceil(4 * widest / self.period))
        smooth = disc(Squares.of(pad.tactels), self.place, reach, order=order)
        wave = 2 * np.pi / self.period * np.array([np.cos(self.angle), np.sin(self.angle)])

        def pressed(places: Array) -> Array:
            return 1 + self.depth * np.cos((places - self.place) @ wave + self.phase)

        return smooth.modulated(pressed)


def hertz_radius(pad: Pad, normal: float, radius: float, modulus: float | None) -> float:
    """Radius of the contact of a sphere, (3 N R / 4 E*)^(1/3), Johnson's equation (4.22) [m].

    Parameters
    ----------
    pad : Pad
        Whose cover is pressed.
    normal : float
        Force [N].
    radius : float
        Radius of the sphere [m].
    modulus : float or None
        E / (1 - nu^2) of the sphere [Pa]; None is a rigid one.

    Raises
    ------
    InputError
        If the sphere would be flattened further than the theory reaches.
    """
    cover = pad.transducer.compliant
    compliance = (1 - cover.poissons_ratio**2) / cover.youngs_modulus
    compliance += 0.0 if modulus is None else 1 / modulus
    found = float(np.cbrt(0.75 * normal * radius * compliance))
    if not found < radius:
        raise InputError(
            f"A force of {normal:.3g} N flattens a sphere of {radius * 1e3:.3g} mm to a contact "
            f"of {found * 1e3:.3g} mm, beyond Hertz's theory; press less, or take a larger or "
            "stiffer one."
        )
    return found
