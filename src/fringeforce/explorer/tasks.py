"""What the worker processes do; every function is pure, so that a lost process costs nothing.

A model is too large to be sent with every question: it is written to a file once, and every process
keeps those that it has read last.  The libraries behind the functions are imported where they are
used: the server itself stays light.
"""

from __future__ import annotations

import os
import pickle
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.explorer.protocol import DownloadRequest, InsideRequest, LoadedRequest
from fringeforce.explorer.values import verdict

if TYPE_CHECKING:
    from fringeforce.reading.reader import Reader
    from fringeforce.reading.reading import Reading

Answer = tuple[Mapping[str, Any], Mapping[str, NDArray[Any]]]
"""JSON values and numbers for the page."""
ENDINGS = {"design": "toml", "model": "h5", "forces": "csv", "reading": "csv"}


@dataclass(frozen=True, eq=False)
class Solved:
    """A design that was characterised.

    Attributes
    ----------
    model : str
        File of the pickled model, which lasts as long as this.
    facts : mapping
        JSON values for the page.
    blocks : mapping of str to ndarray
        Numbers for the page.
    """

    model: str
    facts: Mapping[str, Any]
    blocks: Mapping[str, NDArray[Any]]


def stored(model: Any, folder: str) -> str:
    """Write a model to a new file of a folder, and return its path."""
    handle, path = tempfile.mkstemp(dir=folder, suffix=".pickle")
    with os.fdopen(handle, "wb") as file:
        pickle.dump(model, file, pickle.HIGHEST_PROTOCOL)
    return path


@lru_cache(maxsize=2)
def model_of(path: str) -> Any:
    """The model that a file holds."""
    return pickle.loads(Path(path).read_bytes())


def download(kind: str, model: Any, forces: ArrayLike, reading: Callable[[], Reading]) -> Answer:
    """A file of the design, the model, the forces or the reading, as the library writes it.

    Parameters
    ----------
    kind : {"design", "model", "forces", "reading"}
        Which.
    model : SensorModel or PadModel
        Model of the sensor.
    forces : array_like, shape (n, components)
        Forces that act [N].
    reading : callable
        Returns the reading of a frame under these forces.
    """
    from fringeforce.io.tables import save_contacts, save_forces, save_readings

    skin = getattr(model.sensor, "skin", None) is not None
    write = {
        "design": lambda path: path.write_text(model.sensor.to_toml(), encoding="utf-8"),
        "model": model.save,
        "forces": lambda path: save_forces(path, [np.asarray(forces)]),
        "reading": lambda path: (
            save_contacts(path, [reading()])
            if skin
            else save_readings(path, [reading()], model.sensor.components)
        ),
    }
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{kind}.{ENDINGS[kind]}"
        write[kind](path)
        return {"name": path.name}, {"content": np.frombuffer(path.read_bytes(), np.uint8)}


def solve(solution: str, sensor: Sensor | Pad, known: bytes | None, folder: str) -> Solved:
    """Characterise a design.

    Parameters
    ----------
    solution : str
        Module of what the page needs to know of it.
    sensor : Sensor or Pad
        The design.
    known : bytes, optional
        Pickled model of the design, where there is one already.
    folder : str
        Where the model's file goes.
    """
    module: Any = import_module(solution)
    model = module.solved(sensor, None if known is None else pickle.loads(known))
    return Solved(stored(model, folder), module.facts(model), module.blocks(model))


@lru_cache(maxsize=6)
def _inside(path: str) -> Answer:
    from fringeforce.explorer.solution import inside

    model: Any = _reader(path).model  # of a strip
    return inside(model)


def inside(path: str, wish: InsideRequest) -> Answer:
    """Figures of a strip that was characterised here, and what is inside it."""
    return _inside(path)


def read(path: str, wish: LoadedRequest) -> Answer:
    """Expose one noisy line of a strip and read it."""
    reader = _reader(path)
    frame, reading = _exposed(reader, wish)
    model: Any = reader.model  # of a strip
    psi = model.frame_influence
    variance = ((psi @ reading.covariance) * psi).sum(axis=1)
    return verdict(reading.status, reading.advice, reading.chi2), {
        "frame": frame,
        "forces": reading.forces,
        "std": reading.std,
        "phase": reading.phase,
        "phase_std": np.sqrt(np.maximum(variance, 0)),
        "alternatives": reading.alternatives,
    }


def file(path: str, wish: DownloadRequest) -> Answer:
    """A file of the strip's design, model, forces or reading."""
    reader = _reader(path)
    return download(wish.kind, reader.model, wish.forces, lambda: _exposed(reader, wish)[1])


def _exposed(reader: Reader, wish: LoadedRequest) -> tuple[NDArray[np.unsignedinteger], Reading]:
    frame = reader.model.expose(wish.forces, rng=wish.seed)
    return frame, reader.search(frame)


@lru_cache(maxsize=4)
def _reader(path: str) -> Reader:
    from fringeforce.reading.reader import Reader

    return Reader(model_of(path))
