"""Design files: TOML to plain values, and a design back to TOML."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from fringeforce.base.errors import DesignError
from fringeforce.design.units import spell_quantity


def toml_values(text: str, source: str) -> dict[str, Any]:
    """Plain nested values of a TOML text; DesignError with the line if it is not TOML."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise DesignError(f"{source} is not a TOML file: {error}.") from None


def toml_text(design: BaseModel) -> str:
    """The text of a design file whose values read back to the very same floats."""
    return "\n".join(_lines(design, "")).lstrip() + "\n"


def _lines(part: BaseModel, path: str) -> Iterator[str]:
    if path:
        yield f"\n[{path}]"
    children: list[tuple[str, BaseModel]] = []
    for key, info in type(part).model_fields.items():
        value = getattr(part, key)
        if isinstance(value, BaseModel):
            children.append((f"{path}.{key}" if path else key, value))
        elif value is not None and value != ():
            yield f"{info.alias or key} = {_spelled(value, info)}"
    for child_path, child in children:
        yield from _lines(child, child_path)


def unit_at(design: BaseModel, path: str) -> str | None:
    """SI unit of the value at a dotted path, "meter" or "pascal"; none for a plain number."""
    *parents, name = path.split(".")
    for parent in parents:
        design = getattr(design, parent)
    return unit_of(type(design).model_fields[name])


def unit_of(info: FieldInfo) -> str | None:
    """SI unit of a field; none for a plain number, text or table."""
    extra = info.json_schema_extra
    unit = extra.get("unit") if isinstance(extra, dict) else None
    return unit if isinstance(unit, str) else None


def _spelled(value: Any, info: FieldInfo) -> str:
    if isinstance(value, BaseModel):
        fields = (field.strip() for field in _lines(value, ""))
        return f"{{ {', '.join(fields)} }}"
    if isinstance(value, tuple):
        return f"[{', '.join(_spelled(single, info) for single in value)}]"
    unit = unit_of(info)
    if unit:
        return json.dumps(spell_quantity(value, unit))
    if isinstance(value, str):
        # a JSON string is a TOML basic string, but for DEL, which only TOML wants escaped
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)
