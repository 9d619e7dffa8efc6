"""Libraries that only some users need."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from fringeforce.base.errors import InputError


def extra(module: str, group: str) -> ModuleType:
    """Import a module of an optional group.

    Parameters
    ----------
    module : str
        Dotted name of the module.
    group : str
        The group of extras that installs it.

    Raises
    ------
    InputError
        If it cannot be imported; the message says how to install it.
    """
    try:
        return import_module(module)
    except (ImportError, RuntimeError) as error:
        raise InputError(
            f"{module.partition('.')[0]} cannot be imported ({error}); "
            f"run  pip install '.[{group}]'  in the folder of fringeforce"
        ) from None
