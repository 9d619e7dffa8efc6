"""Values of a design as unknowns of a fit: entries that no step can carry out of their bounds.

A positive value enters by its logarithm over that of the drawing, Poisson's ratio by the inverse
hyperbolic tangent of its place between -1 and 1/2, and the tactels by their shifts in pitches, one
each.  Entries are zero for the drawing.
"""

from __future__ import annotations

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.design.strip import Sensor

STRAIN_OPTIC = "transducer.photoelastic.strain_optic_coefficient"
POSITIONS = "tactels.positions"
POISSON = "poissons_ratio"
DEVIATION = {"value": 0.5, "position": 0.2}
"""Standard deviations of an entry before any frame is seen; of a place in pitches."""
INCOMPRESSIBLE, RANGE = 0.5, 0.75
"""Upper bound of Poisson's ratio, and half the width of its range."""


def design_value(sensor: Sensor, path: str) -> float:
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


def checked_paths(sensor: Sensor, paths: tuple[str, ...]) -> tuple[str, ...]:
    """The paths of what is to be calibrated.

    Raises
    ------
    InputError
        If one names nothing that can be, or two the same.
    """
    for path in paths:
        if path != POSITIONS:
            design_value(sensor, path)
        if path.startswith("camera.") or path in ("transducer.length", "tactels.count"):
            raise InputError(
                f"{path!r} is not calibrated: the camera's shift, scale and light are found "
                "in any case, and a length only by its scale; take other parameters."
            )
    if len(set(paths)) < len(paths):
        raise InputError(f"{', '.join(paths)} name a value twice; name each once.")
    if "tactels.pitch" in paths and (POSITIONS in paths or sensor.tactels.placed is not None):
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
    found = []
    for path in paths:
        numbers = range(1, sensor.tactels.count + 1)
        found += [f"tactel {j} position" for j in numbers] if path == POSITIONS else [path]
    return tuple(found)


def prior(sensor: Sensor, paths: tuple[str, ...]) -> Array:
    """Standard deviations of the entries before any frame is seen, shape (d,)."""
    places = np.array([path == POSITIONS for path in entries(sensor, paths)], dtype=bool)
    return np.where(places, DEVIATION["position"], DEVIATION["value"])


def varied(sensor: Sensor, paths: tuple[str, ...], design: Array) -> Sensor:
    """The drawing with some values changed by given entries, shape (d,)."""
    owners = entries(sensor, paths)
    found = values(sensor, paths, design)
    changes: dict[str, float | list[float]] = dict(zip(owners, found.tolist(), strict=True))
    if POSITIONS in paths:
        changes[POSITIONS] = found[np.array(owners) == POSITIONS].tolist()
    return sensor.replace(**changes)


def values(sensor: Sensor, paths: tuple[str, ...], design: Array) -> Array:
    """Values of all entries in SI units, shape (d,)."""
    found: list[float] = []
    start = 0
    for path in paths:
        if path == POSITIONS:
            shifts = design[start : start + sensor.tactels.count]
            found += (sensor.tactels.positions + shifts * sensor.tactels.pitch).tolist()
            start += sensor.tactels.count
            continue
        drawn, entry = design_value(sensor, path), float(design[start])
        if path.endswith(POISSON):
            place = np.tanh(np.arctanh(1 + (drawn - INCOMPRESSIBLE) / RANGE) + entry)
            found.append(INCOMPRESSIBLE + RANGE * (place - 1))
        else:
            found.append(drawn * np.exp(entry))
        start += 1
    return np.array(found)


def units(sensor: Sensor, paths: tuple[str, ...], design: Array) -> Array:
    """Derivatives by the entries, (d,): of a value's logarithm, of a tactel's place in metres."""
    found = []
    for path, value in zip(
        entries(sensor, paths), values(sensor, paths, design).tolist(), strict=True
    ):
        if path == POSITIONS:
            found.append(sensor.tactels.pitch)
        elif path.endswith(POISSON):
            place = 1 + (value - INCOMPRESSIBLE) / RANGE
            found.append(RANGE * (1 - place**2) / value)
        else:
            found.append(1.0)
    return np.array(found)
