"""What pages are told in the same words of every sensor."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from fringeforce.design.parts import Design

if TYPE_CHECKING:
    from fringeforce.reading.reading import Status

Value = str | int | float | list[int] | list[dict[str, str | float]]


def flat_values(design: Design) -> dict[str, Value]:
    """The values of a design as its file spells them, by dotted path."""
    return dict(_flattened(tomllib.loads(design.to_toml()), ""))


def verdict(status: Status, advice: str, chi2: float) -> dict[str, Any]:
    """The verdict on a frame, as JSON values."""
    chi2 = float(chi2)
    return {
        "status": status.name,
        "advice": advice,
        "chi2": chi2 if math.isfinite(chi2) else None,
    }


def _flattened(values: Mapping[str, Any], path: str) -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _flattened(value, f"{path}{key}.")
        else:
            yield path + key, value
