"""Shards: images that are computed in one go, as the bytes of the files that hold them."""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fringeforce.base.storage import new_file, write
from fringeforce.datasets.example import Example, example
from fringeforce.datasets.skin_example import SkinExample, skin_example
from fringeforce.datasets.study_file import NAMES, DatasetStudy
from fringeforce.design.files import parse_sensor
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.io.frames import DATASET, pixel_axes
from fringeforce.io.tables import force_columns
from fringeforce.models.characterization import characterize
from fringeforce.models.pad import PadModel
from fringeforce.models.strip import SensorModel

IMAGES, FORCES = "images.csv", "forces.csv"
STUDY, SUMS = "study.json", "SHA256SUMS"
"""What a folder of pictures was made from, and digests of its files, for `sha256sum -c`."""
Files = dict[str, bytes]
_KINDS: dict[str, Callable[..., Example | SkinExample]] = {"pad": example, "strip": skin_example}
"""What draws one image, by the kind of sensor."""


@dataclass(frozen=True)
class Shard:
    """Some images of a data set: the call that travels to the workers."""

    study: DatasetStudy
    sensor: Pad | Sensor
    first: int
    count: int

    @property
    def name(self) -> str:
        """Name of the shard's file or folder."""
        name = f"shard-{self.first // self.study.shard:05d}"
        return f"{name}.h5" if self.study.format == "hdf5" else name

    @property
    def canonical(self) -> str:
        """What the data set was made from."""
        return self.study.canonical(self.sensor)

    @property
    def numbers(self) -> range:
        """Numbers of the shard's images."""
        return range(self.first, self.first + self.count)


def examples(shard: Shard) -> list[Example | SkinExample]:
    """Images of a shard."""
    model, drawn = _model(shard.sensor.to_toml()), _KINDS[shard.sensor.kind]
    return [drawn(model, shard.study, number) for number in shard.numbers]


def packed(shard: Shard) -> Files:
    """Files of a shard: one of HDF5, or pictures and tables."""
    found = examples(shard)
    return _hdf5(shard, found) if shard.study.format == "hdf5" else _pictures(shard, found)


@lru_cache(maxsize=1)
def _model(design: str) -> PadModel | SensorModel:
    """A worker characterises a sensor once, for all of its shards."""
    return characterize(parse_sensor(design))


def _hdf5(shard: Shard, found: Sequence[Example | SkinExample]) -> Files:
    sensor = shard.sensor
    with TemporaryDirectory() as folder:
        path = Path(folder) / shard.name
        with new_file(path, DATASET) as file:
            file.attrs["design"] = sensor.to_toml()
            file.attrs["seed"] = shard.study.seed
            file.attrs["study"] = shard.canonical
            pixels = pixel_axes(sensor.pixel_positions)
            for name, (values, meaning) in pixels.items():
                write(file, name, np.asarray(values), (name,), "m", meaning)
            tactels = np.arange(1, sensor.tactels.total + 1)
            write(file, "tactel", tactels, ("tactel",), None, "number of the tactel")
            components = np.array(sensor.components, dtype="S")
            write(file, "component", components, ("component",), None, "direction of the force")
            write(file, "number", np.array(shard.numbers), ("number",), None, "of the image")
            for axis, values in zip("xy", sensor.tactels.places.T, strict=False):
                write(file, f"tactel_{axis}", values, ("tactel",), "m", "their places")
            parts = np.array([one.part for one in found], dtype=np.uint8)
            write(file, "split", parts, ("number",), None, "0 train, 1 validation, 2 test")
            forces = np.stack([one.forces for one in found]).astype(np.float32)
            axes = ("number", "tactel", "component")
            write(file, "forces", forces, axes, "N", "forces on the tactels")
            _write_images(file, np.stack([one.image for one in found]), tuple(pixels))
            for name, (table, meaning) in _tables(found).items():
                file.create_dataset(name, data=table).attrs["long_name"] = meaning
        return {shard.name: path.read_bytes()}


def _write_images(
    file: h5py.File, images: NDArray[np.unsignedinteger], axes: tuple[str, ...]
) -> None:
    """Images by themselves, as learners read them in any order."""
    single = (1, *images.shape[1:])
    dataset = file.create_dataset("image", data=images, chunks=single, compression="gzip")
    dataset.attrs["long_name"] = "grey levels"
    dataset.dims[0].attach_scale(file["number"])
    for behind, name in enumerate(reversed(axes), start=1):
        dataset.dims[images.ndim - behind].attach_scale(file[name])


def _tables(found: Sequence[Example | SkinExample]) -> dict[str, tuple[NDArray[np.void], str]]:
    tables = [one.tables for one in found]
    return {
        name: (np.concatenate([table[name][0] for table in tables]), meaning)
        for name, (_, meaning) in tables[0].items()
    }


def _pictures(shard: Shard, found: Sequence[Example | SkinExample]) -> Files:
    files: Files = {}
    listed: list[tuple[object, ...]] = []
    for one in found:
        # a line is a picture of one row
        image = one.image if shard.sensor.dimensions > 1 else one.image[..., None, :]
        planes = image.reshape(-1, *image.shape[-2:])
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
    header = "image", "tactel", *force_columns(shard.sensor.components)
    files[f"{shard.name}/{FORCES}"] = _csv(header, single)
    for name, (table, _) in _tables(found).items():
        rows = [[_cell(value) for value in row] for row in table.tolist()]
        files[f"{shard.name}/{name}.csv"] = _csv(table.dtype.names or (), rows)
    files[f"{shard.name}/{IMAGES}"] = _csv(("image", "file", "split"), listed)
    files[f"{shard.name}/{STUDY}"] = shard.canonical.encode()
    sums = [f"{digest(content)}  {Path(path).name}\n" for path, content in files.items()]
    files[f"{shard.name}/{SUMS}"] = "".join(sums).encode()
    return files


def digest(content: bytes) -> str:
    """SHA-256 of a file of a folder of pictures."""
    return hashlib.sha256(content).hexdigest()


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
