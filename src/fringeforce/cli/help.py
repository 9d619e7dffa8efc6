"""What `-h` says, in words of the command and none of Python."""

from __future__ import annotations

import re
from typing import Any

from typer.core import TyperArgument, TyperCommand, TyperOption

HYPHEN, SPACE = "\u2011", "\u00a0"
"""Those at which no line is broken."""
KEPT_TOGETHER = re.compile(r"(?<=\w)-(?=\w)|(?<!\w)(['\"`])[^'\"`]*\1")
"""Words with a hyphen, and what is quoted: both are there to be copied."""


class Command(TyperCommand):
    """A command whose help shows arguments by their names alone, and breaks no name or example.

    Typer puts the type of Python behind each argument, such as `list[Path]`; what it is stands in
    its help, and what an option takes in its metavar.
    """

    def __init__(self, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        for parameter in self.params:
            if isinstance(parameter, TyperArgument | TyperOption):
                parameter.help = KEPT_TOGETHER.sub(_unbroken, parameter.help or "")
            if isinstance(parameter, TyperArgument):
                setattr(parameter, "display_type", _no_type)  # noqa: B010

    def get_help(self, ctx: Any) -> str:
        """The help, broken into lines."""
        return plain(super().get_help(ctx))


def plain(text: str) -> str:
    """Text of a help with the hyphens and spaces that a keyboard has."""
    return text.replace(HYPHEN, "-").replace(SPACE, " ")


def _unbroken(found: re.Match[str]) -> str:
    return found[0].replace("-", HYPHEN).replace(" ", SPACE)


def _no_type(ctx: object) -> str:
    """What Typer shows behind the name of an argument."""
    return ""
