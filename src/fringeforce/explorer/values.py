"""The values of a design as its file spells them."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

from fringeforce.design.parts import Design

Value = str | int | float | list[int]


def flat_values(design: Design) -> dict[str, Value]:
    """The values of a design as its file spells them, by dotted path."""
    return dict(_flattened(tomllib.loads(design.to_toml()), ""))


def _flattened(values: Mapping[str, Any], path: str) -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _flattened(value, f"{path}{key}.")
        else:
            yield path + key, value
