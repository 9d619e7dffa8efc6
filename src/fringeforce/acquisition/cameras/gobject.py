"""Aravis from Debian's packages, also inside a virtual environment that does not see them."""

from __future__ import annotations

import sys
import warnings
from importlib import import_module
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from types import ModuleType
from typing import Any

from fringeforce.base.errors import InputError

DIST_PACKAGES = Path("/usr/lib/python3/dist-packages")
PACKAGES = "aravis-tools gir1.2-aravis-0.8 python3-gi"


def aravis() -> ModuleType:
    """The Aravis 0.8 library.

    Raises
    ------
    InputError
        If it is not installed, or belongs to another version of Python.
    """
    try:
        return _imported()
    except (ImportError, ValueError) as error:
        raise InputError(
            f"GenICam cameras need Aravis, which is missing here ({error}); on Debian and Ubuntu: "
            f"apt-get install {PACKAGES}"
        ) from None


def _imported() -> ModuleType:
    if "gi" not in sys.modules and (DIST_PACKAGES / "gi").is_dir():
        _check_version()
        # only while gi itself is found: nothing else shall come from there
        sys.path.append(str(DIST_PACKAGES))
        try:
            gi: Any = import_module("gi")
        finally:
            sys.path.remove(str(DIST_PACKAGES))
    else:
        gi = import_module("gi")
    gi.require_version("Aravis", "0.8")
    with warnings.catch_warnings():
        # its import hook is of an older kind
        warnings.simplefilter("ignore", ImportWarning)
        return import_module("gi.repository.Aravis")


def _check_version() -> None:
    compiled = [path.name for path in (DIST_PACKAGES / "gi").glob("_gi.*.so")]
    if not any(name == f"_gi{suffix}" for name in compiled for suffix in EXTENSION_SUFFIXES):
        running = f"{sys.version_info.major}.{sys.version_info.minor}"
        raise InputError(
            f"Debian's python3-gi is not built for Python {running} ({', '.join(compiled)}); run "
            "fringeforce with the system's python3, such as in an environment made by "
            "/usr/bin/python3 -m venv."
        )
