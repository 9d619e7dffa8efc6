"""Values of a design as unknowns of a fit: entries that no step can carry out of their bounds.

A positive value enters by its logarithm over that of the drawing, Poisson's ratio by the inverse
hyperbolic tangent of its place between -1 and 1/2, and the tactels by their shifts in pitches, one
each.  Entries are zero for the drawing.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import InputError
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor

STRAIN_OPTIC = "transducer.photoelastic.strain_optic_coefficient"
EFFECTS = STRAIN_OPTIC, "transducer.photoelastic.stress_optic_coefficient"
"""What the phase is proportional to, equation (2); a design states one of them."""
POSITIONS = "tactels.positions"
POISSON = "poissons_ratio"
DEVIATION = {"value": 0.5, "position": 0.2}
"""Standard deviations of an entry before any frame is seen; of a place in pitches."""
DRAWN = 0.1
"""Relative standard deviation that a drawing is trusted to where it states no tolerance."""
INCOMPRESSIBLE, RANGE = 0.5, 0.75
"""Upper bound of Poisson's ratio, and half the width of its range."""


def design_value(sensor: Sensor | Pad, path: str) -> float:
    """Value of a design at a dotted path.

    Raises
    ------
    InputError
        If the path does not name a number other than zero.
    """
    value: object = sensor
    for part in path.split("."):
        value = getattr(value, part, None)
    if isinstance(value, bool) or not isinstance(value, int | float) or value == 0:
        raise InputError(
            f"{path!r} names no number of a design that can be calibrated; take dotted paths such "
            f"as {STRAIN_OPTIC!r} or 'transducer.compliant.thickness', or {POSITIONS!r}."
        )
    return float(value)


def checked_paths(sensor: Sensor | Pad, paths: tuple[str, ...]) -> tuple[str, ...]:
    """The paths of what is to be calibrated.

    Raises
    ------
    InputError
        If one names nothing that can be, or two the same.
    """
    effect = sensor.transducer.photoelastic.effect
    for path in paths:
        if path in EFFECTS and not path.endswith(effect):
            raise InputError(
                f"The design does not state {path!r}; take 'transducer.photoelastic.{effect}'."
            )
        if path != POSITIONS:
            design_value(sensor, path)
        if path.startswith("camera.") or path in ("transducer.length", "tactels.count"):
            raise InputError(
                f"{path!r} is not calibrated: the camera's shift, scale and light are found "
                "in any case, and a length only by its scale; take other parameters."
            )
    if len(set(paths)) < len(paths):
        raise InputError(f"{', '.join(paths)} name a value twice; name each once.")
    placed = isinstance(sensor, Sensor) and sensor.tactels.placed is not None
    if "tactels.pitch" in paths and (POSITIONS in paths or placed):
        raise InputError(
            "'tactels.pitch' says nothing where every tactel has a place; take "
            f"{POSITIONS!r} alone."
        )
    return paths


def entries(sensor: Sensor, paths: tuple[str, ...]) -> tuple[str, ...]:
    """The path that every entry belongs to, length d; that of the positions once for each."""
    counts = [sensor.tactels.count if path == POSITIONS else 1 for path in paths]
    return tuple(np.repeat(paths, counts).tolist()) if paths else ()


def names(sensor: Sensor, paths: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the entries: dotted paths, and "tactel 1 position" to n."""
    owners, first = entries(sensor, paths), [*paths, POSITIONS].index(POSITIONS)
    return tuple(
        f"tactel {number - first + 1} position" if path == POSITIONS else path
        for number, path in enumerate(owners)
    )


def prior(sensor: Sensor, paths: tuple[str, ...]) -> Array:
    """Standard deviations of the entries before any frame is seen, shape (d,)."""
    return np.where(_places(sensor, paths), DEVIATION["position"], DEVIATION["value"])


def varied(sensor: Sensor, paths: tuple[str, ...], design: Array) -> Sensor:
    """The drawing with some values changed by given entries, shape (d,)."""
    found, places = values(sensor, paths, design), _places(sensor, paths)
    single = [path for path in paths if path != POSITIONS]
    changes: dict[str, Any] = dict(zip(single, found[~places].tolist(), strict=True))
    if places.any():
        changes[POSITIONS] = found[places].tolist()
    return sensor.replace(**changes)


def values(sensor: Sensor, paths: tuple[str, ...], design: Array) -> Array:
    """Values of all entries in SI units, shape (d,)."""
    found, places = np.empty(len(design)), _places(sensor, paths)
    if places.any():
        found[places] = sensor.tactels.positions + design[places] * sensor.tactels.pitch
    owners = entries(sensor, paths)
    for number in np.flatnonzero(~places):
        drawn, entry = design_value(sensor, owners[number]), design[number]
        if owners[number].endswith(POISSON):
            place = np.tanh(np.arctanh(1 + (drawn - INCOMPRESSIBLE) / RANGE) + entry)
            found[number] = INCOMPRESSIBLE + RANGE * (place - 1)
        else:
            found[number] = drawn * np.exp(entry)
    return found


def units(sensor: Sensor, paths: tuple[str, ...], design: Array) -> Array:
    """Derivatives by the entries, (d,): of a value's logarithm, of a tactel's place in metres."""
    found = np.where(_places(sensor, paths), sensor.tactels.pitch, 1.0)
    poisson = np.array([path.endswith(POISSON) for path in entries(sensor, paths)], dtype=bool)
    value = values(sensor, paths, design)[poisson]
    found[poisson] = RANGE * (1 - (1 + (value - INCOMPRESSIBLE) / RANGE) ** 2) / value
    return found


def _places(sensor: Sensor, paths: tuple[str, ...]) -> Mask:
    """Which entries are places of tactels, shape (d,)."""
    return np.array([path == POSITIONS for path in entries(sensor, paths)], dtype=bool)
