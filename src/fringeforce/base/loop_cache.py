"""Where compiled loops are kept if neither the package nor the home folder can be written."""

from __future__ import annotations

import atexit
import os
import sys
from pathlib import Path

PACKAGE = Path(__file__).parents[1]
VARIABLE = "NUMBA_CACHE_DIR"


def keep_loops() -> str | None:
    """Let Numba keep compiled loops in a new folder where it has no other.

    It would refuse to compile otherwise.  Processes that this one starts share the folder, which is
    removed at its end: each run compiles once.

    Returns
    -------
    str or None
        The folder; none if there is another.

    Examples
    --------
    >>> from fringeforce.base.loop_cache import keep_loops
    >>> keep_loops() is None
    True
    """
    if os.environ.get(VARIABLE) or os.access(PACKAGE, os.W_OK | os.X_OK):
        return None
    import tempfile  # seldom needed, and `import fringeforce` is instant

    if _takes_files(_user_cache()):
        return None
    try:
        folder = tempfile.mkdtemp(prefix="fringeforce-loops-")
    except OSError:  # nothing can be written anywhere
        return None
    os.environ[VARIABLE] = folder
    if "numba" in sys.modules:  # it has read its variables already
        sys.modules["numba"].config.CACHE_DIR = folder
    atexit.register(_remove, folder, os.getpid())
    return folder


def _user_cache() -> Path:
    """Where Numba looks first, or above it, in the home folder."""
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:  # there is no home
        return Path(os.devnull)


def _takes_files(folder: Path) -> bool:
    """Whether a folder, or the first one above that exists, takes a new file."""
    import tempfile

    there = next(one for one in (folder, *folder.parents) if one.exists())
    try:
        with tempfile.TemporaryDirectory(dir=there):
            return True
    except OSError:
        return False


def _remove(folder: str, owner: int) -> None:
    import shutil

    if os.getpid() == owner:  # and not a fork of it
        shutil.rmtree(folder, ignore_errors=True)
