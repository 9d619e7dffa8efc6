"""Numbers of things in words."""

from __future__ import annotations


def counted(count: int, things: str, one: str = "") -> str:
    """A number and what it is of, such as "1 frame" or "12 frames".

    Parameters
    ----------
    count : int
        How many.
    things : str
        What more than one is called.
    one : str
        What one is called, with what else belongs to it; `things` without its last letter if not
        given.

    Examples
    --------
    >>> from fringeforce.base.words import counted
    >>> counted(1, "frames"), counted(0, "frames"), counted(1, "designs are", "design is")
    ('1 frame', '0 frames', '1 design is')
    """
    return f"{count} {(one or things[:-1]) if count == 1 else things}"
