"""Models and images of pads as HDF5 files, written whole or not at all."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.design import parse_sensor
from fringeforce.errors import FileFormatError
from fringeforce.pads.design import Pad
from fringeforce.pads.influence import PadInfluence
from fringeforce.pads.model import PadModel
from fringeforce.pads.symmetry import PARITIES, load_basis
from fringeforce.storage import (
    HDF5,
    existing_file,
    format_of,
    load_array,
    new_file,
    read,
    text,
    write,
    write_forces,
    write_frames,
)

if TYPE_CHECKING:
    PathLike = str | os.PathLike[str]

PAD, IMAGES, DATASET = "pad", "images", "dataset"
"""Kinds of these files."""
COMPONENTS = ("normal", "tangential_x", "tangential_y")
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


def save_images(
    path: PathLike, images: ArrayLike, pad: Pad, forces: ArrayLike | None = None
) -> None:
    """Write frames of a pad, and the forces behind them where they are known.

    Parameters
    ----------
    path : path
        Of the HDF5 file.
    images : array_like, shape (k, rows, columns) or (k, channels, rows, columns)
        Grey levels.
    pad : Pad
        Whose they are.
    forces : array_like, shape (k, n, 3), optional
        N, T_x, T_y [N].
    """
    x, y = pad.pixel_positions
    places = {"y": (y, "places of the rows"), "x": (x, "places of the columns")}
    with new_file(path, IMAGES) as file:
        write_frames(file, np.asarray(images), places)
        if forces is not None:
            write_forces(file, forces, COMPONENTS)


def load_images(path: PathLike) -> NDArray[Any]:
    """Read frames of a pad from HDF5, a data set's too, .npy, a PNG, or a stack in a TIFF.

    Parameters
    ----------
    path : path
        The file; its ending says what it is.

    Returns
    -------
    ndarray, shape (k, rows, columns) or (k, channels, rows, columns)
        Grey levels as stored.

    Raises
    ------
    FileFormatError
        If the file is missing, damaged, or of a kind that is not read.
    """
    if format_of(path) == f"fringeforce-{DATASET}":
        with existing_file(path, DATASET) as file:
            return read(file, "image")
    if Path(path).suffix.lower() in HDF5:
        with existing_file(path, IMAGES) as file:
            # a recording that was killed may end with images that nothing was said of yet
            return read(file, "grey")[: read(file, "frame").size]
    images = load_array(path)
    images = images[None] if images.ndim == 2 else images
    if images.ndim not in (3, 4) or images.dtype.kind not in "uif":
        raise FileFormatError(
            f"{path} holds {images.dtype} of shape {images.shape}; images of a pad are grey levels "
            "of shape (frames, rows, columns), or (frames, channels, rows, columns)."
        )
    return images
