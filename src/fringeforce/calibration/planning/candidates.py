"""Loads that a person can apply to a sensor, and loads that it is meant to read."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from fringeforce.base.arrays import Array, Index
from fringeforce.base.errors import InputError
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.models.plane_check import plane_check
from fringeforce.models.strip import SensorModel

SHARES = (0.25, 0.5, 0.75, 1.0)
"""Parts of the largest force that calibration loads are tried with."""
SPACING = 2.0
"""Distance between the places at which a skin is pressed, in thicknesses of its cover: as far apart
as the paper's tactels, whose forces a frame tells one from the other."""
TOUCHED, TILT = 0.7, 20.0
"""Share of tactels that a typical load touches, and its largest angle [degrees]."""
ALONG = 4
"""Places along each side of a pad at most: what a press tells changes slowly with its place."""


@dataclass(frozen=True)
class Limits:
    """What a person can apply and the camera can resolve.

    Attributes
    ----------
    force : float
        Largest force of one calibration load [N].
    friction : float or None
        Largest tangential force over the normal one, for loads that would slip beyond it;
        without it a tangential force can be applied alone.
    fringe_density : float
        Largest number of fringes per pixel; an intensity is sampled well enough up to 0.5, and
        readings lose their way from 0.2 on.
    together : int
        Tactels that can be pressed at a time, 1 or 2; two share the force alike.

    Examples
    --------
    >>> ff.Limits(force=2.0, friction=0.5).together
    1
    """

    force: float = 3.0
    friction: float | None = None
    fringe_density: float = 0.2
    together: int = 1

    def __post_init__(self) -> None:
        if not 0 < self.force < np.inf:
            raise InputError(f"Largest force {self.force:g} N: must be greater than 0 and finite.")
        if self.friction is not None and not 0 <= self.friction < np.inf:
            raise InputError(
                f"friction = {self.friction:g}: must be 0 or more; leave it out where tangential "
                "forces can be applied alone."
            )
        if not 0 < self.fringe_density <= 0.5:
            raise InputError(
                f"Fringe density {self.fringe_density:g} per pixel: must be from above 0 to 0.5, "
                "beyond which no camera tells fringes apart."
            )
        if self.together not in (1, 2):
            raise InputError(f"{self.together} tactels together: must be 1 or 2.")

    @property
    def directions(self) -> Array:
        """Unit forces, normal and tangential, that a tactel can be pressed with, shape (m, 2)."""
        return self.directions_of(2)

    def directions_of(self, components: int) -> Array:
        """The same with as many components, shape (m, components)."""
        if self.friction is None:  # a load and its negative make one frame: one sign will do
            return np.eye(components)
        down = np.eye(1, components)
        if self.friction == 0:
            return down
        tilt = np.arctan(self.friction)
        aside = [way * row for row in np.eye(components)[1:] for way in (1.0, -1.0)]
        return np.concatenate([down, np.cos(tilt) * down + np.sin(tilt) * np.array(aside)])


def pressable(sensor: Sensor) -> Sensor:
    """The strip to plan with: a skin has places to press at, and three dimensions a plane.

    In three dimensions the plane is taken that is nearer.  What loads tell hardly depends on it:
    six loads planned for the design `saad` in the wrong plane leave readings 1 % worse than those
    planned in the right one.

    Raises
    ------
    InputError
        If a skin is shorter than SPACING thicknesses of its cover.
    """
    found = sensor
    if sensor.skin is not None:
        pitch = SPACING * sensor.transducer.compliant.thickness
        count = int(sensor.skin.extent / pitch * (1 + 1e-9))
        if count < 1:
            raise InputError(
                f"A skin of {sensor.skin.extent * 1e3:g} mm has no places {pitch * 1e3:g} mm "
                "apart, two thicknesses of its cover; plan for a longer one."
            )
        found = found.replace(tactels={"count": count, "pitch": pitch})
    if sensor.transducer.plane == "3d":
        plane = plane_check(sensor).nearest
        narrow = {"line_position": None, "line_width": None}
        found = found.replace(transducer={"plane": plane}, camera=narrow)
    return found


def candidates(model: SensorModel, limits: Limits) -> Array:
    """Loads within the limits, no load among them, shape (C, n, 2) [N].

    Raises
    ------
    InputError
        If even the smallest load makes fringes that the camera does not resolve.
    """
    sensor = model.sensor
    n = sensor.tactels.count
    chosen = np.arange(n)
    if sensor.skin is not None:  # a calibrated one, whose line loads are much denser
        step = round(SPACING * sensor.transducer.compliant.thickness / sensor.tactels.pitch)
        step = max(step, 1)
        chosen = np.arange((n - 1) % step // 2, n, step)
    few = presses(len(chosen), 2, limits)
    pressed = np.zeros((len(few), n, 2))
    pressed[:, chosen] = few
    return resolved(pressed, fringes_per_pixel(model, pressed), limits)


def presses(n: int, components: int, limits: Limits) -> Array:
    """Loads on n places, no load first, shape (C, n, components) [N]."""
    groups = [(j,) for j in range(n)]
    if limits.together == 2:
        groups += list(combinations(range(n), 2))
    loads = [np.zeros((n, components))]
    for group in groups:
        for direction in limits.directions_of(components):
            for share in SHARES:
                load = np.zeros((n, components))
                load[group, :] = share * limits.force / len(group) * direction
                loads.append(load)
    return np.stack(loads)


def resolved(pressed: Array, density: Array, limits: Limits) -> Array:
    """Loads whose fringes, of a density (C,) per pixel, the camera resolves.

    Raises
    ------
    InputError
        If even the smallest load makes fringes that it does not.
    """
    kept = pressed[density <= limits.fringe_density]
    if len(kept) < 2:
        raise InputError(
            f"Loads from {SHARES[0] * limits.force:g} N on make more than "
            f"{limits.fringe_density:g} fringes per pixel; press less or take more pixels."
        )
    return kept


def pressed_tactels(pad: Pad) -> Index:
    """Tactels, or squares of a skin, to press a pad at: evenly spread, shape (n,)."""
    along, across = (
        np.unique(np.linspace(0, count - 1, min(count, ALONG)).round().astype(int))
        for count in pad.tactels.count
    )
    return np.add.outer(along * pad.tactels.count[1], across).ravel()


def typical_loads(model: SensorModel, limits: Limits, count: int) -> Array:
    """Random contacts of up to the largest force on every tactel, shape (count, n, 2) [N].

    Loads whose fringes the camera would not resolve are scaled down until it does.
    """
    rng, shape = np.random.default_rng(0), (count, model.sensor.tactels.count)
    size = rng.uniform(0, limits.force, shape) * (rng.random(shape) < TOUCHED)
    angle = np.radians(rng.uniform(-TILT, TILT, shape))
    loads = np.stack([size * np.cos(angle), size * np.sin(angle)], axis=2)
    density = fringes_per_pixel(model, loads)
    return loads * np.minimum(1, limits.fringe_density / density)[:, None, None]


def fringes_per_pixel(model: SensorModel, loads: Array) -> Array:
    """Fringe density of loads (..., n, 2) by small strain where it is largest, shape (...).

    Of the channel whose light has the shortest wavelength.
    """
    steps = max(model.dispersions) * np.abs(np.diff(model.phase(loads, strain="linear"), axis=-1))
    return np.asarray(steps.max(axis=-1, initial=0.0) / (2 * np.pi), float)
