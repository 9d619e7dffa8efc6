"""Design files: the ones that the package ships, and those that people write."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from fringeforce.base.errors import DesignError
from fringeforce.base.storage import CALLED, format_of
from fringeforce.design.pad import Pad
from fringeforce.design.shipped import shipped_designs, shipped_pads
from fringeforce.design.strip import Sensor
from fringeforce.design.text import toml_values
from fringeforce.design.validation import suggestion, validated


def parse_sensor(text: str, source: str = "The design") -> Any:
    """Read the text of a design file; the inverse of `Sensor.to_toml` and `Pad.to_toml`.

    Parameters
    ----------
    text : str
        TOML; ``kind = "pad"`` makes it a pad, otherwise it is a strip.
    source : str
        Names the text in error messages.

    Returns
    -------
    Sensor or fringeforce.design.pad.Pad

    Raises
    ------
    DesignError
        With all problems of the text.
    """
    values = toml_values(text, source)
    kind = values.get("kind", "strip")
    if kind == "pad":
        return validated(Pad, values, source, from_file=True)
    if kind != "strip":
        raise DesignError(f'{source}: kind = {kind!r} is no kind of sensor; take "strip" or "pad".')
    strip = {key: value for key, value in values.items() if key != "kind"}
    return validated(Sensor, strip, source, from_file=True)


def load_sensor(name_or_path: str | os.PathLike[str]) -> Any:
    """Read a design by its name, if the package ships it, or from a file.

    Parameters
    ----------
    name_or_path : str or path
        A shipped design such as "saad" or "pad", or the path of a TOML file.

    Returns
    -------
    Sensor or fringeforce.design.pad.Pad

    Raises
    ------
    DesignError
        If there is no such design, or it has problems; all of them are in the message.

    Examples
    --------
    >>> ff.load_sensor("saad").tactels.count
    11
    """
    shipped = {**shipped_designs(), **shipped_pads()}
    path = shipped.get(str(name_or_path), Path(name_or_path))
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        holds = CALLED.get(format_of(path).removeprefix("fringeforce-"), "no UTF-8 text")
        raise DesignError(
            f"{path} is no design: it holds {holds}; give a design file (.toml), or the name of a "
            "shipped design, such as 'saad' or 'pad'."
        ) from None
    except OSError as error:
        hint = suggestion(str(name_or_path), list(shipped))
        raise DesignError(
            f"There is no design {str(name_or_path)!r} to read ({error.strerror}). "
            f"Give the path of a TOML file or a shipped name: {hint}"
        ) from None
    return parse_sensor(text, source=str(name_or_path))


def load_strip(name_or_path: str | os.PathLike[str]) -> Sensor:
    """Read the design of a strip, as `load_sensor`; DesignError if it is a pad's."""
    sensor = load_sensor(name_or_path)
    if not isinstance(sensor, Sensor):
        raise DesignError(
            f"{str(name_or_path)!r} is a planar pad, and this works on strips only; give the "
            f"design of a strip, such as {', '.join(map(repr, shipped_designs()))}."
        )
    return sensor


def new_design(path: str | os.PathLike[str], like: str = "saad", overwrite: bool = False) -> None:
    """Write a commented design file to start from.

    Parameters
    ----------
    path : path
        Where to write.
    like : str
        The shipped design to copy, comments and all.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    DesignError
        If there is no such design, the file exists, or it cannot be written.
    """
    shipped = {**shipped_designs(), **shipped_pads()}
    if like not in shipped:
        raise DesignError(f"There is no shipped design {like!r}; {suggestion(like, list(shipped))}")
    try:
        with open(path, "w" if overwrite else "x", encoding="utf-8") as file:
            file.write(shipped[like].read_text(encoding="utf-8"))
    except FileExistsError:
        raise DesignError(
            f"{path} exists already and is kept; take another name, or overwrite it: "
            "--force, in Python overwrite=True."
        ) from None
    except OSError as error:
        raise DesignError(f"{path} cannot be written: {error.strerror}.") from None
