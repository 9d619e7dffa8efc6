"""What work that takes long tells of itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

Item = TypeVar("Item")
Progress = Callable[[str, int, int], None]
"""Told words, the steps done and their count."""


def counted(
    items: Iterable[Item], progress: Progress | None, words: str, count: int, done: int = 0
) -> Iterator[Item]:
    """Pass items on, each of which is a step that is done as soon as the next one is asked for.

    Parameters
    ----------
    items : iterable
        What is passed on.
    progress : callable, optional
        Told words, the steps done and their count, before the first item too.
    words : str
        What the steps are.
    count : int
        Number of all steps.
    done : int
        Steps that were done before.
    """
    report = progress or (lambda words, done, count: None)
    report(words, done, count)
    for number, item in enumerate(items, done + 1):
        yield item
        report(words, number, count)
