"""Sensors of the benchmark, and what happens to them; no frame comes from a reader's own matrix."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.contacts.press import Press
from fringeforce.contacts.random_presses import random_presses
from fringeforce.design.files import load_sensor
from fringeforce.design.strip import Sensor
from fringeforce.models.characterization import characterize
from fringeforce.models.presses import tractions
from fringeforce.models.strip import SensorModel

FORCES = ("normal_N", "tangential_N")
TOUCH = ("x_mm", *FORCES)
RATE = 50.0
"""Frames per second of what is read in a row [1/s]."""
NARROWEST = 0.05e-3
"""Contacts of a width drawn below this one have it [m]."""
EXACT = {"transducer.edges": "roller"}
"""Edges whose light an exact series gives."""


@dataclass(frozen=True, eq=False)
class Scene:
    """Frames and what made them.

    Attributes
    ----------
    frames : ndarray, shape (F, P)
        Grey levels.
    truth : ndarray, shape (F, n, c)
        Values of every tactel, or of all contacts together, in the columns of the track.
    """

    frames: np.ndarray
    truth: Array


Take = Callable[[SensorModel, np.random.Generator, int], Scene]


@dataclass(frozen=True)
class Track:
    """A sensor, and frames of it.

    Attributes
    ----------
    about : str
        What happens, in a sentence.
    design : callable
        Gives the drawing that readers may know.
    take : callable
        Takes frames.
    columns : tuple of str
        What is read of every tactel, or of all contacts together.
    rate : float, optional
        Frames per second where they follow each other.
    """

    about: str
    design: Callable[[], Sensor]
    take: Take
    columns: tuple[str, ...] = FORCES
    rate: float | None = None

    @property
    def number(self) -> str:
        """What numbers the rows of a frame."""
        return "tactel" if self.columns == FORCES else "contact"


def _saad(**changes: Any) -> Sensor:
    return load_sensor("saad").replace(**changes)


def _loads(rng: np.random.Generator, tactels: int, largest: float) -> Array:
    """Forces of one frame: from one tactel to all, sheared by up to half the normal force."""
    pressed = rng.permutation(tactels) < rng.integers(1, tactels + 1)
    normal = rng.uniform(0.05, 1.0, tactels) * largest * pressed
    return np.stack([normal, normal * rng.uniform(-0.5, 0.5, tactels)], axis=1)


def _presses(places: Array, widths: Array, forces: Array) -> list[Press]:
    rows = zip(places.tolist(), widths.tolist(), forces.tolist(), strict=True)
    return [
        Press(x=x, normal=normal, tangential=shear, width=width, profile="flat")
        for x, width, (normal, shear) in rows
        if normal > 0
    ]


def _on_tactels(model: SensorModel, truth: Array) -> list[list[Press]]:
    """Presses of forces as drawn, whose light the exact series gives."""
    tactels = model.sensor.tactels
    width = np.full(tactels.count, tactels.contact_width)
    return [_presses(tactels.positions, width, forces) for forces in truth]


def _drawn(model: SensorModel, rng: np.random.Generator, count: int) -> Scene:
    truth = np.array([_loads(rng, model.sensor.tactels.count, 2.0) for _ in range(count)])
    return Scene(np.array([model.expose(one, rng) for one in _on_tactels(model, truth)]), truth)


def _built(model: SensorModel, rng: np.random.Generator, count: int) -> Scene:
    tactels, std = model.sensor.tactels, model.sensor.tolerances
    frames, truth = [], []
    for _ in range(count):
        forces = _loads(rng, tactels.count, 2.0)
        places = tactels.positions + rng.normal(0, std["tactels.placement"], tactels.count)
        width = rng.normal(tactels.contact_width, std["tactels.contact_width"], tactels.count)
        pressed = _presses(places, np.maximum(width, NARROWEST), forces)
        frames.append(model.expose(pressed, rng, as_built=rng))
        truth.append(forces)
    return Scene(np.array(frames), np.array(truth))


def _soft(model: SensorModel, rng: np.random.Generator, count: int) -> Scene:
    truth = np.array([_loads(rng, model.sensor.tactels.count, 1.0) for _ in range(count)])
    return Scene(np.array([model.expose(forces, rng) for forces in truth]), truth)


def _touched(model: SensorModel, rng: np.random.Generator, count: int) -> Scene:
    skin = model.sensor.skin
    assert skin is not None
    frames, truth = [], []
    for _ in range(count):
        presses = random_presses(skin.extent, rng)
        # shear moves the pressure of a cylinder beside its axis
        centres = [tractions(model.sensor, one).centre for one in presses]
        rows = np.array(
            [[x * 1e3, p.normal, p.shear[0]] for x, p in zip(centres, presses, strict=True)]
        )
        centre = rows[:, 0] @ rows[:, 1] / rows[:, 1].sum()
        frames.append(model.expose(presses, rng))
        truth.append([[centre, rows[:, 1].sum(), rows[:, 2].sum()]])
    return Scene(np.array(frames), np.array(truth))


def _held(model: SensorModel, rng: np.random.Generator, count: int) -> Scene:
    tactels, times = model.sensor.tactels.count, np.arange(count) / RATE
    knots = np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 3.0, count))])
    knots = knots[: np.searchsorted(knots, times[-1]) + 1]
    loads = np.array([_loads(rng, tactels, 1.5) for _ in knots])
    loads[rng.random(len(knots)) < 0.3] = 0.0  # released
    loads[1::2] = loads[: len(loads[1::2]) * 2 : 2]  # held in between
    loads[0] = 0.0
    rows = loads.reshape(len(knots), -1)
    truth = np.stack([np.interp(times, knots, row) for row in rows.T], axis=1)
    truth = truth.reshape(count, tactels, 2)
    pressed = _on_tactels(model, truth)
    return Scene(model.expose(pressed, rng, as_built=rng, times=times), truth)


TRACKS = {
    "drawn": Track(
        "a strip as drawn, contacts 0.5 mm wide; light of the exact series",
        lambda: _saad(**EXACT, **{"tactels.contact_width": "0.5 mm"}),
        _drawn,
    ),
    "built": Track(
        "a strip of its own for every frame, within tolerances: contacts beside their tactels, of "
        "uncertain width, lamp, visibility, residual, blur; light of the exact series",
        lambda: _saad(
            **EXACT,
            **{
                "tactels.placement": "0 +/- 0.1 mm",
                "tactels.contact_width": "0.4 +/- 0.2 mm",
                "camera.amplitude": "180 +/- 3 %",
                "polariscope.visibility": "0.97 +/- 0.02",
                "polariscope.residual": "0 +/- 0.05 rad",
                "camera.blur": "0.05 +/- 0.02 mm",
            },
        ),
        _built,
    ),
    "soft": Track(
        "a strip under large strain, contacts 0.5 mm wide; light of Newton's steps",
        lambda: _saad(**{"transducer.strain": "finite", "tactels.contact_width": "0.5 mm"}),
        _soft,
    ),
    "touch": Track(
        "one to three rigid cylinders with friction, anywhere on a skin; pressure of contact "
        "mechanics, light of the exact series",
        lambda: load_sensor("skin").replace(**EXACT),
        _touched,
        TOUCH,
    ),
    "held": Track(
        "presses 0.5 mm wide that are held and released on layers that creep; light of the exact "
        "series",
        lambda: _saad(
            **EXACT,
            **{
                "tactels.contact_width": "0.5 mm",
                "transducer.relaxation": [
                    {"share": "0.06 +/- 20 %", "time": "0.4 s"},
                    {"share": "0.04 +/- 20 %", "time": "15 s"},
                ],
            },
        ),
        _held,
        rate=RATE,
    ),
}
"""All tracks by name."""


def model_of(track: Track) -> SensorModel:
    """The drawing of a track, characterised."""
    return characterize(track.design())
