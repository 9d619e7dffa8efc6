"""Models from their HDF5 files, whatever sensor they are of."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fringeforce.base.errors import FileFormatError
from fringeforce.base.storage import format_of
from fringeforce.design.shipped import shipped_designs, shipped_pads
from fringeforce.models.pad import PAD, PadModel
from fringeforce.models.strip import SensorModel

if TYPE_CHECKING:
    PathLike = str | os.PathLike[str]


def load_model(path: PathLike) -> Any:
    """Read a model that `SensorModel.save` or `PadModel.save` wrote.

    Returns
    -------
    SensorModel or fringeforce.models.pad.PadModel

    Raises
    ------
    FileFormatError
        If the file is missing, truncated, of another kind, or damaged.

    Examples
    --------
    >>> ff.characterize(ff.load_sensor("saad")).save("model.h5")
    >>> ff.load_model("model.h5").sensor.tactels.count
    11
    """
    _refuse_design(path)
    return (PadModel if _is_pad(path) else SensorModel).load(path)


def _refuse_design(path: PathLike) -> None:
    """Raise FileFormatError for a design in the place of a model."""
    name, file = os.fspath(path), Path(path)
    shipped = {**shipped_designs(), **shipped_pads()}
    if file.suffix.lower() == ".toml" or (name in shipped and not file.exists()):
        raise FileFormatError(
            f"{name} is a design, and a model is needed here; make one with  fringeforce "
            f"calibrate, or without known loads with  fringeforce characterize {name} -o model.h5"
        )


def _is_pad(path: PathLike) -> bool:
    return format_of(path) == f"fringeforce-{PAD}"
