"""What takes long: a bar, and a word where loops are compiled."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def progress_bar(title: str = "", width: int = 24) -> Iterator[Callable[[str, int, int], None]]:
    """A bar on the terminal with an estimate of the time that is left.

    Parameters
    ----------
    title : str
        Shown until the first step tells of itself.
    width : int
        Letters that titles have room for.
    """
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn(f"{{task.description:<{width}}}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    console = Console(stderr=True)
    with Progress(*columns, console=console, disable=not sys.stderr.isatty()) as progress:
        task = progress.add_task(title)

        def advance(title: str, done: int, expected: int) -> None:
            progress.update(task, description=title, completed=done, total=expected)

        yield advance


@contextmanager
def compiling() -> Iterator[None]:
    """Say so, once, if loops are compiled meanwhile; nothing if they are only loaded."""
    from numba.core.event import Event, Listener, install_listener

    class Once(Listener):
        told = False

        def on_start(self, event: Event) -> None:
            if not self.told:
                self.told = True
                words = "Compiling for this machine, once; it takes some minutes ..."
                print(words, file=sys.stderr, flush=True)

        def on_end(self, event: Event) -> None:
            pass

    with install_listener("numba:compile", Once()):
        yield
