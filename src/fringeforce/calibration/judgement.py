"""Whether a calibrated model can be used, and if not, what is the likeliest cause."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.special import bdtr, ndtr

from fringeforce.base.arrays import Array
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.design_entries import DRAWN
from fringeforce.calibration.fit import HOPELESS, BenchFit
from fringeforce.calibration.verification import CONTRADICTED
from fringeforce.design.text import unit_at
from fringeforce.design.tolerances import number_at
from fringeforce.design.units import READABLE

LEFT_OUT = 0.2
"""Share of frames that may contradict the others, or that the model need not explain: one press in
five is not an accident."""
EXPLAINS = 0.25
"""Share of what the misfit has beyond noise that a cause must leave at most to be named: the right
one leaves none, and a wrong one that wandered far was seen to leave two fifths."""
WRONG_DRAWING = (
    "The sensor is not the one of the drawing, or the drawing is wrong: correct it or its "
    "tolerance, and calibrate again."
)
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


Values = Mapping[str, tuple[float, float]]
"""Values that were found, by their paths, and their standard deviations."""


def judgement(fit: BenchFit, levels: Array, loads: BenchLoads, values: Values) -> Judgement:
    """Judge a fit by its frames, by those that were put aside, and by the drawing.

    Parameters
    ----------
    fit : BenchFit
        The fit.
    levels : ndarray, shape (F, P)
        Frames with loads.
    loads : BenchLoads
        What was written down for them.
    values : mapping
        What was found.
    """
    wrong, checked = _wrong(fit, len(levels)), fit.checked
    words = []
    if checked.forces:
        words.append(
            f"{checked.frames} frames were put aside and checked: {checked.explained} are "
            f"explained, and {1e2 * checked.inside / checked.forces:.0f} % of their forces lie "
            "within 95 % intervals."
        )
    if wrong:
        cause = _cause(fit, levels, loads)
    elif wrong := wrong_forces(fit):
        cause = OTHER
    elif wrong := " ".join(_far_off(fit.sensor, values, stated=True)):
        cause = WRONG_DRAWING
    else:
        return Judgement(True, (*words, *_far_off(fit.sensor, values, stated=False)))
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


def wrong_forces(fit: BenchFit) -> str:
    """What is wrong with the forces of a fit that explains its frames, if anything."""
    checked = fit.checked
    if checked.forces and bdtr(checked.inside, checked.forces, 0.95) < CONTRADICTED:
        return (
            f"only {1e2 * checked.inside / checked.forces:.0f} % of the forces of frames that "
            "were put aside lie within their 95 % intervals."
        )
    if {"normal", "tangential"}.intersection(fit.beyond):
        return "no load cell scatters as its forces do about those written down."
    return ""


def _far_off(sensor: Any, values: Values, stated: bool) -> Iterator[str]:
    """Values that are not those of the drawing: by its tolerances, or where it states none.

    Frames are explained all the same, as layers are searched up to four times as thick or stiff.
    """
    tolerances: Mapping[str, float] = sensor.tolerances
    for path, (value, std) in values.items():
        tolerance = tolerances.get(path)
        plain = tolerance is None and path.startswith("transducer.")
        if not (plain if not stated else tolerance is not None):
            continue
        drawn = number_at(sensor, path)
        if drawn is None:
            continue
        allowed = DRAWN * abs(drawn[0]) if tolerance is None else tolerance
        off = abs(value - drawn[0]) / np.hypot(allowed, std)
        # of all values together
        if 2 * ndtr(-off) * len(values) > CONTRADICTED:
            continue
        factor, symbol = READABLE.get(unit_at(sensor, path), (1.0, ""))
        there, here = (f"{one * factor:.4g} {symbol}".rstrip() for one in (value, drawn[0]))
        if tolerance is None:
            yield (
                f"{path} is {there}, and {here} in the drawing, which states no tolerance: see "
                "whether this is the sensor of the drawing, and correct that."
            )
        else:
            yield (
                f"{path} is {there}, {off:.2g} standard deviations from the {here} of the drawing, "
                f"whose tolerance is {tolerance * factor:.2g} {symbol}".rstrip()
                + "."
            )


def _cause(fit: BenchFit, levels: Array, loads: BenchLoads) -> str:
    """The likeliest cause, by what explains some of the frames better."""
    loaded = np.flatnonzero(loads.present.any(axis=1))
    on_pad = loads.forces.shape[2] == 3
    few = FEW[on_pad]
    some = loaded[:: max(len(loaded) // few, 1)][:few]
    chosen, own = levels[some], loads.rows(some)
    usual = fit.rough(chosen, own, np.inf)
    limit = 1 + EXPLAINS * (usual - 1)
    most = max(limit, HOPELESS)
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
            misfits[words] = fit.rough(chosen, other, most)
            if misfits[words] < min(limit, HOPELESS):
                break
    words = min(misfits, key=lambda each: misfits[each])
    if misfits[words] < limit:
        return words
    free = replace(own, force_std=np.full(own.forces.shape, np.nanmax(loads.magnitude)))
    if fit.rough(chosen, free, most) < limit:
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
