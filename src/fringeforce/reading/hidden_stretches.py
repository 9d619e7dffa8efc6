"""Stretches of a strip that show something else than its load: dirt, a hair, a cable, a glint.

Loads explain all other pixels.  Often the search finds these loads although some pixels mislead it,
and what they do not explain lies together; otherwise a stretch is left out before it begins.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.design.strip import Sensor
from fringeforce.estimation.frame_exposure import expose
from fringeforce.estimation.posterior import Posterior, Top
from fringeforce.estimation.residual_test import FALSE_VERDICT
from fringeforce.reading.hidden_pixels import MOST, ROUNDS, Pixels, any_level, unlike
from fringeforce.reading.posterior_search import FIRST_EFFORTS
from fringeforce.reading.strip_reader import StripFrameReader

Array = NDArray[np.float64]

TRIED = 3
"""Explanations of a frame that are tried."""
WHOLE, PARTS = (0.0,), (0.125, 0.25, 0.375)
"""Shares of the strip that are left out before a search, each at places half of its length apart:
nothing, which takes one search, or a part, which takes 30, a quarter of a second or more."""
BORDER = 0.25
"""Share of its length by which a stretch is widened on each side: what shines on a strip has no
sharp ends, and loads that imitate them are wrong.  Nor is anything known of loads between two
stretches that are nearer than the clear layer is thick."""


@dataclass(frozen=True, eq=False)
class HiddenStretches:
    """What loads explain all other pixels of a frame.

    Attributes
    ----------
    pixels : ndarray of bool, shape (P,)
        Those of a picture that may show something else, with borders.
    posterior : Posterior
        Of the frame without those that do.
    top : Top
        Its maximum.
    evidence : float
        Logarithm of the posterior mass, if a hidden pixel may show any grey level and a stretch may
        begin and end anywhere.
    """

    pixels: Pixels
    posterior: Posterior
    top: Top
    evidence: float


def hidden_stretches(
    reader: StripFrameReader, frame: Array, shares: tuple[float, ...] = WHOLE + PARTS
) -> HiddenStretches | None:
    """The likeliest stretches without which loads explain a frame, or none.

    Parameters
    ----------
    reader : StripFrameReader
        Of the design or the calibrated sensor.
    frame : ndarray, shape (P,)
        Grey levels; not finite where a pixel is not used.
    shares : tuple of float
        Of the strip that are left out before a search.
    """
    count, found = len(frame) // len(reader.uncertain.frame.bias), list[HiddenStretches]()
    for without in (part for share in shares for part in _parts(count, share)):
        _, tops = reader.explanations(_masked(frame, without), FIRST_EFFORTS, mend=False)
        settled = (_settled(reader, frame, top.unknowns, without) for top in tops[:TRIED])
        found += [one for one in settled if one is not None]
    best = max(found, key=lambda one: one.evidence, default=None)
    return best if best is not None and best.pixels.any() else None


def _parts(count: int, share: float) -> Iterator[Pixels]:
    """Parts of a strip that together cover it twice; one without a pixel of no share."""
    size = round(share * count)
    for begin in range(0, count - size // 2, size // 2) if size else (0,):
        part = np.zeros(count, dtype=bool)
        part[begin : begin + size] = True
        yield part


def _masked(frame: Array, hidden: Pixels) -> Array:
    return np.where(np.tile(hidden, len(frame) // len(hidden)), np.nan, frame)


def _settled(
    reader: StripFrameReader, frame: Array, unknowns: Array, hidden: Pixels
) -> HiddenStretches | None:
    """Loads and what they do not explain, each of the other until neither changes."""
    for _ in range(ROUNDS):
        posterior = reader.own_posterior(_masked(frame, hidden))
        top = posterior.climbed(unknowns, heats=(), steps=(0, 20))
        before, hidden = hidden, _unlike(posterior, frame, top, len(hidden))
        if hidden.mean() > MOST:
            return None
        if (hidden == before).all():
            break
        unknowns = top.unknowns
    if min(top.chance, posterior.waves_chance(top)) < FALSE_VERDICT:
        return None
    evidence = _evidence(reader, posterior, top, before)
    return HiddenStretches(_with_borders(before, reader.model.sensor), posterior, top, evidence)


def _with_borders(hidden: Pixels, sensor: Sensor) -> Pixels:
    """Stretches with their borders, which loads take for their own, and with what lies between."""
    near = sensor.transducer.photoelastic.thickness / sensor.transducer.length * len(hidden)
    where, wide = np.flatnonzero(hidden), np.zeros(len(hidden), dtype=bool)
    for part in np.split(where, np.flatnonzero(np.diff(where) > near) + 1) if len(where) else ():
        border = math.ceil(BORDER * (part[-1] + 1 - part[0]))
        wide[max(part[0] - border, 0) : part[-1] + 1 + border] = True
    return wide


def _unlike(posterior: Posterior, frame: Array, top: Top, count: int) -> Pixels:
    left = (frame - expose(posterior.model, top.unknowns)[0]) / np.sqrt(posterior.model.variance)
    return unlike(left.reshape(-1, count))


def _evidence(reader: StripFrameReader, posterior: Posterior, top: Top, hidden: Pixels) -> float:
    """That a stretch may begin and end anywhere costs as much as two of as many places."""
    count = int(hidden.sum()) * len(posterior.model.bias)
    cost = any_level(count, reader.model.sensor.camera.bits, float(posterior.model.variance.mean()))
    stretches = np.count_nonzero(np.diff(hidden.astype(int), prepend=0) > 0)
    mass = posterior.evidence(top, posterior.linearised(top))
    return float(mass - cost - 2 * stretches * np.log(len(hidden)))
