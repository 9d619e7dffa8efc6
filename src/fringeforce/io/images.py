"""Models and images of pads as HDF5 files, written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.errors import FileFormatError
from fringeforce.base.storage import (
    HDF5,
    existing_file,
    format_of,
    load_array,
    new_file,
    read,
    write_forces,
    write_frames,
)
from fringeforce.design.pad import Pad
from fringeforce.models.pad import COMPONENTS

if TYPE_CHECKING:
    PathLike = str | os.PathLike[str]

IMAGES, DATASET = "images", "dataset"
"""Kinds of these files."""


def save_images(
    path: PathLike, images: ArrayLike, pad: Pad, forces: ArrayLike | None = None
) -> None:
    """Write frames of a pad, and the forces behind them where they are known.

    Parameters
    ----------
    path : path
        Path of the HDF5 file.
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
