"""What really touches: a press of known force and place, and how its traction is distributed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np
from scipy.special import roots_jacobi

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError

Profile = Literal["line", "flat", "hertz", "punch", "edge"]
Outline = Literal["ellipse", "rectangle"]
NODES = 64
"""Small forces that stand for a traction: Gauss's rule, exact for polynomials of degree 127."""
RINGS, SPOKES = 32, 96
"""The same over an ellipse: Gauss's rule along the radius, and equal steps around it."""
PAIRS = "tangential", "width"
"""Values of which there may be two on a pad."""


class Tractions(NamedTuple):
    """Small forces side by side.

    Attributes
    ----------
    places : ndarray, shape (q,), or (q, 2) of a pad
        Along x, and y [m].
    forces : ndarray, shape (q, 2), or (q, 3) of a pad
        Normal and tangential, of a pad along x and y [N].
    """

    places: Array
    forces: Array

    @property
    def centre(self) -> float:
        """Centre of pressure along x [m]."""
        return float(self.forces[:, 0] @ self.places / self.forces[:, 0].sum())

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of the contact along x, half a step beyond the outermost forces [m]."""
        if len(self.places) == 1:
            return float(self.places[0]), float(self.places[0])
        at = np.sort(self.places)
        return float(1.5 * at[0] - 0.5 * at[1]), float(1.5 * at[-1] - 0.5 * at[-2])

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


def rounded(x: float, width: float, force: Array) -> Tractions:
    """A normal and a tangential force [N], shape (2,), as Hertz's over a width about x [m]."""
    places, shares = _profile("hertz")
    return Tractions(x + width / 2 * places, shares[:, None] * force)


@dataclass(frozen=True, kw_only=True)
class Press:
    """Something that presses on a strip or a pad anywhere.

    Either the width of the contact is given and its profile, or the radius of a rigid cylinder
    across a strip, or sphere on a pad, from which contact mechanics on the layers tells width and
    pressure.

    Parameters
    ----------
    x : float
        Place along the sensor [m]; of the middle of the contact, or of the indenter's axis.
    y : float, optional
        Place across a pad [m]; a press with it is one on a pad.
    normal : float
        Force into the surface, above zero [N].
    tangential : float or (float, float)
        Force towards +x, on a pad towards +x and +y [N].
    width : float or (float, float), optional
        Of the contact [m], on a pad along both axes of its outline; a line, or a point of a pad, if
        neither width nor radius is given.
    profile : {"line", "flat", "hertz", "punch", "edge"}, optional
        Of the pressure over the width: uniform, that of Hertz, that of a rigid flat punch, with
        its singular edges, or that of a sharp edge; "hertz" if not given.  The shear is
        proportional to it.  An edge is a flat punch that is tilted until it just leaves the surface
        at the other end, so that its pressure p grows along the first width, as
        sqrt((1 + t) / (1 - t)) with t from -1 to 1 on a strip; its centre of pressure is a quarter
        of the width beyond the middle, of an ellipse a sixth.  Over a rectangle the pressures of
        Hertz and of an edge are uniform along the second width.
    outline : {"ellipse", "rectangle"}
        Of a contact on a pad.
    angle : float
        Of the first axis of that outline, from x towards y [degrees]; 180 turns the edge of a
        contact on a strip to the left.
    radius : float, optional
        Of the cylinder or sphere [m].
    friction : float
        Largest shear over pressure at any place; an indenter slips where it would be exceeded.

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
    >>> ball = ff.Press(x=1e-3, y=-2e-3, normal=4.0, tangential=(1.0, 0.5), radius=5e-3)
    >>> ball.shear
    (1.0, 0.5)
    """

    x: float
    normal: float
    y: float | None = None
    tangential: float | tuple[float, float] = 0.0
    width: float | tuple[float, float] | None = None
    profile: Profile | None = None
    outline: Outline = "ellipse"
    angle: float = 0.0
    radius: float | None = None
    friction: float = 0.6

    def __post_init__(self) -> None:
        numbers = {"x": self.x, "tangential": self.tangential, "angle": self.angle}
        numbers |= {} if self.y is None else {"y": self.y}
        above = {"normal": self.normal, "friction": self.friction}
        above |= {k: v for k in ("width", "radius") if (v := getattr(self, k)) is not None}
        for name, value in (numbers | above).items():
            try:
                values = np.atleast_1d(np.asarray(value, dtype=float))
            except (TypeError, ValueError):
                raise InputError(
                    f"{name} = {value!r} of a press must be a number in metres, newtons or degrees."
                ) from None
            if not np.isfinite(values).all() or (name in above and (values <= 0).any()):
                limit = "finite and above zero" if name in above else "finite"
                raise InputError(f"{name} = {value} of a press must be {limit}.")
            if values.shape not in {(1,)} | ({(2,)} if name in PAIRS else set()):
                kind = "a number, or two on a pad" if name in PAIRS else "a number"
                raise InputError(f"{name} = {value} of a press must be {kind}.")
        for name, known in (("profile", Profile), ("outline", Outline)):
            value = getattr(self, name)
            if value is not None and value not in get_args(known):
                raise InputError(
                    f"{name} = {value!r} of a press is none; take one of "
                    f"{', '.join(map(repr, get_args(known)))}."
                )
        if self.y is None and any(np.ndim(part) for part in (self.tangential, self.width or 0.0)):
            raise InputError(
                "A press with two tangential forces or widths is one on a pad; give its y as well."
            )
        if self.radius is not None and (self.width is not None or self.profile is not None):
            raise InputError(
                "A press has either a radius, from which mechanics tells the contact, or a width "
                "and a profile; give one of them."
            )
        if self.profile not in (None, "line") and self.width is None:
            raise InputError(f"profile = {self.profile!r} of a press needs a width; give it.")
        shear = float(np.linalg.norm(self.tangential))
        if shear > self.friction * self.normal * (1 + 1e-9):
            raise InputError(
                f"A tangential force of {shear:g} N needs more than the friction of "
                f"{self.friction:g} under {self.normal:g} N; lower it or raise the friction."
            )

    @property
    def shear(self) -> tuple[float, float]:
        """Tangential force along x and y [N]."""
        x, y = (*np.atleast_1d(self.tangential), 0.0)[:2]
        return float(x), float(y)

    def distributed(self) -> Tractions:
        """Tractions of a press of known width on a strip."""
        if self.width is None or self.profile == "line":
            places, shares = np.array([self.x]), np.ones(1)
        else:
            places, shares = _profile(self.profile or "hertz")
            along = np.copysign(1.0, np.cos(np.radians(self.angle)))
            places = self.x + along * np.max(self.width) / 2 * places
        return Tractions(places, shares[:, None] * [self.normal, self.shear[0]])

    def distributed_on_pad(self) -> Tractions:
        """Tractions of a press of known widths on a pad."""
        middle = np.array([self.x, self.y])
        if self.width is None or self.profile == "line":
            places, shares = middle[None], np.ones(1)
        else:
            kind = self.profile or "hertz"
            unit, shares = _disc(kind) if self.outline == "ellipse" else _square(kind)
            turn = np.radians(self.angle)
            axes = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
            places = middle + np.broadcast_to(self.width, 2) / 2 * unit @ axes
        return Tractions(places, shares[:, None] * [self.normal, *self.shear])


def _profile(kind: Profile) -> tuple[Array, Array]:
    """Places in half widths and shares of the force, by the Gauss rule of the profile's weight."""
    if kind == "flat":
        t, weights = np.polynomial.legendre.leggauss(NODES)
        return t, weights / 2
    if kind in ("punch", "edge"):
        t = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
        # under a rigid flat body that is turned as well, with no pressure left at t = -1
        return t, (1 + t if kind == "edge" else np.ones(NODES)) / NODES
    angle = np.pi * np.arange(1, NODES + 1) / (NODES + 1)
    return np.cos(angle), 2 / (NODES + 1) * np.square(np.sin(angle))


def _disc(kind: Profile) -> tuple[Array, Array]:
    """Places on the unit disc, shape (q, 2), and shares of the force."""
    # with s = r^2 the weights are 1, sqrt(1 - s) and 1 / sqrt(1 - s)
    power = {"flat": 0.0, "hertz": 0.5, "punch": -0.5, "edge": -0.5}[kind]
    s, weights = roots_jacobi(RINGS, power, 0.0)
    turn = 2 * np.pi * np.arange(SPOKES) / SPOKES
    around = np.column_stack([np.cos(turn), np.sin(turn)])
    places = (np.sqrt((1 + s) / 2)[:, None, None] * around).reshape(-1, 2)
    shares = np.repeat(weights / weights.sum() / SPOKES, SPOKES)
    return places, shares * (1 + places[:, 0]) if kind == "edge" else shares


def _square(kind: Profile) -> tuple[Array, Array]:
    """Places on the square from -1 to 1, shape (q, 2), and shares of the force."""
    first, second = _profile(kind), _profile("flat" if kind in ("hertz", "edge") else kind)
    x, y = np.meshgrid(first[0], second[0], indexing="ij")
    return np.column_stack([x.ravel(), y.ravel()]), np.outer(first[1], second[1]).ravel()
