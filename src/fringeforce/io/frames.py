"""HDF5 files: models and frames, written whole or not at all, readable by xarray.

Every dimension is a named scale and every quantity carries its unit, so that
``xarray.open_dataset(path, engine="h5netcdf")`` shows the same arrays with labels.
"""

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
from fringeforce.io.images import DATASET
from fringeforce.models.strip import COMPONENTS

if TYPE_CHECKING:
    PathLike = str | os.PathLike[str]


def save_frames(
    path: PathLike, frames: ArrayLike, x: ArrayLike, forces: ArrayLike | None = None
) -> None:
    """Write frames, and the forces behind them where they are known.

    Parameters
    ----------
    path : path
        Path of the HDF5 file.
    frames : array_like, shape (k, n_pixels) or (k, n_channels, n_pixels)
        Grey levels.
    x : array_like, shape (n_pixels,)
        Places of the pixels [m].
    forces : array_like, shape (k, n, 2), optional
        Normal and tangential forces [N].
    """
    with new_file(path, "frames") as file:
        write_frames(file, np.asarray(frames), {"x": (x, "places of the pixels")})
        if forces is not None:
            write_forces(file, forces, COMPONENTS)


def load_frames(path: PathLike) -> NDArray[Any]:
    """Read frames from HDF5, .npy, PNG or TIFF; the rows of an image are frames.

    Parameters
    ----------
    path : path
        The file; its ending says what it is (.h5, .hdf5, .npy, .png, .tif, .tiff).

    Returns
    -------
    ndarray, shape (k, n_pixels) or (k, n_channels, n_pixels)
        Grey levels as stored.

    Raises
    ------
    FileFormatError
        If the file is missing, damaged, or of a kind that is not read.
    """
    if Path(path).suffix.lower() in HDF5:
        with existing_file(path, "frames") as file:
            return read(file, "grey")[: read(file, "frame").size]
    frames = np.atleast_2d(load_array(path))
    if frames.ndim != 2 or frames.dtype.kind not in "uif":
        raise FileFormatError(
            f"{path} holds {frames.dtype} of shape {frames.shape}; frames are grey levels of shape "
            "(frames, pixels)."
        )
    return frames


def load_times(path: PathLike, kind: str = "frames") -> NDArray[np.float64] | None:
    """When the frames of a recording were exposed, shape (k,) [s since 1970]; None if unknown."""
    if Path(path).suffix.lower() not in HDF5 or format_of(path) == f"fringeforce-{DATASET}":
        return None
    with existing_file(path, kind) as file:
        return read(file, "time")[: read(file, "frame").size] if "time" in file else None
