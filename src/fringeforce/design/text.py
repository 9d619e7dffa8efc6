"""Design files: TOML to plain values, and a design back to TOML."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping
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
    return "\n".join(_lines(design, "", getattr(design, "tolerances", {}))).lstrip() + "\n"


def keys(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """Fields of a table by attribute; not the tolerances, which stand behind the values."""
    return {key: info for key, info in model.model_fields.items() if key != "tolerances"}


def _lines(part: BaseModel, path: str, tolerances: Mapping[str, float]) -> Iterator[str]:
    if path:
        yield f"\n[{path}]"
    children: list[tuple[str, BaseModel]] = []
    derived = getattr(part, "derived", frozenset())
    for key, info in keys(type(part)).items():
        if key in derived:
            continue
        value, name = getattr(part, key), info.alias or key
        at = f"{path}.{name}" if path else name
        if isinstance(value, BaseModel):
            children.append((at, value))
        elif value is not None and value != () and (at in tolerances or not left_out(value, info)):
            yield f"{name} = {_spelled(value, info, at, tolerances)}"
    for child_path, child in children:
        yield from _lines(child, child_path, tolerances)


def left_out(value: Any, info: FieldInfo) -> bool:
    """Whether a value says only that a sensor is ideal, which files need not."""
    extra = info.json_schema_extra
    return isinstance(extra, dict) and bool(extra.get("ideal")) and value == info.default


def unit_at(design: BaseModel, path: str) -> str | None:
    """SI unit of the value at a dotted path, "meter" or "pascal"; none for a plain number."""
    info = None
    for key in path.split("."):  # numbers in lists are of their field
        if key.isdigit():
            design = design[int(key)] if isinstance(design, tuple) else design
            continue
        info, design = type(design).model_fields[key], getattr(design, key)
    return None if info is None else unit_of(info)


def unit_of(info: FieldInfo) -> str | None:
    """SI unit of a field; none for a plain number, text or table."""
    extra = info.json_schema_extra
    unit = extra.get("unit") if isinstance(extra, dict) else None
    return unit if isinstance(unit, str) else None


def _spelled(value: Any, info: FieldInfo, path: str, tolerances: Mapping[str, float]) -> str:
    if isinstance(value, BaseModel):
        fields = []
        for key, own in keys(type(value)).items():
            single, name = getattr(value, key), own.alias or key
            if single is not None and single != ():
                fields.append(f"{name} = {_spelled(single, own, f'{path}.{name}', tolerances)}")
        return f"{{ {', '.join(fields)} }}"
    if isinstance(value, tuple):
        each = (_spelled(v, info, f"{path}.{i}", tolerances) for i, v in enumerate(value))
        return f"[{', '.join(each)}]"
    unit, std = unit_of(info), tolerances.get(path)
    if unit:
        text = spell_quantity(value, unit)
        return json.dumps(text if std is None else _with_tolerance(text, spell_quantity(std, unit)))
    if std is not None:
        return json.dumps(f"{value!r} +/- {std!r}")
    if isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, str):
        # a JSON string is a TOML basic string, but for DEL, which only TOML wants escaped
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)


def _with_tolerance(value: str, std: str) -> str:
    """Both with one unit where they have the same."""
    number, unit = value.split(" ")
    same = std.endswith(f" {unit}") or float(number) == 0
    return f"{number if same else value} +/- {std}"


def path_in_words(path: str, joint: str = " ") -> str:
    """A dotted path of a design in words, `joint` behind the table's name.

    Examples
    --------
    >>> from fringeforce.design.text import path_in_words
    >>> path_in_words("transducer.compliant.youngs_modulus")
    "compliant Young's modulus"
    """
    words = path.removeprefix("transducer.").replace(".", joint, 1).replace("_", " ")
    return words.replace("youngs", "Young's").replace("poissons", "Poisson's")
