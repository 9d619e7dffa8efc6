"""Whether a calibrated model can be used, and if not, what is the likeliest cause."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.stats import binom

from fringeforce.base.arrays import Array
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.fit import HOPELESS, BenchFit

LEFT_OUT = 0.2
"""Share of frames that may contradict the others, or that the model need not explain: one press in
five is not an accident."""
CHANCE = 1e-4
"""Chance of a coverage as low as that of the frames that were put aside below which intervals do
not hold."""
EXPLAINS = 0.5
"""Share of what the misfit has beyond noise that a cause must leave at most to be named."""
OTHER = (
    "Other forces at these places explain the frames: the loads may be those of another day, in "
    "another unit, or of a load cell that was not zeroed."
)
FEW = 12, 6
"""Frames on which causes are tried: of strips, and of pads, which have many times the pixels."""


class Judgement(NamedTuple):
    """Whether a model can be used, and what is said of it."""

    usable: bool
    words: tuple[str, ...]


def judgement(fit: BenchFit, levels: Array, loads: BenchLoads) -> Judgement:
    """Judge a fit by its frames, and by those that were put aside.

    Parameters
    ----------
    fit : BenchFit
        The fit.
    levels : ndarray, shape (F, P)
        Frames with loads.
    loads : BenchLoads
        What was written down for them.
    """
    wrong, checked = _wrong(fit, len(levels)), fit.checked
    words = []
    if checked.forces:
        words.append(
            f"{checked.frames} frames were put aside and checked: {checked.explained} are "
            f"explained, and {checked.inside / checked.forces:.0%} of their forces lie within 95 % "
            "intervals."
        )
    if wrong:
        cause = _cause(fit, levels, loads)
    elif wrong := _wrong_forces(fit):
        cause = OTHER
    else:
        return Judgement(True, tuple(words))
    return Judgement(False, (f"Do not use this model: {wrong} {cause}", *words))


def _wrong(fit: BenchFit, frames: int) -> str:
    """What a fit does not explain, if too much."""
    left, checked = int((~fit.kept[:frames]).sum()), fit.checked
    unexplained = int((fit.kept & ~fit.explained)[:frames].sum())
    if unexplained > LEFT_OUT * frames:
        return (
            f"{unexplained} of its {frames} frames are not explained (reduced chi-square "
            f"{fit.chi2:.3g} instead of 1)."
        )
    if left > LEFT_OUT * frames:
        return f"{left} of {frames} frames contradict the others."
    if checked.frames - checked.explained > LEFT_OUT * checked.frames:
        return (
            f"{checked.frames - checked.explained} of {checked.frames} frames that were put aside "
            "are not explained."
        )
    return ""


def _wrong_forces(fit: BenchFit) -> str:
    """What is wrong with the forces of a fit that explains its frames, if anything."""
    checked = fit.checked
    if checked.forces and binom.cdf(checked.inside, checked.forces, 0.95) < CHANCE:
        return (
            f"only {checked.inside / checked.forces:.0%} of the forces of frames that were put "
            "aside lie within their 95 % intervals."
        )
    if {"normal", "tangential"}.intersection(fit.beyond):
        return "no load cell scatters as its forces do about those written down."
    return ""


def _cause(fit: BenchFit, levels: Array, loads: BenchLoads) -> str:
    """The likeliest cause, by what explains some of the frames better."""
    loaded = np.flatnonzero(loads.present.any(axis=1))
    on_pad = loads.forces.shape[2] == 3
    few = FEW[on_pad]
    some = loaded[:: max(len(loaded) // few, 1)][:few]
    chosen, own = levels[some], loads.rows(some)
    usual = fit.rough(chosen, own)
    limit = 1 + EXPLAINS * (usual - 1)
    tried = {
        "The frames seem to belong to the loads of the next row: rows are off by one.": (
            loads.rows((some + 1) % len(loads))
        ),
        "The frames seem to belong to the loads of the row before: rows are off by one.": (
            loads.rows(some - 1)
        ),
        **(_turned_on_pad(own) if on_pad else _turned_on_strip(own)),
    }
    misfits = dict[str, float]()
    for words, other in tried.items():
        if other.present.any():
            misfits[words] = fit.rough(chosen, other)
            if misfits[words] < HOPELESS < limit:
                break
    words = min(misfits, key=lambda each: misfits[each])
    if misfits[words] < limit:
        return words
    free = replace(own, force_std=np.full(own.forces.shape, np.nanmax(loads.magnitude)))
    if fit.rough(chosen, free) < limit:
        return OTHER
    return (
        "No forces at these places explain the frames: the sensor is not the one of the design, or "
        "the loads are those of other frames. Compare a frame with `fringeforce show`."
    )


def _turned_on_strip(loads: BenchLoads) -> dict[str, BenchLoads]:
    return {
        "The places seem to be written down with the other sign: mirror x.": (
            _turned(loads, places=-1)
        ),
        "Places and tangential forces seem to be written down with the other sign: the strip, or "
        "the camera, is turned round.": _turned(loads, places=-1, shear=-1),
        "The tangential forces seem to be written down with the other sign.": (
            _turned(loads, shear=-1)
        ),
    }


def _turned_on_pad(loads: BenchLoads) -> dict[str, BenchLoads]:
    along, across = np.array([-1.0, 1.0]), np.array([1.0, -1.0])
    return {
        "The places seem to be written down with the other sign of x: mirror x.": (
            _turned(loads, places=along)
        ),
        "The places seem to be written down with the other sign of y: mirror y.": (
            _turned(loads, places=across)
        ),
        "x seems to be written down with the other sign, in places and forces.": (
            _turned(loads, places=along, shear=along)
        ),
        "y seems to be written down with the other sign, in places and forces.": (
            _turned(loads, places=across, shear=across)
        ),
        "Places and tangential forces seem to be written down with the other sign: the pad, or the "
        "camera, is turned by 180 degrees.": _turned(loads, places=-1, shear=-1),
        "The tangential forces seem to be written down with the other sign.": (
            _turned(loads, shear=-1)
        ),
    }


def _turned(
    loads: BenchLoads, places: Array | float = 1.0, shear: Array | float = 1.0
) -> BenchLoads:
    forces = loads.forces.copy()
    forces[..., 1:] *= shear
    return replace(loads, places=places * loads.places, forces=forces, tactels=None)
