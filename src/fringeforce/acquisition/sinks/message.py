"""A block of readings as JSON.

An object: ``first`` (number of the first line), ``time`` (k,) [s since 1970], ``forces`` and
``std`` (k, n, components), a row for each tactel, (N, T) of a strip and (N, T_x, T_y) of a pad
[N], ``chi2`` (k,), ``status`` (k,); what is not a number is null.  Of a skin also ``contacts``
(k,), lists of objects with the columns of a table of contacts: all together, then each, the
strongest first.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from fringeforce.acquisition.sinks.contact_rows import contact_objects
from fringeforce.acquisition.sinks.sink import Readings


def message(readings: Readings) -> str:
    """A block of readings as one JSON object."""
    contacts = {} if readings.resultants is None else {"contacts": contact_objects(readings)}
    return json.dumps(
        {
            "first": readings.first,
            "time": readings.timestamps.tolist(),
            "forces": numbers(readings.forces),
            "std": numbers(readings.std),
            "chi2": numbers(readings.chi2),
            "status": [status.name for status in readings.status],
            **contacts,
        },
        allow_nan=False,
        separators=(",", ":"),
    )


def numbers(values: np.ndarray) -> list[Any]:
    """Nested lists of floats to the millionth, with None for what is not a number."""
    rounded = np.round(values, 6)
    finite = np.isfinite(rounded)
    if finite.all():
        return rounded.tolist()
    objects = rounded.astype(object)
    objects[~finite] = None
    return objects.tolist()
