"""Contacts on a skin as rows of numbers: as many as there are, or as many as there may be."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.base.arrays import Array
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.io.tables import contact_cells, contact_columns
from fringeforce.reading.skin_search import MOST

ROWS = MOST + 1
"""Contacts of a line at most, after all of them together."""


def is_skin(sensor: Sensor | Pad) -> bool:
    """Whether readings of a sensor have contacts."""
    return isinstance(sensor, Sensor) and sensor.skin is not None


def contact_rows(readings: Readings) -> Iterator[list[list[float]]]:
    """Numbers of `contact_columns` of every line: all together, then each contact.

    A line of which there is nothing to say has one row, of what is not a number.
    """
    assert readings.resultants is not None
    nothing = [np.nan] * len(contact_columns())
    for felt in readings.resultants:
        yield [contact_cells(one) for one in felt] or [nothing]


def contact_table(readings: Readings) -> Array:
    """The same with as many rows for every line, shape (k, ROWS, 8); others are not a number."""
    found = np.full((len(readings), ROWS, len(contact_columns())), np.nan)
    for line, rows in zip(found, contact_rows(readings), strict=True):
        line[: len(rows)] = rows
    return found


def contact_objects(readings: Readings) -> list[list[dict[str, Any]]]:
    """The rows of every line as objects for JSON; what is not a number is None."""
    names = contact_columns()
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
