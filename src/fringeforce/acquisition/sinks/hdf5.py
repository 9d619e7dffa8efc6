"""Readings, with their frames if wanted, appended to an HDF5 file that survives a crash.

The file is in single-writer multiple-reader mode: what `write` has returned from stays readable
when the process is killed at any moment, and others can read along while it grows.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from math import prod

import h5py
import numpy as np
from numpy.typing import DTypeLike

from fringeforce.acquisition.sinks.contact_rows import ROWS, columns_of, contact_table, is_skin
from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.base.storage import (
    FORCE_AXES,
    dataset,
    describe,
    stamp,
    whole_file,
    write,
    writing,
)
from fringeforce.io.frames import FRAMES, pixel_axes
from fringeforce.io.tables import contact_columns
from fringeforce.models.pad import PadModel
from fringeforce.models.strip import SensorModel
from fringeforce.reading.reading import Status

SECONDS = "seconds since 1970-01-01"
CODES = {status: code for code, status in enumerate(Status)}
UNITS = {"mm": ("m", 1e-3), "N": ("N", 1.0), "deg": ("rad", np.pi / 180), "Nmm": ("N m", 1e-3)}
"""SI units of the columns of a table of contacts by how their names end, and sizes in them."""
ROOM = 2**18
"""Bytes that have to be free on the disk before a file begins: its description and first rows."""
CHUNK, FRAME_CHUNK = 256, 64
"""Most rows of numbers, and of grey levels, that are kept together."""
CHUNK_BYTES = 2**17
"""Room for them: whoever appends a row writes all that is kept together with it."""


def _contact_columns(columns: tuple[str, ...]) -> dict[str, tuple[str, float]]:
    """Names of the numbers of contacts, their units, and the size of the table's units in these."""
    parts = (name.rpartition("_") for name in columns)
    return {f"contact_{name}": UNITS[unit] for name, _, unit in parts}


class Hdf5Sink(Sink):
    """Appends readings to an HDF5 file.

    Parameters
    ----------
    path : path
        Path of the file, which is written anew.
    model : SensorModel or PadModel
        The sensor, which names the places of pixels and tactels.
    frames : bool
        Record the grey levels too; `load_frames` and `fringeforce read` then read them again.

    Raises
    ------
    FileFormatError
        If the file cannot be written.
    """

    interval = 0.2

    def __init__(
        self,
        path: str | os.PathLike[str],
        model: SensorModel | PadModel,
        frames: bool = False,
    ) -> None:
        self.name = f"{'recording' if frames else 'HDF5'} {os.fspath(path)}"
        self._frames, self._count = frames, 0
        with whole_file(path) as place:  # the library does not recover from a disk that is full
            place.write_bytes(bytes(ROOM))
        with writing(path):
            self._file = h5py.File(path, "w", libver="latest", track_order=True)
        self._describe(model)
        # no names or attributes can be added from here on
        self._file.swmr_mode = True

    def write(self, readings: Readings) -> None:
        """Append a block."""
        with self._left_if_full():
            self._append(readings)

    @contextmanager
    def _left_if_full(self) -> Iterator[None]:
        """Leave the file as it is if the disk takes no more.

        The library would end the process when it cannot write while it closes a file; what it still
        has to write goes nowhere.
        """
        try:
            yield
        except (OSError, RuntimeError) as error:
            # the library keeps the number of the system's error in its text only
            number = re.search(r"errno = (\d+)", str(error))
            if number is None:
                raise
            nowhere = os.open(os.devnull, os.O_RDWR)
            os.dup2(nowhere, self._file.id.get_vfd_handle())
            os.close(nowhere)
            raise OSError(int(number[1]), os.strerror(int(number[1]))) from None

    def _append(self, readings: Readings) -> None:
        columns = {
            "frame": np.arange(readings.first, readings.first + len(readings)),
            "time": readings.timestamps,
            "forces": readings.forces,
            "std": readings.std,
            "chi2": readings.chi2,
            "status": [CODES[status] for status in readings.status],
        }
        if readings.resultants is not None:
            values = np.moveaxis(contact_table(readings), 2, 0)
            named = _contact_columns(columns_of(readings))
            for (name, (_, size)), numbers in zip(named.items(), values, strict=True):
                columns[name] = size * numbers
        if self._frames:
            columns["grey"] = readings.lines
        end = self._count + len(readings)
        # the number of the frame comes last: a reader that sees it finds all the rest
        for name in reversed(columns):
            column = dataset(self._file, name)
            column.resize(end, axis=0)
            column[self._count : end] = columns[name]
            column.flush()
        self._count = end

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _describe(self, model: SensorModel | PadModel) -> None:
        file, sensor = self._file, model.sensor
        what = "line" if sensor.dimensions == 1 else "image"
        stamp(file, FRAMES if self._frames else "readings")
        file.attrs["design"] = model.sensor.to_toml()
        components = np.array(sensor.components, dtype="S")
        write(file, "component", components, ("component",), None, "direction of the force")
        if sensor.dimensions == 1:
            places = sensor.tactels.places[:, 0]
            write(file, "tactel", places, ("tactel",), "m", "places of the tactels")
        else:
            numbers = np.arange(1, sensor.tactels.total + 1)
            write(file, "tactel", numbers, ("tactel",), None, "number of the tactel")
        self._growing("frame", (), np.int64, f"running number of the {what}")
        self._growing("time", (), float, f"when the {what} was exposed", SECONDS)
        self._growing("forces", FORCE_AXES, float, "forces", "N")
        self._growing("std", FORCE_AXES, float, "standard deviations of the forces", "N")
        if is_skin(sensor):
            meaning = "number of the contact, the strongest first; 0 is all together"
            write(file, "contact", np.arange(ROWS), ("contact",), None, meaning)
            for name, (unit, _) in _contact_columns(contact_columns(sensor.components)).items():
                self._growing(name, ("contact",), float, name.replace("_", " "), unit)
        self._growing("chi2", (), float, "reduced chi-square")
        status = self._growing("status", (), np.uint8, "verdict")
        status.attrs["flag_values"] = np.array(list(CODES.values()), dtype=np.uint8)
        status.attrs["flag_meanings"] = " ".join(status.name for status in CODES)
        if self._frames:
            self._describe_pixels(model)

    def _describe_pixels(self, model: SensorModel | PadModel) -> None:
        places = pixel_axes(model.pixel_positions)
        for name, (values, meaning) in places.items():
            write(self._file, name, np.asarray(values), (name,), "m", meaning)
        axes = tuple(places)
        if len(model.frame_shape) > len(axes):
            numbers = np.arange(1, model.frame_shape[0] + 1)
            write(self._file, "channel", numbers, ("channel",), None, "number of the channel")
            axes = "channel", *axes
        dtype = np.uint8 if model.sensor.camera.bits <= 8 else np.uint16
        self._growing("grey", axes, dtype, "grey levels")

    def _growing(
        self, name: str, dimensions: tuple[str, ...], dtype: DTypeLike, meaning: str, unit: str = ""
    ) -> h5py.Dataset:
        shape = tuple(dataset(self._file, dimension).shape[0] for dimension in dimensions)
        row = max(prod(shape) * np.dtype(dtype).itemsize, 1)
        most = FRAME_CHUNK if name == "grey" else CHUNK
        length = min(most, max(CHUNK_BYTES // row, 1))
        column = self._file.create_dataset(
            name,
            (0, *shape),
            dtype,
            maxshape=(None, *shape),
            chunks=(length, *shape),
            fletcher32=True,
        )
        describe(column, ("frame", *dimensions), unit, meaning)
        return column
