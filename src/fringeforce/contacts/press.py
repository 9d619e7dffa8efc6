"""What really touches: a press of known force and place, and how its traction is distributed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError

Profile = Literal["line", "flat", "hertz", "punch"]
NODES = 64
"""Small forces that stand for a traction: Gauss's rule, exact for polynomials of degree 127."""


class Tractions(NamedTuple):
    """Small forces side by side.

    Attributes
    ----------
    places : ndarray, shape (q,)
        Along x [m].
    forces : ndarray, shape (q, 2)
        Normal and tangential [N].
    """

    places: Array
    forces: Array

    @property
    def centre(self) -> float:
        """Centre of pressure along x [m]."""
        return float(self.forces[:, 0] @ self.places / self.forces[:, 0].sum())

    @property
    def width(self) -> float:
        """Four standard deviations of the pressure, the whole width of a Hertz contact [m]."""
        square = self.forces[:, 0] @ np.square(self.places - self.centre)
        return float(4 * np.sqrt(square / self.forces[:, 0].sum()))

    def between(self, places: Array) -> Array:
        """Forces half way to the neighbours of evenly spaced places, shape (n, 2) [N]."""
        own, forces = self
        if len(own) == 1:  # a line stands at the place next to it
            found = np.zeros((len(places), 2))
            found[np.abs(places - own[0]).argmin()] = forces[0]
            return found
        middles = (own[1:] + own[:-1]) / 2
        ends = np.concatenate([[2 * own[0] - middles[0]], middles, [2 * own[-1] - middles[-1]]])
        sums = np.concatenate([np.zeros((1, 2)), np.cumsum(forces, axis=0)])
        half = (places[1] - places[0]) / 2
        edges = np.append(places - half, places[-1] + half)
        reached = np.column_stack([np.interp(edges, ends, sums[:, part]) for part in range(2)])
        return np.diff(reached, axis=0)


@dataclass(frozen=True, kw_only=True)
class Press:
    """Something that presses on a strip anywhere.

    Either the width of the contact is given and its profile, or the radius of a rigid cylinder
    across the strip, from which contact mechanics on the layers tells width and pressure.

    Parameters
    ----------
    x : float
        Place along the strip [m]; of the middle of the contact, or of the cylinder's axis.
    normal : float
        Force into the strip, above zero [N].
    tangential : float
        Force towards +x [N].
    width : float, optional
        Of the contact [m]; a line if neither width nor radius is given.
    profile : {"line", "flat", "hertz", "punch"}, optional
        Of the pressure over the width: uniform, that of Hertz, or that of a rigid flat punch, with
        its singular edges; "hertz" if not given.  The shear is proportional to it.
    radius : float, optional
        Of the cylinder [m].
    friction : float
        Largest shear over pressure at any place; a cylinder slips where it would be exceeded.

    Raises
    ------
    InputError
        If a number is out of range, or shear needs more friction than there is.

    Examples
    --------
    >>> model = ff.characterize(ff.load_sensor("saad"))
    >>> finger = ff.Press(x=0.3e-3, normal=1.0, tangential=0.2, radius=5e-3)
    >>> model.expose([finger], rng=0).shape
    (2048,)
    """

    x: float
    normal: float
    tangential: float = 0.0
    width: float | None = None
    profile: Profile | None = None
    radius: float | None = None
    friction: float = 0.6

    def __post_init__(self) -> None:
        numbers = {"x": self.x, "tangential": self.tangential}
        above = {"normal": self.normal, "friction": self.friction}
        above |= {k: v for k in ("width", "radius") if (v := getattr(self, k)) is not None}
        for name, value in (numbers | above).items():
            if not np.isfinite(value) or (name in above and value <= 0):
                limit = "finite and above zero" if name in above else "finite"
                raise InputError(f"{name} = {value} of a press must be {limit}.")
        if self.profile is not None and self.profile not in get_args(Profile):
            raise InputError(
                f"profile = {self.profile!r} of a press is none; take one of "
                f"{', '.join(map(repr, get_args(Profile)))}."
            )
        if self.radius is not None and (self.width is not None or self.profile is not None):
            raise InputError(
                "A press has either a radius, from which mechanics tells the contact, or a width "
                "and a profile; give one of them."
            )
        if self.profile not in (None, "line") and self.width is None:
            raise InputError(f"profile = {self.profile!r} of a press needs a width; give it.")
        if abs(self.tangential) > self.friction * self.normal * (1 + 1e-9):
            raise InputError(
                f"A tangential force of {self.tangential:g} N needs more than the friction of "
                f"{self.friction:g} under {self.normal:g} N; lower it or raise the friction."
            )

    def distributed(self) -> Tractions:
        """Tractions of a press of known width."""
        if self.width is None or self.profile == "line":
            places, shares = np.array([self.x]), np.ones(1)
        else:
            places, shares = _profile(self.profile or "hertz")
            places = self.x + self.width / 2 * places
        return Tractions(places, shares[:, None] * [self.normal, self.tangential])


def _profile(kind: Profile) -> tuple[Array, Array]:
    """Places in half widths and shares of the force, by the Gauss rule of the profile's weight."""
    if kind == "flat":
        t, weights = np.polynomial.legendre.leggauss(NODES)
        return t, weights / 2
    if kind == "punch":
        return np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES), np.full(NODES, 1 / NODES)
    angle = np.pi * np.arange(1, NODES + 1) / (NODES + 1)
    return np.cos(angle), 2 / (NODES + 1) * np.square(np.sin(angle))
