"""Models of pads as HDF5 files, written whole or not at all."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING

import numpy as np

from fringeforce.design import parse_sensor
from fringeforce.errors import FileFormatError
from fringeforce.pads.design import Pad
from fringeforce.pads.influence import PadInfluence
from fringeforce.pads.model import PadModel
from fringeforce.pads.symmetry import PARITIES, load_basis
from fringeforce.storage import existing_file, new_file, read, text, write

if TYPE_CHECKING:
    PathLike = str | os.PathLike[str]

PAD = "pad"
"""Kind of these files."""
LABELS = tuple(
    "_".join("even" if sign > 0 else "odd" for sign in parity) + "_{}" for parity in PARITIES
)


def save_pad(model: PadModel, path: PathLike) -> None:
    """Write a model: design text, provenance, and the compressed influence."""
    influence = model.influence
    slices, modes = influence.profile.shape
    with new_file(path, PAD) as file:
        file.attrs["design"] = model.sensor.to_toml()
        file.attrs["provenance"] = json.dumps(dict(model.provenance))
        write(file, "x", influence.x, ("x",), "m", "samples along the pad")
        write(file, "y", influence.y, ("y",), "m", "samples across the pad")
        write(file, "slice", np.arange(slices), ("slice",), None, "from the mirror to the base")
        heights = model.slice_heights
        write(file, "height", heights, ("slice",), "m", "of slices; the loaded surface is 0")
        write(file, "mode", np.arange(modes), ("mode",), None, "number of the depth profile")
        write(file, "profile", influence.profile, ("slice", "mode"), "1", "depth profiles")
        for label, quarter in zip(LABELS, influence.quarters, strict=True):
            name = label.format("influence")
            file.create_dataset(name, data=quarter)
            file[name].attrs["long_name"] = "spline coefficients of retardance per load"
            file[name].attrs["units"] = "rad/N"


def load_pad(path: PathLike) -> PadModel:
    """Read a model that `PadModel.save` wrote.

    Raises
    ------
    FileFormatError
        If the file is missing, truncated, of another kind, or damaged.
    """
    with existing_file(path, PAD) as file:
        pad = parse_sensor(text(file, "design"), source=f"The design inside {path}")
        provenance = json.loads(text(file, "provenance"))
        x, y, profile = (read(file, name) for name in ("x", "y", "profile"))
        quarters = tuple(read(file, label.format("influence")) for label in LABELS)
    rows = 2 * profile.shape[1] * (len(x) // 2) * (len(y) // 2)
    expected = (
        [(rows, len(load_basis(pad.tactels.count, parity))) for parity in PARITIES]
        if isinstance(pad, Pad)
        else []
    )
    if [quarter.shape for quarter in quarters] != expected:
        raise FileFormatError(
            f"{path} is damaged: its influence does not fit its design. Characterise it again."
        )
    return PadModel(pad, PadInfluence(pad.tactels.count, x, y, profile, quarters), provenance)
