"""Readings, with their frames if wanted, appended to an HDF5 file that survives a crash.

The file is in single-writer multiple-reader mode: what `write` has returned from stays readable
when the process is killed at any moment, and others can read along while it grows.

A kill can end a write of the system between two pages of memory.  So the bytes of a row are written
once and never again, each row has a checksum of its own, and what the library does write in place,
its descriptions and indexes, lies within one page each.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from math import prod
from typing import Any, NamedTuple

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
from fringeforce.io.row_checksums import CHECKSUMS, COVERED, rows_crc32
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
CHUNK_BYTES, FRAME_CHUNK_BYTES = 2**18, 2**20
"""Room for the numbers, and for the grey levels, of the rows that are kept together.

It is taken on the disk only as rows fill it.  Parts of an index are larger than a page after 8,000
times as much, 8 GB of frames; the moment in which a kill can tear one of them, some 100 ns, then
comes once for each room that is begun.
"""
PAGE = 4096
"""Bytes of the system's smallest pages; a write within one page is done, or not done, at a kill."""


def _contact_columns(columns: tuple[str, ...]) -> dict[str, tuple[str, float]]:
    """Names of the numbers of contacts, their units, and the size of the table's units in these."""
    parts = (name.rpartition("_") for name in columns)
    return {f"contact_{name}": UNITS[unit] for name, _, unit in parts}


class _Column(NamedTuple):
    """What there is of each frame: dimensions after `frame`, type, meaning and unit."""

    dimensions: tuple[str, ...]
    dtype: DTypeLike
    meaning: str
    unit: str = ""


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
        self._covered: dict[str, tuple[str, ...]] = {}
        with whole_file(path) as place:  # the library does not recover from a disk that is full
            place.write_bytes(bytes(ROOM))
        with writing(path):
            self._file = h5py.File(
                path,
                "w",
                libver="latest",
                track_order=True,
                fs_strategy="page",
                fs_page_size=PAGE,
                rdcc_nbytes=0,  # rows go to the file as they are, not with others kept with them
            )
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
        columns: dict[str, Any] = {
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
        columns = {
            name: np.asarray(values, dataset(self._file, name).dtype)
            for name, values in columns.items()
        }
        for checksum, names in self._covered.items():
            columns[checksum] = rows_crc32([columns[name] for name in names])
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
            tactels = np.arange(1, sensor.tactels.total + 1)
            write(file, "tactel", tactels, ("tactel",), None, "number of the tactel")
        numbers: dict[str, _Column] = {
            "frame": _Column((), np.int64, f"running number of the {what}"),
            "time": _Column((), float, f"when the {what} was exposed", SECONDS),
            "forces": _Column(FORCE_AXES, float, "forces", "N"),
            "std": _Column(FORCE_AXES, float, "standard deviations of the forces", "N"),
        }
        if is_skin(sensor):
            meaning = "number of the contact, the strongest first; 0 is all together"
            write(file, "contact", np.arange(ROWS), ("contact",), None, meaning)
            for name, (unit, _) in _contact_columns(contact_columns(sensor.components)).items():
                numbers[name] = _Column(("contact",), float, name.replace("_", " "), unit)
        numbers["chi2"] = _Column((), float, "reduced chi-square")
        numbers["status"] = _Column((), np.uint8, "verdict")
        self._growing(numbers, CHUNK_BYTES, CHECKSUMS[0])
        status = dataset(file, "status")
        status.attrs["flag_values"] = np.array(list(CODES.values()), dtype=np.uint8)
        status.attrs["flag_meanings"] = " ".join(status.name for status in CODES)
        if self._frames:
            grey = self._describe_pixels(model)
            self._growing({"grey": grey}, FRAME_CHUNK_BYTES, CHECKSUMS[1])

    def _describe_pixels(self, model: SensorModel | PadModel) -> _Column:
        places = pixel_axes(model.pixel_positions)
        for name, (values, meaning) in places.items():
            write(self._file, name, np.asarray(values), (name,), "m", meaning)
        axes = tuple(places)
        if len(model.frame_shape) > len(axes):
            numbers = np.arange(1, model.frame_shape[0] + 1)
            write(self._file, "channel", numbers, ("channel",), None, "number of the channel")
            axes = "channel", *axes
        return _Column(
            axes, np.uint8 if model.sensor.camera.bits <= 8 else np.uint16, "grey levels"
        )

    def _growing(self, columns: Mapping[str, _Column], room: int, checksum: str) -> None:
        """Make columns whose rows come as frames do, and that of their checksums."""
        shapes = {
            name: tuple(dataset(self._file, axis).shape[0] for axis in column.dimensions)
            for name, column in columns.items()
        }
        sizes = (prod(shapes[name]) * np.dtype(columns[name].dtype).itemsize for name in columns)
        length = max(room // sum(sizes), 1)
        of = "picture" if "grey" in columns else "numbers"
        check = _Column((), np.uint32, f"CRC-32 of the {of} of each frame")
        for name, column in {**columns, checksum: check}.items():
            shape = shapes.get(name, ())
            made = self._file.create_dataset(
                name,
                (0, *shape),
                column.dtype,
                maxshape=(None, *shape),
                chunks=(length, *shape),
                fill_time="never",  # rows are written before they are counted
            )
            describe(made, ("frame", *column.dimensions), column.unit, column.meaning)
        dataset(self._file, checksum).attrs[COVERED] = " ".join(columns)
        self._covered[checksum] = tuple(columns)
