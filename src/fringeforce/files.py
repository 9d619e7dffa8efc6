"""HDF5 files: models and frames, written whole or not at all, readable by xarray.

Every dimension is a named scale and every quantity carries its unit, so that
``xarray.open_dataset(path, engine="h5netcdf")`` shows the same arrays with labels.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.calibration.files import (
    read_calibration,
    read_imaging,
    write_calibration,
    write_imaging,
)
from fringeforce.design import parse_sensor
from fringeforce.errors import FileFormatError
from fringeforce.model import SensorModel
from fringeforce.pads.files import DATASET, PAD, load_pad
from fringeforce.storage import (
    FORCE_AXES,
    HDF5,
    existing_file,
    format_of,
    load_array,
    new_file,
    read,
    read_by_tactel,
    text,
    write,
    write_forces,
    write_frames,
)

if TYPE_CHECKING:
    PathLike = str | os.PathLike[str]

COMPONENTS = ("normal", "tangential")


def save_model(model: SensorModel, path: PathLike) -> None:
    """Write a model: influence matrix, design text, provenance, and its calibration if any."""
    sensor = model.sensor
    with new_file(path, "model") as file:
        file.attrs["design"] = sensor.to_toml()
        file.attrs["provenance"] = json.dumps(dict(model.provenance))
        write(file, "x", model.x, ("x",), "m", "stations along the strip")
        write(file, "component", COMPONENTS, ("component",), None, "direction of the force")
        write(file, "tactel", sensor.tactels.positions, ("tactel",), "m", "places of the tactels")
        write(file, "breaks", model.breaks, ("breaks",), "m", "boundaries of the elements")
        write(file, "psi", model.psi, ("x", *FORCE_AXES), "rad/N", "influence matrix")
        if model.imaging is not None:
            write_imaging(file, model.imaging)
        if model.calibration is not None:
            write_calibration(file, model.calibration)


def load_model(path: PathLike) -> Any:
    """Read a model that `SensorModel.save` or `PadModel.save` wrote.

    Returns
    -------
    SensorModel or fringeforce.pads.model.PadModel

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
    return load_pad(path) if format_of(path) == f"fringeforce-{PAD}" else load_strip_model(path)


def load_strip_model(path: PathLike) -> SensorModel:
    """Read the model of a strip, as `load_model`; FileFormatError if it is a pad's."""
    if format_of(path) == f"fringeforce-{PAD}":
        raise FileFormatError(
            f"{path} is the model of a planar pad, and this works on strips only; pads go with "
            "simulate, read, live, show, explore and, in Python, PadReader."
        )
    with existing_file(path, "model") as file:
        model = SensorModel(
            sensor=parse_sensor(text(file, "design"), source=f"The design inside {path}"),
            breaks=read(file, "breaks"),
            psi=read_by_tactel(file, "psi"),
            provenance=json.loads(text(file, "provenance")),
            imaging=read_imaging(file),
            calibration=read_calibration(file),
        )
    expected = (model.sensor.tactels.count, 2)
    columns = len(model.breaks) - 1
    imaging = model.imaging
    if imaging is not None and len(imaging.positions) != model.sensor.camera.pixels:
        raise FileFormatError(
            f"{path} is damaged: its imaging has {len(imaging.positions)} pixels and its camera "
            f"{model.sensor.camera.pixels}. Calibrate the sensor again."
        )
    if model.psi.shape[1:] != expected or columns < 1 or len(model.psi) % columns:
        raise FileFormatError(
            f"{path} is damaged: an influence matrix of shape {model.psi.shape} does not fit "
            f"{columns} elements and {expected[0]} tactels. Characterise the design again."
        )
    return model


def save_frames(
    path: PathLike, frames: ArrayLike, x: ArrayLike, forces: ArrayLike | None = None
) -> None:
    """Write frames, and the forces behind them where they are known.

    Parameters
    ----------
    path : path
        Of the HDF5 file.
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
