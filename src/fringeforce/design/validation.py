"""Every problem of a design in one message: where it is, what it says, what it may say."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from fringeforce.base.errors import DesignError
from fringeforce.design.text import keys

Model = TypeVar("Model", bound=BaseModel)


def validated(model: type[Model], values: Mapping[str, Any], source: str, from_file: bool) -> Model:
    """Build a model from plain values, or say all that is wrong with them.

    Parameters
    ----------
    model : type
        The pydantic model.
    values : mapping
        Plain nested values.
    source : str
        Names the values in the message.
    from_file : bool
        Whether a bare number is an error where a unit is due.

    Raises
    ------
    DesignError
        One line for each problem.
    """
    try:
        return model.model_validate(values, context={"units_required": from_file})
    except ValidationError as error:
        # what follows from other tables cannot be made while these have problems
        problems = [
            _problem(model, values, detail)
            for detail in error.errors()
            if detail["type"] != "default_factory_not_called"
        ]
    count = "a problem" if len(problems) == 1 else f"{len(problems)} problems"
    raise DesignError("\n  ".join([f"{source} has {count}:", *problems]))


def suggestion(name: str, known: Sequence[str]) -> str:
    """A hint at the known name nearest to a wrong one, or the list of all."""
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    return (
        f"did you mean {near[0]!r}?" if near else "known are " + ", ".join(map(repr, known)) + "."
    )


def _problem(model: type[BaseModel], values: Mapping[str, Any], detail: ErrorDetails) -> str:
    path = ".".join(map(str, detail["loc"])) or "the design"
    if detail["type"] == "missing" and isinstance(detail["loc"][-1], int):
        whole = ".".join(map(str, detail["loc"][:-1]))
        return f"{whole} needs one value more; it is a list of a fixed number of them."
    if detail["type"] == "missing":
        misspelt = difflib.get_close_matches(
            str(detail["loc"][-1]), _present(values, detail["loc"])
        )
        hint = f" ({misspelt[0]!r} is there: misspelt?)" if misspelt else ""
        return f"{path} is missing{hint}; it is the {_description(model, detail['loc'])}."
    if detail["type"] == "extra_forbidden":
        hint = suggestion(str(detail["loc"][-1]), _fields(model, detail["loc"][:-1]))
        return f"{path} is not a key; {hint}"
    given = _given(values, detail)
    shown = "a table" if isinstance(given, Mapping) else repr(given)
    if detail["type"] in ("value_error", "tolerance"):
        text = str(detail.get("ctx", {}).get("error", detail["msg"]))
        return (
            f"{path} = {shown} {text}."
            if not isinstance(given, Mapping | BaseModel)
            else f"{path}: {text}."
        )
    return f"{path} = {shown}: {_limit(detail)}."


def _given(values: Any, detail: ErrorDetails) -> Any:
    """The value as it was written, where it stands in the text."""
    for key in detail["loc"]:
        if not isinstance(values, Mapping) or key not in values:
            return detail["input"]
        values = values[key]
    return values if isinstance(values, str) else detail["input"]


def _limit(detail: ErrorDetails) -> str:
    limits = detail.get("ctx", {})
    texts = {
        "greater_than": "must be greater than {gt:g}",
        "greater_than_equal": "must be {ge} or more",
        "less_than": "must be less than {lt:g}",
        "less_than_equal": "must be {le} or less",
        "literal_error": "must be {expected}",
        "finite_number": "must be a finite number",
        "float_type": "must be a number",
        "int_type": "must be a whole number",
        "string_type": "must be text in quotes",
        "tuple_type": "must be a list",
        "model_type": "must be a table of keys",
        "model_attributes_type": "must be a table of keys",
    }
    return texts.get(detail["type"], detail["msg"]).format(**limits)


def _present(values: Any, location: tuple[int | str, ...]) -> list[str]:
    """Keys that stand beside a missing one."""
    for key in location[:-1]:
        if isinstance(values, list) and isinstance(key, int):
            values = values[key]
        else:
            values = values.get(key, {}) if isinstance(values, Mapping) else {}
    return list(values) if isinstance(values, Mapping) else []


def _model_at(model: type[BaseModel], location: Sequence[int | str]) -> type[BaseModel]:
    for key in location:
        if isinstance(key, str):  # numbers count the tables of a list
            model = _table_of(model.model_fields[key].annotation)
    return model


def _table_of(annotation: Any) -> type[BaseModel]:
    """The model of a table, of a list of tables, or of a table that may be left out."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(_table_of(part) for part in get_args(annotation) if part is not type(None))


def _fields(model: type[BaseModel], location: Sequence[int | str]) -> list[str]:
    fields = keys(_model_at(model, location))
    return [info.alias or name for name, info in fields.items()]


def _description(model: type[BaseModel], location: Sequence[int | str]) -> str:
    info = _model_at(model, location[:-1]).model_fields[str(location[-1])]
    return info.description or f"table of the {str(location[-1]).replace('_', ' ')}"
