"""What the worker processes do for the page of a pad."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from fringeforce.base.arrays import Array, Single
from fringeforce.base.errors import InputError
from fringeforce.explorer.pads.protocol import (
    PadDownloadRequest,
    PressedRequest,
    PressRequest,
    SlicesRequest,
)
from fringeforce.explorer.tasks import Answer, download, model_of
from fringeforce.explorer.values import verdict

if TYPE_CHECKING:
    from fringeforce.contacts.press import Press
    from fringeforce.explorer.pads.sketch import Sketch
    from fringeforce.models.pad import PadModel
    from fringeforce.reading.reader import Reader
    from fringeforce.reading.reading import Reading


def prepare() -> None:
    """Load what pictures need, while there is nothing yet to be drawn."""
    from fringeforce.explorer.pads.pictures import seen_through

    seen_through(np.zeros((1, 2, 1, 1), dtype=np.float32))


def press(path: str, wish: PressRequest) -> Answer:
    """Forces of the tactels and the picture of a view.

    Raises
    ------
    InputError
        If there is no such view.
    """
    from fringeforce.explorer.pads import pictures

    model: PadModel = model_of(path)
    if wish.view not in dict(pictures.views(model.sensor)):
        raise InputError(f"This pad has no view {wish.view!r}.")
    skin = model.sensor.skin is not None
    forces = _forces(model, wish)
    if wish.view.startswith("camera"):
        if wish.fine or skin:
            seen = model if wish.fine else _coarse(path)
            frame = seen.expose(_acting(model, wish), rng=wish.seed)
        else:
            modes = _sketch(path).modes(forces)
            frame = pictures.exposed(_coarse(path), wish.view, modes, wish.seed)
        image = pictures.camera_picture(model, wish.view, frame)
    elif skin:
        sight = _eye(path, pictures.FINE if wish.fine else pictures.COARSE)
        image = pictures.seen(model, wish.view, _slices(sight, wish))
    else:
        sight = _eye(path, pictures.FINE) if wish.fine else _sketch(path)
        image = pictures.seen(model, wish.view, sight.slices(forces))
    return {"shape": image.shape}, {"image": image, "forces": forces}


def slices(path: str, wish: SlicesRequest) -> Answer:
    """Single-pass retardance of every slice, for small pictures, shape (slices, 2, rows, cols)."""
    from fringeforce.explorer.pads.pictures import SLICE
    from fringeforce.models.pad_slices import block_of

    seen = _eye(path, SLICE)
    found = _slices(seen, wish)
    heights = block_of(seen.sensor).depths(len(found))[0]
    return {"shape": found.shape, "heights": heights.tolist()}, {"slices": found}


def read(path: str, wish: PressedRequest) -> Answer:
    """Expose one noisy frame, read it, and sum up what was read and what is true."""
    from fringeforce.contacts.resultant import resultant
    from fringeforce.explorer.pads.fingers import SHOWN, groups

    model: PadModel = model_of(path)
    pad, reading = model.sensor, _reading(path, wish)
    facts = verdict(reading.status, reading.advice, reading.chi2)
    found = {"forces": reading.forces, "std": reading.std}
    if pad.skin is not None:
        from fringeforce.explorer.pads.presses import acting, sums

        parts = acting(pad, wish)
        return facts, {**found, "sums": sums(parts, reading.total, reading.contacts)}
    tactels, forces = pad.tactels, _forces(model, wish)
    members = [np.arange(tactels.total), *map(np.flatnonzero, groups(tactels, wish.contacts))]
    rows = []
    for group in members:
        truth = resultant(tactels.places, forces, group)
        read = resultant(tactels.places, reading.forces, group, reading.covariance)
        rows.append([one[SHOWN] for one in (truth.values, read.values, read.std)])
    return facts, {**found, "sums": np.array(rows)}


def file(path: str, wish: PadDownloadRequest) -> Answer:
    """A file of the pad's design, model, forces or reading."""
    model: PadModel = model_of(path)
    return download(wish.kind, model, _forces(model, wish), lambda: _reading(path, wish))


def _forces(model: PadModel, wish: PressedRequest) -> Array:
    """Of tactels, or on the squares of a skin."""
    pad = model.sensor
    if pad.skin is None:
        from fringeforce.explorer.pads.fingers import tactel_forces

        return tactel_forces(pad.tactels, wish.contacts)
    from fringeforce.explorer.pads.presses import acting, forces_on_squares

    return forces_on_squares(pad, acting(pad, wish))


def _acting(model: PadModel, wish: PressedRequest) -> Array | list[Press]:
    """What the light comes from: forces of tactels, or presses on a skin."""
    if model.sensor.skin is None:
        return _forces(model, wish)
    from fringeforce.explorer.pads.presses import pressed

    return pressed(wish)


def _slices(model: PadModel, wish: PressedRequest) -> Single:
    """Single-pass retardance of slices on the pixels of a model."""
    if model.sensor.skin is None:
        return model.slices(_forces(model, wish))
    from fringeforce.explorer.pads.presses import pressed
    from fringeforce.models.pad_presses import press_slices

    presses = pressed(wish)
    return press_slices(model.sensor, presses, *model.sensor.pixel_positions).astype(np.float32)


def _reading(path: str, wish: PressedRequest) -> Reading:
    """The reading of one noisy frame."""
    model: PadModel = model_of(path)
    return _reader(path).read(model.expose(_acting(model, wish), rng=wish.seed))


@lru_cache(maxsize=6)
def _eye(path: str, longest: int) -> PadModel:
    from fringeforce.explorer.pads.pictures import eye

    return eye(model_of(path), longest)


@lru_cache(maxsize=2)
def _coarse(path: str) -> PadModel:
    from fringeforce.explorer.pads.pictures import COARSE, coarse

    return coarse(model_of(path), COARSE)


@lru_cache(maxsize=2)
def _sketch(path: str) -> Sketch:
    from fringeforce.explorer.pads.sketch import Sketch

    return Sketch.of(_coarse(path))


@lru_cache(maxsize=2)
def _reader(path: str) -> Reader:
    """What reads frames, each from the one before where that is near; a search takes longer.

    Nothing has lasted on the page, so that nothing creeps.
    """
    from fringeforce.models.creep import without_creep
    from fringeforce.reading.reader import Reader

    model: PadModel = model_of(path)
    return Reader(replace(model, sensor=without_creep(model.sensor)))
