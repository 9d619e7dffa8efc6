"""Bodies that press on a pad: how they press and rub, and what its tactels then carry.

Pressures are those of contact mechanics on an elastic half-space (K. L. Johnson, *Contact
Mechanics*, Cambridge University Press 1985) with the modulus of the pad's cover.  A cover is a
layer on a stiffer one and not a half-space, so that they are an approximation, and a good one only
for contacts that are smaller than the cover is thick; what the pad makes of them has no such limit.

Coulomb's law holds at every place: shear traction is nowhere above friction times pressure.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.contacts.nodes import Nodes, Squares
from fringeforce.contacts.press import Tractions
from fringeforce.design.pad import Pad


@dataclass(frozen=True, eq=False)
class Imprint:
    """What an indenter does to a pad.

    Attributes
    ----------
    forces : ndarray, shape (n, 3)
        N, T_x, T_y of every tactel [N].
    force : ndarray, shape (3,)
        Sum of the forces [N].
    centre : ndarray, shape (2,)
        Centre of pressure [m].
    torsion : float
        Moment about the normal through that centre, from x towards y positive [N m].
    reach : float
        Radius or half length of the contact [m].
    tractions : Tractions
        The same as small forces where they act, which tactels know nothing of.
    """

    forces: Array
    force: Array
    centre: Array
    torsion: float
    reach: float
    tractions: Tractions


@dataclass(frozen=True, kw_only=True)
class Indenter(ABC):
    """A body under a normal force, a shear force and a moment about the normal.

    The moment is carried by shear traction that grows with the distance from the centre of
    pressure and is proportional to the pressure, like that of a body which turns on a bed of
    bristles.
    """

    kind: ClassVar[str]
    place: tuple[float, float]  # along x and y [m]
    normal: float  # N, above zero
    shear: tuple[float, float] = (0.0, 0.0)  # along x and y [N]
    torsion: float = 0.0  # about the normal through the centre of pressure [N m]
    friction: float = 0.5  # largest shear traction over pressure

    @abstractmethod
    def nodes(self, pad: Pad) -> Nodes:
        """The pressure, as small forces."""

    @abstractmethod
    def reach(self, pad: Pad) -> float:
        """Radius of a circle about the place that holds the contact [m]."""

    def at(self, place: tuple[float, float]) -> Self:
        """The body at another place [m]."""
        return replace(self, place=place)

    def rubbing(self, shear: tuple[float, float], torsion: float = 0.0) -> Self:
        """The body under a shear force [N] and a moment about the normal [N m]."""
        return replace(self, shear=shear, torsion=torsion)

    def arm(self, pad: Pad) -> float:
        """Moment per normal force where the outermost traction is as large as the pressure [m]."""
        nodes = self.nodes(pad)
        return self._arm(nodes, self._outermost(pad, nodes))

    def imprint(self, pad: Pad) -> Imprint:
        """What it does to a pad.

        Raises
        ------
        InputError
            If it reaches beyond the tactels, does not press, or shear and moment need more
            friction than there is.
        """
        self._check_numbers()
        squares, nodes = Squares.of(pad.tactels), self.nodes(pad)
        outermost = self._outermost(pad, nodes)
        turn = self._turn(self._arm(nodes, outermost))
        forces = np.zeros((squares.total, 3))
        pressed = np.zeros((len(nodes.places), 3))
        pressed[:, 0] = self.normal * nodes.shares
        if turn:
            x, y = (nodes.places - nodes.centre).T
            pressed[:, 1:] = pressed[:, :1] * np.stack([-y, x], axis=1) * turn / outermost
        sheared = self.rubbed(pad, nodes, self.friction - abs(turn))
        rubbed = np.zeros((len(sheared.places), 3))
        rubbed[:, 1:] = sheared.shares[:, None] * np.asarray(self.shear)
        acting = Tractions(
            np.concatenate([nodes.places, sheared.places]), np.concatenate([pressed, rubbed])
        )
        squares.add(forces, *acting)
        force = np.array([self.normal, *self.shear])
        return Imprint(forces, force, nodes.centre, self.torsion, self.reach(pad), acting)

    def rubbed(self, pad: Pad, nodes: Nodes, friction: float) -> Nodes:
        """Where the shear force acts, in proportion to the pressure if nothing else is known.

        Parameters
        ----------
        pad : Pad
            What is pressed.
        nodes : Nodes
            The pressure.
        friction : float
            What the moment leaves of it.
        """
        return nodes

    def _outermost(self, pad: Pad, nodes: Nodes) -> float:
        """Distance from the centre of pressure that nothing of the contact exceeds [m]."""
        return self.reach(pad) + float(np.hypot(*(nodes.centre - self.place)))

    @staticmethod
    def _arm(nodes: Nodes, outermost: float) -> float:
        if outermost == 0:
            return 0.0
        return float(nodes.shares @ ((nodes.places - nodes.centre) ** 2).sum(axis=1)) / outermost

    def _turn(self, arm: float) -> float:
        """Traction over pressure that the moment takes at the outermost place."""
        if self.torsion and arm == 0:
            raise InputError("A point carries no moment about the normal; take torsion = 0.")
        slide = float(np.hypot(*self.shear)) / self.normal
        turn = self.torsion / (self.normal * arm) if self.torsion else 0.0
        if slide + abs(turn) > self.friction * (1 + 1e-9):
            raise InputError(
                f"Shear of {slide:.3g} of the normal force and a moment that takes {abs(turn):.3g} "
                f"of it at the outermost place need more than the friction of {self.friction:g}; "
                "lower them or raise the friction."
            )
        return turn

    def _check_numbers(self) -> None:
        numbers = [*self.place, self.normal, *self.shear, self.torsion, self.friction]
        if not np.isfinite(numbers).all() or self.normal <= 0 or self.friction < 0:
            raise InputError(
                f"{self!r} cannot press; its numbers must be finite, its normal force above zero "
                "and its friction not below."
            )
