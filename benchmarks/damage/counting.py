"""What became of bad input: refused with a clear error, taken rightly, or a failure."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

import fringeforce as ff

LIMIT = 30
"""Seconds for one input."""
LONGEST = 2000
"""Characters of a message that a person can be expected to read."""
Case = tuple[str, Callable[[], Any]]
"""Words for an input, and what tries it; it raises AssertionError if it was taken wrongly."""


@dataclass
class Count:
    """What became of the inputs of a kind."""

    tried: int = 0
    refused: int = 0
    taken: int = 0
    failures: list[str] = field(default_factory=list)

    def add(self, name: str, attempt: Callable[[], Any], limit: int = LIMIT) -> None:
        """Try one input."""
        self.tried += 1
        try:
            with time_limit(limit):
                attempt()
        except ff.FringeforceError as error:
            if len(str(error)) > LONGEST:
                self.failures.append(f"{name}: a message of {len(str(error))} characters")
            else:
                self.refused += 1
        except Exception as error:
            words = str(error).replace(sys.executable, "python")  # no path of this machine
            self.failures.append(f"{name}: {type(error).__name__}: {words}"[-300:])
        else:
            self.taken += 1


@contextmanager
def time_limit(seconds: int) -> Iterator[None]:
    """Raise TimeoutError in what takes longer."""

    def over(*_: object) -> None:
        raise TimeoutError(f"longer than {seconds} s")

    before = signal.signal(signal.SIGALRM, over)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def damaged(content: bytes, rng: np.random.Generator, cut: bool) -> bytes:
    """Bytes with one bit changed, or cut off."""
    if cut:
        return content[: int(rng.integers(len(content)))]
    changed = bytearray(content)
    changed[rng.integers(len(content))] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def refused(attempt: Callable[[], Any]) -> None:
    """Try what cannot be taken in any right way."""
    attempt()
    raise AssertionError("taken, and should not have been")
