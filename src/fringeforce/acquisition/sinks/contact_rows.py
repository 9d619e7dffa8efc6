"""Contacts on a skin as rows of numbers: as many as there are, or as many as there may be."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.base.arrays import Array
from fringeforce.contacts.resultant import wrenches
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.io.tables import COMPONENTS, contact_cells, contact_columns
from fringeforce.reading.skin_search import MOST_CONTACTS

ROWS = MOST_CONTACTS + 1
"""Contacts of a line at most, after all of them together."""


def is_skin(sensor: Sensor | Pad) -> bool:
    """Whether readings of a sensor have contacts."""
    return sensor.skin is not None


def columns_of(readings: Readings) -> tuple[str, ...]:
    """Names of the numbers of a contact, of a strip or of a pad."""
    return contact_columns(COMPONENTS[readings.forces.shape[-1]])


def contact_rows(readings: Readings) -> Iterator[list[list[float]]]:
    """Numbers of `columns_of` of every line: all together, then each contact.

    A line of which there is nothing to say has one row, of what is not a number.
    """
    assert readings.resultants is not None
    nothing = [np.nan] * len(columns_of(readings))
    for felt in readings.resultants:
        yield [contact_cells(one) for one in felt] or [nothing]


def wrenches_of(readings: Readings, sensor: Sensor | Pad) -> tuple[Array, Array]:
    """Force [N] and moment [N m] of every line, shape (k, 3) each, as of `wrenches`.

    Those of a skin are of its contacts where they are; lines of which there is nothing to say are
    not a number.
    """
    if readings.resultants is None:
        return wrenches(readings.forces, sensor.tactels.places)
    force, moment = np.full((2, len(readings), 3), np.nan)
    for line, felt in enumerate(readings.resultants):
        if felt:
            normal, *shear = felt[0].force
            force[line] = [*shear, *[0.0] * (2 - len(shear)), 0.0 - normal]
            moment[line] = felt[0].moment
    return force, moment


def contact_table(readings: Readings) -> Array:
    """The same with as many rows for every line, shape (k, ROWS, 8), of a pad (k, ROWS, 18).

    Those of which there is nothing to say are not a number.
    """
    found = np.full((len(readings), ROWS, len(columns_of(readings))), np.nan)
    for line, rows in zip(found, contact_rows(readings), strict=True):
        line[: len(rows)] = rows
    return found


def contact_objects(readings: Readings) -> list[list[dict[str, Any]]]:
    """The rows of every line as objects for JSON; what is not a number is None."""
    names = columns_of(readings)
    return [
        [
            {
                name: round(value, 6) if np.isfinite(value) else None
                for name, value in zip(names, row, strict=True)
            }
            for row in rows
        ]
        for rows in contact_rows(readings)
    ]
