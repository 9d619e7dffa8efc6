"""Commands that were typed wrongly, told in one line: what was given, what may be, the usage."""

from __future__ import annotations

import sys
from typing import Any

import typer

from fringeforce.cli.help import plain

USAGE_ERROR: type[Any] = typer.BadParameter.__bases__[0]
"""What Typer raises for a command line that it cannot take."""
MUST_BE = {"int": "a whole number", "float": "a number"}
"""Kinds of values of options, as the parser of values calls them, in words."""


def tell(error: Any) -> None:
    """Print what is wrong with a command line, or the help where nothing at all was asked.

    Parameters
    ----------
    error : Exception
        Of the kind `USAGE_ERROR`.
    """
    context = error.ctx
    if context is not None and error.message == context.get_help():
        print(error.message, file=sys.stderr)
        return
    words = _in_words(error)
    words = words if words.endswith("?") else f"{words.rstrip('.')}."
    if context is not None:
        words = f"{words} {' '.join(context.get_usage().split())} (-h explains)."
    print(f"fringeforce: {words}", file=sys.stderr)


def _in_words(error: Any) -> str:
    """What is wrong, with the value that was given and what may be."""
    parameter = getattr(error, "param", None)
    details = getattr(error.__cause__, "errors", None)
    if details is None or parameter is None:
        text = " ".join(str(error.format_message()).split())
        about = getattr(parameter, "help", None)
        return f"{text.rstrip('.')}: {plain(about)}" if about and text.endswith(".") else text
    first = details()[0]
    kind = first["type"].partition("_")[0]
    # the words of an error of a choice name its value and all others
    said = str(first.get("ctx", {}).get("error", ""))
    given = f"{first['input']!r} must be {MUST_BE.get(kind, first['msg'])}"
    return f"{parameter.get_error_hint().replace(chr(39), '')}: {said or given}"
