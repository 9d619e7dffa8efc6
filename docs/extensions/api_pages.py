"""Pages of the API: a page for each room of the package, with every public thing in it."""

from __future__ import annotations

import ast
import inspect
import pkgutil
from collections import defaultdict
from importlib import import_module

import fringeforce

TOP = "fringeforce"


def rooms() -> dict[str, list[str]]:
    """Modules of every package, the top first; packages that only hold others are left out."""
    found = defaultdict(list)
    for module in pkgutil.walk_packages(fringeforce.__path__, f"{TOP}."):
        if module.ispkg:
            found[module.name] += []
        else:
            found[module.name.rpartition(".")[0]].append(module.name)
    return {name: sorted(found[name]) for name in sorted(found)}


def page(room: str, modules: list[str]) -> str:
    """A page in reStructuredText."""
    parts = [_heading(room, "="), _first_line(room)]
    for module in modules:
        elsewhere = [name for name in fringeforce.__all__ if home(name) == module]
        here = [name for name in members(module) if name not in elsewhere]
        shown = f"\n   :members: {', '.join(here)}" if here else ""
        parts += [_heading(module, "-"), f".. automodule:: {module}{shown}"]
        if elsewhere:
            links = ", ".join(f":doc:`{name} <../api/{name}>`" for name in elsewhere)
            parts.append(f"On pages of their own: {links}.")
    return "\n\n".join(parts) + "\n"


def members(module: str) -> list[str]:
    """What a module defines itself and describes."""
    tree = ast.parse(inspect.getsource(import_module(module)))
    found = [node for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)]
    return [
        node.name for node in found if ast.get_docstring(node) and not node.name.startswith("_")
    ]


def index(names: list[str]) -> str:
    """The table of all rooms."""
    rows = [f"   {name}" for name in names]
    lines = [f"* :doc:`{name}`: {_first_line(name)}" for name in names]
    parts = [
        _heading("All modules", "="),
        "What stands behind the public names, room by room.",
        "\n".join(lines),
        ".. toctree::\n   :hidden:\n\n" + "\n".join(rows),
    ]
    return "\n\n".join(parts) + "\n"


def home(name: str) -> str:
    """The module that a public name comes from."""
    return getattr(fringeforce, name).__module__


def public(name: str) -> str:
    """The page of a public name."""
    thing = getattr(fringeforce, name)
    kind = "autofunction"
    if isinstance(thing, type):
        kind = "autoexception" if issubclass(thing, Exception) else "autoclass"
    options = "" if kind == "autofunction" else "\n   :members:\n   :undoc-members:"
    return f"{_heading(name, '=')}\n\n.. currentmodule:: {TOP}\n\n.. {kind}:: {name}{options}\n"


def _first_line(module: str) -> str:
    return (import_module(module).__doc__ or "").strip().splitlines()[0]


def _heading(text: str, under: str) -> str:
    return f"{text}\n{under * len(text)}"
