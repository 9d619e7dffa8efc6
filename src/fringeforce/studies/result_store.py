"""What every design of a study gave, on disk as soon as it is known.

Every design has its place in the file from the start, so that a result is a few numbers written in
place and no structure of the file changes after its creation: a process that is killed loses the
designs that it was working on and nothing else.  Each column has a checksum of its own; another
one stands behind the file, of all but the columns while it is written to, of the whole afterwards.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from fringeforce.base.errors import InputError
from fringeforce.base.storage import (
    dataset,
    describe,
    existing_file,
    new_file,
    read,
    seal,
    writing,
)
from fringeforce.studies.performance import NAMES, UNITS, Performance
from fringeforce.studies.sampling import Axis, Value
from fringeforce.studies.study_file import same_study

KIND = "study"
OPEN, DONE, FAILED = 0, 1, 2
"""States of a design."""
ERROR_BYTES, TEXT_BYTES = 400, 64
MEANINGS = {
    "design": "number of the design; 0 is the one that the study starts from",
    "state": "0 to be done, 1 done, 2 failed",
}
SYMBOLS = {"meter": "m", "pascal": "Pa", None: ""}

Outcome = Performance | str
"""What a design does, or why that cannot be known."""


class ResultStore:
    """An open file of results; see `open_store`."""

    def __init__(self, file: h5py.File, axes: Sequence[Axis]) -> None:
        self._file = file
        self._axes = axes

    @property
    def states(self) -> NDArray[np.uint8]:
        """State of every design, shape (designs,)."""
        return dataset(self._file, "state")[()]

    def record(self, number: int, changes: Mapping[str, Value], outcome: Outcome) -> None:
        """Write one design's values and what came of it; its state comes last."""
        found: dict[str, Any] = {}
        if isinstance(outcome, str):
            state = FAILED
            found["error"] = _clipped(outcome, ERROR_BYTES)
        else:
            state = DONE
            found.update(asdict(outcome))
        for axis in self._axes:
            value = changes[axis.path]
            found[axis.path] = _clipped(str(value), TEXT_BYTES) if axis.text else value
        for name, value in found.items():
            dataset(self._file, name)[number] = value
        self._file.flush()
        dataset(self._file, "state")[number] = state
        self._file.flush()

    def outcome(self, number: int) -> Outcome | None:
        """What is known of a design; none if nothing."""
        state = int(dataset(self._file, "state")[number])
        if state == OPEN:
            return None
        if state == FAILED:
            return dataset(self._file, "error")[number].decode("utf-8", "ignore")
        return Performance(**{name: float(dataset(self._file, name)[number]) for name in NAMES})


@contextmanager
def open_store(
    path: str | os.PathLike[str], study: str, axes: Sequence[Axis], designs: int
) -> Iterator[ResultStore]:
    """Results of a study to resume, or a new file for them.

    Parameters
    ----------
    path : path
        Path of the HDF5 file.
    study : str
        Canonical text of the study; a file of another one is not touched.
    axes : sequence of Axis
        Varied values.
    designs : int
        Places.

    Raises
    ------
    InputError, FileFormatError
        If the file is of another study or no study at all, or is being written elsewhere.
    """
    place = Path(path)
    if not place.exists():
        _create(place, study, axes, designs)
    with existing_file(place, KIND) as file:
        same = same_study(str(file.attrs["study"]), study)
        columns = {name: read(file, name) for name in file}  # none of them is damaged
        if not same or len(columns["design"]) != designs:
            raise InputError(
                f"{place} holds the results of another study, or of this one before a change; "
                "write to another file, or remove that one."
            )
    with writing(place):
        file = h5py.File(place, "r+")
    try:
        with file:
            with writing(place):
                seal(place, file)
            yield ResultStore(file, axes)
    finally:
        with writing(place):
            seal(place)


def read_results(path: str | os.PathLike[str]) -> dict[str, NDArray[Any]]:
    """All columns of a file of results, by name; texts as str.

    Raises
    ------
    FileFormatError
        If it is no such file.
    """
    with existing_file(path, KIND) as file:
        columns = {name: read(file, name) for name in file}
    return {
        name: np.char.decode(values, "utf-8") if values.dtype.kind == "S" else values
        for name, values in columns.items()
    }


def _create(path: Path, study: str, axes: Sequence[Axis], designs: int) -> None:
    with new_file(path, KIND, sealed=False, keep=True) as file:
        file.attrs["study"] = study
        numbers = {axis.path: SYMBOLS[axis.unit] for axis in axes if not axis.text} | UNITS
        columns: dict[str, NDArray[Any]] = {
            "design": np.arange(designs),
            "state": np.zeros(designs, dtype=np.uint8),
            "error": np.zeros(designs, dtype=f"S{ERROR_BYTES}"),
        }
        columns |= {axis.path: np.zeros(designs, f"S{TEXT_BYTES}") for axis in axes if axis.text}
        columns |= {name: np.full(designs, np.nan) for name in numbers}
        for name, values in columns.items():
            # in one piece, with a checksum of it: whoever records a design writes kilobytes
            column = file.create_dataset(name, data=values, chunks=values.shape, fletcher32=True)
            describe(column, ("design",), numbers.get(name), MEANINGS.get(name, name))


def _clipped(text: str, size: int) -> bytes:
    return text.encode("utf-8")[:size]
