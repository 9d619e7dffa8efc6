"""What the worker processes do for the page of a skin."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from fringeforce.explorer.skins.protocol import SkinDownloadRequest, SkinRequest
from fringeforce.explorer.tasks import Answer, download, model_of
from fringeforce.explorer.values import verdict

if TYPE_CHECKING:
    from fringeforce.contacts.press import Press, Tractions
    from fringeforce.models.strip import SensorModel
    from fringeforce.reading.reader import Reader
    from fringeforce.reading.reading import Reading

PLACES = 601
"""Places at which tractions are shown, all along the strip."""


def read(path: str, wish: SkinRequest) -> Answer:
    """Expose one noisy line under fingers, read it, and tell what is true.

    The light comes from the fingers' own tractions, by contact mechanics on the layers.
    """
    from fringeforce.io.tables import contact_cells
    from fringeforce.models.presses import tractions

    model: SensorModel = model_of(path)
    presses = pressed(wish)
    true = [tractions(model.sensor, press) for press in presses]
    frame = model.expose(presses, rng=wish.seed)
    reading = _reader(path).search(frame)
    strip = model.sensor.transducer
    places = np.linspace(-0.5, 0.5, PLACES) * strip.length
    area = strip.width * (places[1] - places[0])
    blocks = {
        "frame": frame,
        "phase": model.phase(presses),
        "places": places,
        "truth": sum((one.between(places) for one in true), np.zeros((PLACES, 2))) / area,
        "traction": np.full((PLACES, 2), np.nan),
        "std": np.full((PLACES, 2), np.nan),
    }
    if (felt := reading.traction) is not None:
        for name, values in (("traction", felt.values), ("std", felt.std)):
            for part in range(2):
                column = np.interp(places, felt.places, values[:, part], left=0.0, right=0.0)
                blocks[name][:, part] = column
    rows = [contact_cells(one) for one in (reading.total, *reading.contacts) if one is not None]
    facts = verdict(reading.status, reading.advice, reading.chi2)
    facts["contacts"] = [[v if np.isfinite(v) else None for v in row] for row in rows]
    facts["true"] = [_centre(one) for one in true]
    return facts, blocks


def file(path: str, wish: SkinDownloadRequest) -> Answer:
    """A file of the skin's design, model or reading."""
    model: SensorModel = model_of(path)

    def reading() -> Reading:
        return _reader(path).search(model.expose(pressed(wish), rng=wish.seed))

    return download(wish.kind, model, [], reading)


def pressed(wish: SkinRequest) -> list[Press]:
    """Presses of the fingers that push at all."""
    from fringeforce.contacts.press import Press

    return [
        Press(x=one.x, radius=one.radius, normal=one.normal, tangential=one.tangential)
        for one in wish.contacts
        if one.normal > 0
    ]


def _centre(tractions: Tractions) -> list[float]:
    """Centre of pressure [mm], normal and tangential force [N]."""
    normal, tangential = tractions.forces.sum(axis=0)
    return [tractions.centre * 1e3, float(normal), float(tangential)]


@lru_cache(maxsize=4)
def _reader(path: str) -> Reader:
    from fringeforce.reading.reader import Reader

    return Reader(model_of(path))
