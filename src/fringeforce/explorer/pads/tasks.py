"""What the worker processes do for the page of a pad; each names the model by its file.

A model is too large to be sent with every question: it is written once, and every process keeps
those that it has read last.
"""

from __future__ import annotations

import os
import pickle
import tempfile
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.errors import InputError
from fringeforce.explorer.pads.contacts import Contact

if TYPE_CHECKING:
    from fringeforce.design.pad import Pad
    from fringeforce.explorer.pads.sketch import Sketch
    from fringeforce.models.pad import PadModel
    from fringeforce.reading.pads.reading import PadReading

Contacts = tuple[Contact, ...]
Answer = tuple[Mapping[str, Any], Mapping[str, NDArray[Any]]]


def solve(pad: Pad, known: bytes | None, folder: str) -> tuple[Mapping[str, Any], str]:
    """What the page is told of a design, and the file of its model.

    Parameters
    ----------
    pad : Pad
        The design.
    known : bytes, optional
        Its pickled model, where there is one already.
    folder : str
        Where to write.
    """
    from fringeforce.explorer.pads.solution import facts, solved

    model = solved(pad, None if known is None else pickle.loads(known))
    handle, path = tempfile.mkstemp(dir=folder, suffix=".pickle")
    with os.fdopen(handle, "wb") as file:
        pickle.dump(model, file, pickle.HIGHEST_PROTOCOL)
    return facts(model), path


def prepare() -> None:
    """Load what pictures need, while there is nothing yet to be drawn."""
    from fringeforce.explorer.pads.pictures import seen_through

    seen_through(np.zeros((1, 2, 1, 1), dtype=np.float32))


def press(path: str, contacts: Contacts, view: str, fine: bool, seed: int) -> Answer:
    """Forces of the tactels and the picture of a view.

    Parameters
    ----------
    path : str
        File of the model.
    contacts : tuple of Contact
        What touches.
    view : str
        A key of `pictures.views`.
    fine : bool
        Whether the picture is one to keep; it is coarse otherwise.
    seed : int
        Of the camera's noise.

    Raises
    ------
    InputError
        If there is no such view.
    """
    from fringeforce.explorer.pads import pictures
    from fringeforce.explorer.pads.contacts import tactel_forces

    model = _model(path)
    if view not in dict(pictures.views(model.sensor)):
        raise InputError(f"This pad has no view {view!r}.")
    forces = tactel_forces(model.sensor.tactels, contacts)
    if view.startswith("camera"):
        if fine:
            frame = model.expose(forces, rng=seed)
        else:
            frame = pictures.exposed(_coarse(path), view, _sketch(path).modes(forces), seed)
        image = pictures.camera_picture(model, view, frame)
    else:
        sight = _eye(path, pictures.FINE) if fine else _sketch(path)
        image = pictures.seen(model, view, sight.slices(forces))
    return {"shape": image.shape}, {"image": image, "forces": forces}


def slices(path: str, contacts: Contacts) -> Answer:
    """Single-pass retardance of every slice, for small pictures, shape (slices, 2, rows, cols)."""
    from fringeforce.explorer.pads.contacts import tactel_forces
    from fringeforce.explorer.pads.pictures import SLICE

    seen = _eye(path, SLICE)
    found = seen.slices(tactel_forces(seen.sensor.tactels, contacts))
    return {"shape": found.shape, "heights": seen.slice_heights.tolist()}, {"slices": found}


def read(path: str, contacts: Contacts, seed: int) -> Answer:
    """Expose one noisy frame, read it, and sum up what was read and what is true."""
    from fringeforce.explorer.pads.contacts import groups, tactel_forces
    from fringeforce.explorer.pads.resultants import resultant

    model = _model(path)
    pad = model.sensor
    forces = tactel_forces(pad.tactels, contacts)
    reading = _follower(path).read(model.expose(forces, rng=seed))
    members = np.vstack(
        [np.ones((1, pad.tactels.total), dtype=bool), groups(pad.tactels, contacts)]
    )
    places, rows = pad.tactels.places, []
    for group in members:
        truth, _ = resultant(places, forces, group)
        rows.append([truth, *resultant(places, reading.forces, group, reading.covariance)])
    chi2 = float(reading.chi2)
    facts = {
        "status": reading.status.name,
        "advice": reading.advice,
        "chi2": chi2 if np.isfinite(chi2) else None,
    }
    sums = np.array(rows)
    return facts, {"forces": reading.forces, "std": reading.std, "sums": sums}


def file(kind: str, path: str, contacts: Contacts, seed: int) -> bytes:
    """Contents of a file of the design, the model, the forces or the reading."""
    from fringeforce.explorer.pads.contacts import tactel_forces
    from fringeforce.explorer.pads.tables import forces_text

    model = _model(path)
    tactels = model.sensor.tactels
    if kind == "design":
        return model.sensor.to_toml().encode()
    if kind == "model":
        with tempfile.TemporaryDirectory() as folder:
            model.save(Path(folder) / "model.h5")
            return (Path(folder) / "model.h5").read_bytes()
    forces = tactel_forces(tactels, contacts)
    if kind == "forces":
        return forces_text(tactels, forces).encode()
    reading = _follower(path).read(model.expose(forces, rng=seed))
    return forces_text(tactels, reading.forces, reading.std).encode()


@lru_cache(maxsize=2)
def _model(path: str) -> PadModel:
    return pickle.loads(Path(path).read_bytes())


@lru_cache(maxsize=6)
def _eye(path: str, longest: int) -> PadModel:
    from fringeforce.explorer.pads.pictures import eye

    return eye(_model(path), longest)


@lru_cache(maxsize=2)
def _coarse(path: str) -> PadModel:
    from fringeforce.explorer.pads.pictures import COARSE, coarse

    return coarse(_model(path), COARSE)


@lru_cache(maxsize=2)
def _sketch(path: str) -> Sketch:
    from fringeforce.explorer.pads.sketch import Sketch

    return Sketch.of(_coarse(path))


class Follower:
    """Reads frames, each from the one before where that is near; a search takes much longer."""

    def __init__(self, model: PadModel) -> None:
        from fringeforce.reading.pads.reader import PadReader

        self._reader = PadReader(model)
        self._last: PadReading | None = None

    def read(self, frame: NDArray[Any]) -> PadReading:
        """Reading of a frame."""
        last = self._last
        found = self._reader.read(frame) if last is None else self._reader.follow(frame, last)
        self._last = found
        return found


@lru_cache(maxsize=2)
def _follower(path: str) -> Follower:
    return Follower(_model(path))
