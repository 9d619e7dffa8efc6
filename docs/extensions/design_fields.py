"""The tables of the design file's fields, from the schema that reads it."""

from __future__ import annotations

import types
from typing import Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from fringeforce.design.strip import Sensor
from fringeforce.design.text import keys, unit_of
from fringeforce.design.units import EXAMPLES

LIMITS = {"gt": ">", "ge": "at least", "lt": "<", "le": "at most"}
QUANTITIES = {
    "meter": "length",
    "pascal": "pressure",
    "newton": "force",
    "radian": "angle",
    "second": "time",
    "kelvin": "temperature",
    "1/kelvin": "share per temperature",
    "1/pascal": "stress-optic coefficient",
}
KINDS = {int: "whole number", float: "number", str: "text", bool: "`true` or `false`"}


def tables(model: type[BaseModel] = Sensor, path: str = "") -> str:
    """A table in Markdown for every table of a design file."""
    rows, children = [], []
    for name, info in keys(model).items():
        key, child = info.alias or name, _table(info.annotation)
        if child is None:
            rows.append(_row(key, info))
            continue
        below = f"{path}.{key}" if path else key
        children.append((below, child[0], child[1]))
    parts = []
    if rows:
        doc = (model.__doc__ or "").strip().splitlines()[0]
        title = f"## `[{path}]`" if path else "## Top of the file"
        head = "| key | value | default | limits | meaning |\n|---|---|---|---|---|\n"
        parts.append(f"{title}\n\n{doc}\n\n{head}" + "\n".join(rows))
    for below, child_model, many in children:
        text = tables(child_model, below)
        parts.append(text.replace(f"`[{below}]`", f"`[[{below}]]`", 1) if many else text)
    return "\n\n".join(parts)


def _row(key: str, info: FieldInfo) -> str:
    default = "required" if info.is_required() else _default(info)
    cells = key, _kind(info), default, _limits(info), info.description or ""
    return f"| `{cells[0]}` | " + " | ".join(cell.replace("|", "\\|") for cell in cells[1:]) + " |"


def _default(info: FieldInfo) -> str:
    value = info.default
    if value is None or value == ():
        return "none"
    return f'`"{value}"`' if isinstance(value, str) else f"`{value}`"


def _kind(info: FieldInfo) -> str:
    unit = unit_of(info)
    if unit is not None:
        text = f"{QUANTITIES[unit]}, such as `{EXAMPLES[unit]}`"
        return f"list, each a {text}" if "tuple" in str(info.annotation) else text
    annotation = _without_none(info.annotation)
    if get_origin(annotation) is tuple:
        nested = get_origin(get_args(annotation)[0]) is tuple  # the shares of pairs of channels
        return (
            "share, or a list of them for each channel"
            if nested
            else "list of pressures, or of ratios"
        )
    if get_origin(annotation) is Literal:
        return " or ".join(f'`"{choice}"`' for choice in get_args(annotation))
    return KINDS.get(annotation, f"`{annotation}`")


def _limits(info: FieldInfo) -> str:
    found = []
    for rule in info.metadata:
        for one in getattr(rule, "metadata", [rule]):
            for name, words in LIMITS.items():
                bound = getattr(one, name, None)
                if bound is not None:
                    found.append(f"{words} {bound:g}")
    return ", ".join(dict.fromkeys(found))


def _table(annotation: Any) -> tuple[type[BaseModel], bool] | None:
    """The model of a table or of a list of tables, and whether it is a list."""
    annotation = _without_none(annotation)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation, False
    if get_origin(annotation) is tuple:
        inner = get_args(annotation)[0]
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            return inner, True
    return None


def _without_none(annotation: Any) -> Any:
    if get_origin(annotation) in (Union, types.UnionType):
        return next(part for part in get_args(annotation) if part is not type(None))
    return annotation
