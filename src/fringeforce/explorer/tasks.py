"""What the worker processes do; every function is pure, so that a lost process costs nothing.

A model may be too large to be sent with every question: it is written once, questions name its
file, and every process keeps those that it has read last.  The libraries behind the tasks are
imported where they are used: the server itself stays light.
"""

from __future__ import annotations

import os
import pickle
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from fringeforce.design.strip import Sensor

if TYPE_CHECKING:
    from fringeforce.reading.reading import Reading
    from fringeforce.reading.single_frame import SingleFrameReader

Loads = list[list[float]]
Answer = tuple[Mapping[str, Any], Mapping[str, NDArray[Any]]]


@dataclass(frozen=True, eq=False)
class Solved:
    """A design that was characterised.

    Attributes
    ----------
    model : str
        Its file, which lasts as long as this.
    facts : mapping
        JSON values for the page.
    blocks : mapping of str to ndarray
        Numbers for the page.
    """

    model: str
    facts: Mapping[str, Any]
    blocks: Mapping[str, NDArray[Any]]


def written(model: Any, folder: str) -> str:
    """Write a model to a new file of a folder, whose path is returned."""
    handle, path = tempfile.mkstemp(dir=folder, suffix=".pickle")
    with os.fdopen(handle, "wb") as file:
        pickle.dump(model, file, pickle.HIGHEST_PROTOCOL)
    return path


def read(path: str) -> Any:
    """The model of a file that `written` made."""
    return pickle.loads(Path(path).read_bytes())


def solve(sensor: Sensor, known: bytes | None, folder: str) -> Solved:
    """Characterise a design.

    Parameters
    ----------
    sensor : Sensor
        The design.
    known : bytes, optional
        Its pickled model, where there is one already.
    folder : str
        Where to write.
    """
    from fringeforce.explorer.solution import solve

    solution = solve(sensor, None if known is None else pickle.loads(known))
    return Solved(written(solution.model, folder), solution.facts, solution.blocks)


def inside(model: str) -> Answer:
    """Figures of a design that was characterised here, and what is inside it.

    Parameters
    ----------
    model : str
        File of a SensorModel.
    """
    from fringeforce.explorer.solution import inside

    return inside(_reader(model))


def shoot(model: str, forces: Loads, seed: int) -> Answer:
    """Expose one noisy line and read it.

    Parameters
    ----------
    model : str
        File of a SensorModel.
    forces : nested list, shape (n, 2)
        Normal and tangential forces [N].
    seed : int
        Of the camera's noise.
    """
    from fringeforce.explorer.shot import shoot

    shot = shoot(_reader(model), forces, seed)
    return shot.facts, shot.blocks


def file(kind: str, model: str, forces: Loads, seed: int) -> bytes:
    """Contents of a file that the library would write; see `contents`."""
    from fringeforce.explorer.shot import shoot

    reader = _reader(model)
    return contents(kind, reader.model, forces, lambda: shoot(reader, forces, seed).reading)


def contents(kind: str, model: Any, forces: Any, reading: Callable[[], Reading]) -> bytes:
    """Contents of a file that the library would write.

    Parameters
    ----------
    kind : {"design", "model", "forces", "reading"}
        Which.
    model : SensorModel or PadModel
        Of the sensor.
    forces : array_like, shape (n, components)
        That act [N].
    reading : callable
        Returns the reading of a frame under these forces.
    """
    from fringeforce.io.tables import save_forces, save_readings

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file"
        if kind == "design":
            path.write_text(model.sensor.to_toml(), encoding="utf-8")
        elif kind == "model":
            model.save(path)
        elif kind == "forces":
            save_forces(path, [forces])
        else:
            save_readings(path, [reading()], model.sensor.components)
        return path.read_bytes()


@lru_cache(maxsize=4)
def _reader(model: str) -> SingleFrameReader:
    from fringeforce.reading.single_frame import SingleFrameReader

    return SingleFrameReader(read(model))
