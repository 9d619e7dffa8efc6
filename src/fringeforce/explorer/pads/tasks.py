"""What the worker processes do for the page of a pad."""

from __future__ import annotations

import pickle
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from fringeforce.base.errors import InputError
from fringeforce.explorer.pads.contacts import Contact
from fringeforce.explorer.tasks import Answer, Solved, contents, written
from fringeforce.explorer.tasks import read as load

if TYPE_CHECKING:
    from fringeforce.design.pad import Pad
    from fringeforce.explorer.pads.sketch import Sketch
    from fringeforce.models.pad import PadModel
    from fringeforce.reading.reader import Reader

Contacts = tuple[Contact, ...]


def solve(pad: Pad, known: bytes | None, folder: str) -> Solved:
    """Characterise a design.

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
    return Solved(written(model, folder), facts(model), {})


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
    reading = _reader(path).read(model.expose(forces, rng=seed))
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
    """Contents of a file that the library would write; see `tasks.contents`."""
    from fringeforce.explorer.pads.contacts import tactel_forces

    model = _model(path)
    forces = tactel_forces(model.sensor.tactels, contacts)
    return contents(kind, model, forces, lambda: _reader(path).read(model.expose(forces, rng=seed)))


@lru_cache(maxsize=2)
def _model(path: str) -> PadModel:
    return load(path)


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


@lru_cache(maxsize=2)
def _reader(path: str) -> Reader:
    """What reads frames, each from the one before where that is near; a search takes longer."""
    from fringeforce.reading.reader import Reader

    return Reader(_model(path))
