"""How loops are compiled, so that the first use of a machine waits no longer than it must.

Most of that time goes into what surrounds a function: a door for Python, which unpacks some fifty
arrays, and the code of all that it calls, which is made again for every caller.
"""

from __future__ import annotations

from typing import Any

from numba import njit

_DOORLESS: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}

entry = njit(cache=True, error_model="numpy", nogil=True)
"""Compiles what Python calls."""
inner = njit(cache=True, error_model="numpy", **_DOORLESS)
"""Compiles what only compiled functions call: it has no door, and Python that calls it crashes."""
part = njit(error_model="numpy", inline="always")
"""Makes what is tiny, or called from one place only, a part of its callers."""

_REORDERED: Any = {"reassoc", "contract", "arcp", "nsz"}
"""Freedom to reorder sums, so that they run in vector units; not-a-number keeps its meaning."""
sums_entry = njit(cache=True, error_model="numpy", nogil=True, fastmath=_REORDERED)
"""Compiles what Python calls and what consists of sums."""
sums = njit(cache=True, error_model="numpy", fastmath=_REORDERED, **_DOORLESS)
"""Compiles what only such functions call."""


@sums
def copied(line, out):
    """Copy a line into another of its length.

    `out[:] = line` would compile into every caller the words of an error for unlike shapes, and
    whatever copies lines that overlap: that doubles the time of small functions.
    """
    for k in range(len(out)):
        out[k] = line[k]
