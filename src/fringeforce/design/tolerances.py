"""Tolerances: what is uncertain about a design, written behind its values.

``"0.50 +/- 0.02 mm"`` states a value and one standard deviation, as the Guide to the Expression of
Uncertainty in Measurement (JCGM 100:2008, 7.2.2) writes it.  The unit at the end counts for both
numbers; each may also have its own, ``"0.5 mm +/- 20 um"``, and a share of the value is written
``"11 MPa +/- 5 %"``.  Behind the brackets of the Guide's fourth form, ``"(6.0 +/- 0.5) %"``, per
cent are a unit like others.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import BaseModel, GetCoreSchemaHandler
from pydantic.fields import FieldInfo
from pydantic_core import InitErrorDetails, PydanticCustomError, core_schema

from fringeforce.design.text import unit_of
from fringeforce.design.units import EXAMPLES, parse_quantity, spell_quantity

REACH = 3
"""Standard deviations that must not reach a value which the design refuses: a drawn sensor lies
beyond them once in 740 times."""

_SIGN = re.compile(r"\+\s*/\s*-|±")
_BRACKETS = re.compile(r"\((.*)\)(.*)", re.DOTALL)


class Tolerances(Mapping[str, float]):
    """Standard deviations by dotted path, in the unit of each value; never changes.

    Parameters
    ----------
    stated : mapping
        From dotted paths, such as "transducer.compliant.thickness", to standard deviations.
    """

    def __init__(self, stated: Mapping[str, float] | None = None) -> None:
        self._stated = {path: float(std) for path, std in sorted((stated or {}).items())}

    def __getitem__(self, path: str) -> float:
        return self._stated[path]

    def __iter__(self) -> Iterator[str]:
        return iter(self._stated)

    def __len__(self) -> int:
        return len(self._stated)

    def __hash__(self) -> int:
        return hash(tuple(self._stated.items()))

    def __repr__(self) -> str:
        return f"Tolerances({self._stated})"

    @classmethod
    def __get_pydantic_core_schema__(
        cls, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(
            cls, serialization=core_schema.plain_serializer_function_ser_schema(dict)
        )


@dataclass(frozen=True)
class Limits:
    """What a field allows; open limits are not allowed themselves."""

    low: float = -math.inf
    high: float = math.inf
    above: float = -math.inf
    below: float = math.inf

    def allow(self, value: float) -> bool:
        """Whether a value lies within."""
        return self.low <= value <= self.high and self.above < value < self.below


def is_tolerance(value: Any) -> bool:
    """Whether something is a text with a tolerance."""
    return isinstance(value, str) and _SIGN.search(value) is not None


def split_tolerance(text: str) -> list[str]:
    """What stands before and behind the sign of a tolerance, each with the unit of brackets."""
    if both := _BRACKETS.fullmatch(text.strip()):
        text, unit = both.groups()
        return [f"{part.strip()} {unit.strip()}".strip() for part in _SIGN.split(text, maxsplit=1)]
    return [part.strip() for part in _SIGN.split(text, maxsplit=1)]


def parse_tolerance(text: str, unit: str | None) -> tuple[str | float, float, float]:
    """Read a value with its tolerance.

    Parameters
    ----------
    text : str
        Such as "0.50 +/- 0.02 mm", "11 MPa ± 5 %" or "0.97 +/- 0.02".
    unit : str or None
        Unit of the value, as of `parse_quantity`; None for plain numbers.

    Returns
    -------
    nominal : str or float
        The value alone, as a design states it.
    value, std : float
        Value and standard deviation in the unit.

    Raises
    ------
    ValueError
        If one of the two is no number, lacks its unit, or the tolerance is negative.
    """
    left, right = split_tolerance(text)
    share = right.endswith("%") and not _BRACKETS.fullmatch(text.strip())
    nominal: str | float = left
    if unit is None:
        nominal = value = _number(left, "value")
    else:
        if _bare(left) and not share and not _bare(right):
            nominal = left + " " + re.sub(r"^[-+.\deE]+\s*", "", right)
        value = parse_quantity(str(nominal), unit)
    if share:
        std = abs(value) * _number(right[:-1], "tolerance") / 100
        if value == 0:
            raise ValueError(
                f"has a share of zero for a tolerance; write it as in {_example(unit, value)}"
            )
    elif unit is None:
        std = _number(right, "tolerance")
    elif _bare(right):
        raise ValueError(f"has a tolerance without a unit; write it as in {_example(unit, value)}")
    else:
        # a deviation of a temperature is a difference, which has no zero of its own
        std = parse_quantity(right.replace("degC", "K") if unit == "kelvin" else right, unit)
    if not math.isfinite(std) or std < 0 or right.startswith("-"):
        raise ValueError(
            f"has a tolerance of {right}; a standard deviation is finite and not negative: write "
            f"it as in {_example(unit, value)}"
        )
    return nominal, value, std


def _bare(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _number(text: str, what: str) -> float:
    try:
        return float(text[:-1]) / 100 if text.endswith("%") else float(text)
    except ValueError:
        raise ValueError(
            f"has no number for its {what}; write both as in {_example(None, 1.0)}"
        ) from None


def _example(unit: str | None, value: float) -> str:
    if unit is None:
        return '"0.97 +/- 0.02"'
    own = EXAMPLES[unit].strip('"')
    return f'"{spell_quantity(value, unit)} +/- 5 %"' if value else f'"0 +/- {own}"'


def limits(info: FieldInfo) -> Limits:
    """What a field allows."""
    found: dict[str, float] = {}
    names = {"ge": "low", "le": "high", "gt": "above", "lt": "below"}
    for rule in _rules([*info.metadata, info.annotation]):
        for name, ours in names.items():
            bound = getattr(rule, name, None)
            if bound is not None:
                found[ours] = float(bound)
    return Limits(**found)


def _rules(rules: Any) -> Iterator[Any]:
    for rule in rules:
        yield rule
        yield from _rules(getattr(rule, "__metadata__", ()))
        yield from _rules(getattr(rule, "metadata", ()))
        yield from _rules(get_args(rule))


def excess(value: float, std: float, info: FieldInfo) -> str | None:
    """What is wrong with a tolerance that is too large for its value, and what to do."""
    allowed = limits(info)
    if not allowed.allow(value):
        return None  # the value itself is refused, with a better message
    room = min(value - allowed.above, allowed.below - value)
    if REACH * std < room:
        return None
    low = value - allowed.above == room
    unit = unit_of(info)
    end, bound = (-1, allowed.above) if low else (1, allowed.below)
    reached, most = value + end * REACH * std, room / REACH * 0.99
    numbers = [f"{v:.3g}" if unit is None else _rounded(v, unit) for v in (reached, bound, most)]
    return (
        f"has a tolerance that is too large: three standard deviations reach {numbers[0]}, and it "
        f"must be {'greater' if low else 'less'} than {numbers[1]}; state at most +/- {numbers[2]}"
    )


def _rounded(value: float, unit: str) -> str:
    return spell_quantity(float(f"{value:.3g}"), unit)


def table_of(annotation: Any) -> type[BaseModel] | None:
    """The model of a table, of a list of tables, or of a table that may be left out, if any."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    parts = get_args(annotation)
    return next((found for part in parts if (found := table_of(part)) is not None), None)


def _is_number(info: FieldInfo) -> bool:
    """Whether a field holds floats, one or several."""
    return unit_of(info) is not None or _floats(info.annotation)


def _floats(annotation: Any) -> bool:
    return annotation is float or any(_floats(part) for part in get_args(annotation))


@dataclass
class _Taken:
    """What was found behind the values of a design."""

    tolerances: dict[str, float]
    problems: list[InitErrorDetails]


def take(
    model: type[BaseModel], values: Any
) -> tuple[Any, dict[str, float], list[InitErrorDetails]]:
    """Separate values from their tolerances.

    Parameters
    ----------
    model : type
        The model that the values are of.
    values : mapping
        Plain nested values, some of them texts with a tolerance.

    Returns
    -------
    plain : mapping
        The values alone; what could not be read stays as it was.
    tolerances : dict
        Standard deviations by dotted path, zeros included.
    problems : list
        Of tolerances, with their places.
    """
    taken = _Taken({}, [])
    return _taken(model, values, (), taken), taken.tolerances, taken.problems


def _taken(model: type[BaseModel], values: Any, path: tuple[str | int, ...], taken: _Taken) -> Any:
    if not isinstance(values, Mapping):
        return values
    fields = {info.alias or name: info for name, info in model.model_fields.items()}
    return {
        key: _field(fields[key], value, (*path, key), taken) if key in fields else value
        for key, value in values.items()
    }


def _field(info: FieldInfo, value: Any, path: tuple[str | int, ...], taken: _Taken) -> Any:
    child: Any = table_of(info.annotation)
    if child is not None:
        value = child.in_full(value)
    if isinstance(value, list | tuple):
        return [_field(info, one, (*path, i), taken) for i, one in enumerate(value)]
    if child is not None:
        return _taken(child, value, path, taken)
    if not is_tolerance(value) or not _is_number(info):
        return _plain(value, info)
    try:
        nominal, number, std = parse_tolerance(value, unit_of(info))
        problem = _per_cent(value, number, info) or excess(number, std, info)
        if problem is not None:
            raise ValueError(problem)
    except ValueError as error:
        taken.problems.append(problem_at(path, value, str(error)))
        return value
    taken.tolerances[".".join(map(str, path))] = std
    return nominal


def _plain(value: Any, info: FieldInfo) -> Any:
    """A number without a unit that is written as a text, such as what remains of a tolerance."""
    if not isinstance(value, str) or unit_of(info) is not None or not _floats(info.annotation):
        return value
    try:
        return _number(value.strip(), "value")
    except ValueError:
        return value


def _per_cent(text: str, value: float, info: FieldInfo) -> str | None:
    """What to write where per cent behind a tolerance are meant for its value too."""
    left, right = split_tolerance(text)
    if unit_of(info) is not None or not (_bare(left) and right.endswith("%")):
        return None
    allowed = limits(info)
    if allowed.allow(value) or not allowed.allow(value / 100):
        return None
    return (
        f"reads as {left} with a tolerance of {right} of it; where both are per cent, write "
        f'"({left} +/- {right[:-1].strip()}) %"'
    )


def problem_at(path: tuple[str | int, ...], value: Any, text: str) -> InitErrorDetails:
    """A problem of a design, for pydantic."""
    return {
        "type": PydanticCustomError("tolerance", "{text}", {"text": text}),
        "loc": path,
        "input": value,
    }


def number_at(design: BaseModel, path: str) -> tuple[float, FieldInfo] | None:
    """The number at a dotted path and its field; None if there is none."""
    part: Any = design
    info = None
    for key in path.split("."):
        if isinstance(part, tuple):
            if not key.isdigit() or int(key) >= len(part):
                return None
            part = part[int(key)]
            continue
        if not isinstance(part, BaseModel):
            return None
        name = attribute(type(part), key)
        if name is None:
            return None
        info, part = type(part).model_fields[name], getattr(part, name)
    return (part, info) if isinstance(part, float) and info is not None else None


def attribute(model: type[BaseModel], key: str) -> str | None:
    """Name of the attribute that a key of a design file fills."""
    fields = model.model_fields.items()
    return next((name for name, info in fields if (info.alias or name) == key), None)


def with_values(design: Any, values: Mapping[str, float]) -> Any:
    """A design with other numbers, not validated: what was made may break a rule of drawings.

    Parameters
    ----------
    design : Part or tuple
        What to change.
    values : mapping
        Numbers by dotted path.
    """
    if "" in values:
        return values[""]
    heads: dict[str, dict[str, float]] = {}
    for path, value in values.items():
        head, _, rest = path.partition(".")
        heads.setdefault(head, {})[rest] = value
    if isinstance(design, tuple):
        changed = list(design)
        for head, below in heads.items():
            changed[int(head)] = with_values(design[int(head)], below)
        return tuple(changed)
    update = {}
    for head, below in heads.items():
        name = attribute(type(design), head) or head
        update[name] = with_values(getattr(design, name), below)
    return design.model_copy(update=update)


def without(tolerances: Mapping[str, float], path: str, value: Any) -> dict[str, float]:
    """Tolerances that survive a change: not those of a list that is replaced or left out.

    Parameters
    ----------
    tolerances : mapping
        Before the change.
    path : str
        Dotted path of what changes.
    value : object
        What it becomes.
    """
    if isinstance(value, BaseModel):
        value = value.model_dump(by_alias=True, exclude_none=True)
    kept = dict(tolerances)
    if isinstance(value, Mapping):
        for key, below in value.items():
            kept = without(kept, f"{path}.{key}", below)
        return kept
    if value is None or not isinstance(value, str | float | int):
        return {
            name: std
            for name, std in kept.items()
            if name != path and not name.startswith(f"{path}.")
        }
    return kept
