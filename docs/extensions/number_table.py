"""The tables of numbers that steer readings as a page shows them, read from the sources."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import fringeforce

ROOMS = ("reading", "estimation", "models")
"""Rooms whose numbers steer readings, from the frame down to the model."""
DECIDING = {
    "estimation.hypotheses": ("CONFIDENCE", "NEGLIGIBLE_LOSS", "SAME_PHASE"),
    "estimation.residual_test": ("FALSE_ALARM", "FALSE_VERDICT"),
    "reading.strip_frames": ("MISSED", "STILL_MISSED"),
    "estimation.posterior": ("WAVES",),
    "models.uncertainty": ("BROKEN",),
    "reading.departure_test": ("HARMLESS",),
}
"""Those that decide whether a reading is OK."""


class Number(NamedTuple):
    """A numeric constant of a module.

    Attributes
    ----------
    module : str
        Dotted path behind the package.
    name, value : str
        As the source has them.
    said : str
        The docstring below it; empty if it has none.
    """

    module: str
    name: str
    value: str
    said: str


def numbers(room: str) -> list[Number]:
    """All numeric constants of the modules of a room."""
    root = Path(fringeforce.__file__).parent
    return [
        number
        for path in sorted((root / room).rglob("*.py"))
        for number in _of_module(path, ".".join(path.relative_to(root).with_suffix("").parts))
    ]


def table(room: str) -> str:
    """Rows of a room's constants, module after module, each with the first sentence about it."""
    rows = [
        f"| `{one.name}` | `{one.value}` | {_first_sentence(one.said)} | `{one.module}` |"
        for one in numbers(room)
    ]
    head = "| name | value | what it is | module |\n|---|---|---|---|\n"
    return head + "\n".join(rows) + "\n"


def deciding() -> str:
    """Rows of those that decide whether a reading is OK, each with all that is said of it."""
    known = {(one.module, one.name): one for room in ROOMS for one in numbers(room)}
    found = [known[module, name] for module, names in DECIDING.items() for name in names]
    rows = [f"| `{one.name}` | `{one.value}` | {_cell(one.said)} |" for one in found]
    return "| name | value | what it is, and why |\n|---|---|---|\n" + "\n".join(rows) + "\n"


def _of_module(path: Path, module: str) -> Iterator[Number]:
    body = ast.parse(path.read_text(encoding="utf-8")).body
    for statement, following in pairwise([*body, ast.Pass()]):
        if isinstance(statement, ast.Assign):
            target, value = statement.targets[0], statement.value
        elif isinstance(statement, ast.AnnAssign) and statement.value is not None:
            target, value = statement.target, statement.value
        else:
            continue
        for name, own in _pairs(target, value):
            if name.isupper() and not name.startswith("_") and _is_number(own):
                yield Number(module, name, _shown(module, name, own), _string(following))


def _shown(module: str, name: str, value: ast.expr) -> str:
    """A value as it is written, or what it comes to where it is computed."""
    computed = isinstance(value, ast.BinOp | ast.Call)
    found = getattr(import_module(f"fringeforce.{module}"), name) if computed else None
    return f"{found:.4g}" if isinstance(found, float) else ast.unparse(value)


def _pairs(target: ast.expr, value: ast.expr) -> Iterator[tuple[str, ast.expr]]:
    """Names and what each is set to."""
    if isinstance(target, ast.Name):
        yield target.id, value
    elif isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
        for one, own in zip(target.elts, value.elts, strict=True):
            yield from _pairs(one, own)


def _is_number(value: ast.expr) -> bool:
    """Whether a number, or several, or what is computed of one, is written there."""
    if isinstance(value, ast.Constant):
        return isinstance(value.value, int | float) and not isinstance(value.value, bool)
    if isinstance(value, ast.BinOp):
        return _is_number(value.left) or _is_number(value.right)
    if isinstance(value, ast.UnaryOp):
        return _is_number(value.operand)
    if isinstance(value, ast.Tuple | ast.List):
        return any(map(_is_number, value.elts))
    return isinstance(value, ast.Call) and any(map(_is_number, value.args))


def _string(statement: ast.stmt) -> str:
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        return " ".join(str(statement.value.value).split())
    return ""


def _first_sentence(said: str) -> str:
    """The first sentence, as a cell of a table."""
    return _cell(re.split(r"(?<=\.)\s+(?=[A-Z])", said)[0])


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
