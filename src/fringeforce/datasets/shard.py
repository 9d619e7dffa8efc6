"""Shards: images that are computed in one go, as the bytes of the files that hold them."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fringeforce.datasets.example import Example, example
from fringeforce.datasets.study_file import NAMES, DatasetStudy
from fringeforce.files import new_file
from fringeforce.pads.design import Pad
from fringeforce.pads.model import PadModel, characterize_pad

KIND = "dataset"
IMAGES, FORCES = "images.csv", "forces.csv"
Files = dict[str, bytes]


@dataclass(frozen=True)
class Shard:
    """Some images of a data set: the call that travels to the workers."""

    study: DatasetStudy
    pad: Pad
    first: int
    count: int

    @property
    def name(self) -> str:
        """Of its file or folder."""
        name = f"shard-{self.first // self.study.shard:05d}"
        return f"{name}.h5" if self.study.format == "hdf5" else name

    @property
    def numbers(self) -> range:
        """Of its images."""
        return range(self.first, self.first + self.count)


def examples(shard: Shard) -> list[Example]:
    """Its images."""
    model = _model(shard.pad)
    return [example(model, shard.study, number) for number in shard.numbers]


def packed(shard: Shard) -> Files:
    """Its files: one of HDF5, or pictures and tables."""
    found = examples(shard)
    return _hdf5(shard, found) if shard.study.format == "hdf5" else _pictures(shard, found)


@lru_cache(maxsize=1)
def _model(pad: Pad) -> PadModel:
    """A worker characterises the pad once, for all of its shards."""
    return characterize_pad(pad)


def _hdf5(shard: Shard, found: Sequence[Example]) -> Files:
    pad = shard.pad
    with TemporaryDirectory() as folder:
        path = Path(folder) / shard.name
        with new_file(path, KIND) as file:
            file.attrs["design"] = pad.to_toml()
            file.attrs["seed"] = shard.study.seed
            x, y = pad.pixel_positions
            _write(file, "x", x, "places of the columns of an image [m]")
            _write(file, "y", y, "places of the rows of an image [m]")
            _write(file, "tactel", pad.tactels.places, "places of the tactels, x and y [m]")
            _write(file, "number", np.array(shard.numbers, dtype="<i4"), "of the image")
            parts = np.array([one.part for one in found], dtype=np.uint8)
            _write(file, "split", parts, "0 train, 1 validation, 2 test")
            _write(file, "image", np.stack([one.image for one in found]), "grey levels")
            forces = np.stack([one.forces for one in found]).astype("<f4")
            _write(file, "forces", forces, "N, T_x, T_y of every tactel [N]")
            for name, (table, meaning) in _tables(found).items():
                _write(file, name, table, meaning)
        return {shard.name: path.read_bytes()}


def _write(file: h5py.File, name: str, values: NDArray[np.generic], meaning: str) -> None:
    # an image at a time, as learners shuffle them
    chunks = (1, *values.shape[1:]) if name == "image" else None
    compression = "gzip" if values.nbytes > 4096 else None
    dataset = file.create_dataset(name, data=values, chunks=chunks, compression=compression)
    dataset.attrs["long_name"] = meaning


def _tables(found: Sequence[Example]) -> dict[str, tuple[NDArray[np.void], str]]:
    return {
        "contacts": (
            np.concatenate([one.contact_rows for one in found]),
            "what pressed on the pad, SI; image is the number of the image",
        ),
        "optics": (
            np.concatenate([one.optics_row for one in found]),
            "light and camera of every image, SI and grey levels",
        ),
        "dead": (
            np.concatenate([one.dead_rows for one in found]),
            "pixels that always show one grey level",
        ),
    }


def _pictures(shard: Shard, found: Sequence[Example]) -> Files:
    files: Files = {}
    listed: list[tuple[object, ...]] = []
    for one in found:
        planes = one.image.reshape(-1, *one.image.shape[-2:])
        for channel, plane in enumerate(planes, start=1):
            suffix = f"-{channel}" if len(planes) > 1 else ""
            name, buffer = f"{one.number:06d}{suffix}.png", io.BytesIO()
            Image.fromarray(plane).save(buffer, format="png")
            files[f"{shard.name}/{name}"] = buffer.getvalue()
            listed.append((one.number, name, NAMES[one.part]))
    single = [
        (one.number, tactel, *(f"{value:.6g}" for value in force))
        for one in found
        for tactel, force in enumerate(one.forces, start=1)
    ]
    header = ("image", "tactel", "normal_N", "tangential_x_N", "tangential_y_N")
    files[f"{shard.name}/{FORCES}"] = _csv(header, single)
    for name, (table, _) in _tables(found).items():
        rows = [[_cell(value) for value in row] for row in table.tolist()]
        files[f"{shard.name}/{name}.csv"] = _csv(table.dtype.names or (), rows)
    files[f"{shard.name}/{IMAGES}"] = _csv(("image", "file", "split"), listed)
    return files


def _cell(value: object) -> object:
    if isinstance(value, bytes):
        return value.decode()
    if isinstance(value, float):
        return "" if np.isnan(value) else f"{value:.7g}"
    return value


def _csv(header: Sequence[str], rows: Sequence[Sequence[object]]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([header, *rows])
    return text.getvalue().encode()
