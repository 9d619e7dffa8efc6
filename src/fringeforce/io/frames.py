"""Frames of strips and pads as HDF5 files, written whole or not at all, readable by xarray.

Every dimension is a named scale and every quantity carries its unit, so that
``xarray.open_dataset(path, engine="h5netcdf")`` shows the same arrays with labels.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.base.arrays import Array
from fringeforce.base.errors import FileFormatError
from fringeforce.base.storage import (
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
from fringeforce.io.row_checksums import read_rows
from fringeforce.io.tables import COMPONENTS

if TYPE_CHECKING:
    PathLike = str | os.PathLike[str]

FRAMES, DATASET = "frames", "dataset"
"""Kinds of these files."""
SHARD = f"fringeforce-{DATASET}"
"""What a file of a data set says it is."""
KINDS = FRAMES, "images"
"""Kinds of recordings; those of pads were called images before."""
SURFACES = {1: "lines of a strip", 2: "images of a pad"}
"""What frames are, by the dimensions of a picture."""


def pixel_axes(positions: Any) -> Mapping[str, tuple[ArrayLike, str]]:
    """Dimensions of a picture in their order: places [m] and what they are.

    Parameters
    ----------
    positions : ndarray, shape (n_pixels,), or pair of ndarray
        `pixel_positions` of a strip's model, or of a pad's: along x and along y [m].
    """
    if isinstance(positions, tuple):
        x, y = positions
        return {"y": (y, "places of the rows"), "x": (x, "places of the columns")}
    return {"x": (positions, "places of the pixels")}


def save_frames(
    path: PathLike,
    frames: ArrayLike,
    positions: Any,
    forces: ArrayLike | None = None,
    times: ArrayLike | None = None,
) -> None:
    """Write frames, and the forces behind them where they are known.

    Parameters
    ----------
    path : path
        Path of the HDF5 file.
    frames : array_like, shape (k, ...) as frames
        Grey levels.
    positions : ndarray, shape (n_pixels,), or pair of ndarray
        `pixel_positions` of the model: of a strip, or along x and along y of a pad [m].
    forces : array_like, shape (k, n, components), optional
        Forces [N].
    times : array_like, shape (k,), optional
        When the frames were exposed [s]; those of a video count from its start.
    """
    with new_file(path, FRAMES) as file:
        write_frames(file, np.asarray(frames), pixel_axes(positions))
        if times is not None:
            write(file, "time", np.asarray(times, float), ("frame",), "s", "when it was exposed")
        if forces is not None:
            write_forces(file, forces, COMPONENTS[np.shape(forces)[-1]])


def load_frames(path: PathLike, dimensions: int = 1) -> NDArray[Any]:
    """Read frames from HDF5, a data set's too, .npy, PNG or TIFF.

    Parameters
    ----------
    path : path
        The file; its ending says what it is (.h5, .hdf5, .npy, .png, .tif, .tiff).
    dimensions : int
        `dimensions` of the sensor: 1 for a strip, where the rows of an image are frames, 2 for a
        pad, where an image is one.

    Returns
    -------
    ndarray, shape (k, n_pixels) or (k, rows, columns), channels after k if there are any
        Grey levels as stored.

    Raises
    ------
    FileFormatError
        If the file is missing, damaged, of a kind that is not read, or of the other kind of sensor.
    """
    if Path(path).suffix.lower() in HDF5 or format_of(path) == SHARD:
        with existing_file(path, *KINDS, DATASET) as file:
            if text(file, "format") == SHARD:
                frames, found = read(file, "image"), 2
            else:
                frames = read_rows(file, "grey", path)
                found = 2 if "y" in file else 1
    else:
        frames, found = load_array(path), dimensions
        frames = frames[None] if frames.ndim == dimensions else frames
        # the rows of a picture are frames of a strip, and what lies behind its columns are colours
        channels = dimensions == 2 or Path(path).suffix.lower() == ".npy"
        if not dimensions < frames.ndim <= dimensions + 1 + channels or (
            frames.dtype.kind not in "uif"
        ):
            axes = "pixels" if dimensions == 1 else "rows, columns"
            raise FileFormatError(
                f"{path} holds {frames.dtype} of shape {frames.shape}; {SURFACES[dimensions]} are "
                f"grey levels of shape (frames, {axes}), or (frames, channels, {axes}) of several "
                f"channels{', in .npy or .h5' * (dimensions == 1)}."
            )
    if found != dimensions:
        raise FileFormatError(
            f"{path} holds {SURFACES[found]}; this sensor's frames are {SURFACES[dimensions]}."
        )
    return frames


def load_applied(path: PathLike) -> Array | None:
    """Forces behind frames, shape (k, n, components) [N]; None where the file holds none.

    Those of a live recording are readings, and none that were applied.
    """
    if Path(path).suffix.lower() not in HDF5:
        return None
    with existing_file(path, *KINDS, DATASET) as file:
        applied = "forces" in file and "status" not in file and text(file, "format") != SHARD
        return read(file, "forces") if applied else None


def load_times(path: PathLike) -> Array | None:
    """When the frames of a recording were exposed, shape (k,) [s]; None if unknown.

    Of cameras since 1970, of videos since their start.
    """
    if Path(path).suffix.lower() not in HDF5:
        return None
    with existing_file(path, *KINDS, DATASET) as file:
        known = "time" in file and text(file, "format") != SHARD
        return read_rows(file, "time", path) if known else None
