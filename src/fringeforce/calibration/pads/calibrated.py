"""From the fit of a bench to a calibrated pad: what was found, and how sure all of it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.bench_loads import BenchLoads, in_words
from fringeforce.calibration.findings import unidentified
from fringeforce.calibration.fit import BenchFit
from fringeforce.calibration.judgement import judgement
from fringeforce.calibration.pads.bench_uncertainty import BenchUncertainty, is_layer
from fringeforce.calibration.pads.search import PadSearch
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import Tolerances, limits, number_at, with_values
from fringeforce.models.as_built import PLACEMENT, RESIDUAL, SIZE
from fringeforce.models.imaging import Calibration
from fringeforce.models.pad import PadModel, characterize_pad
from fringeforce.models.pad_knowledge import PadKnowledge
from fringeforce.models.pad_uncertainty import BLUR
from fringeforce.models.uncertainty import DRIFTS

WITHIN = 3.1
"""Deviations that a drawing allows a value to be from the end of its range, and a little more."""
LEAST = 1e-3
"""Smallest residual that is worth an unknown [rad]."""


def calibrated_pad(search: PadSearch, fit: BenchFit, levels: Array, loads: BenchLoads) -> PadModel:
    """The calibrated model of a pad.

    Parameters
    ----------
    search : PadSearch
        Where it was found.
    fit : BenchFit
        The fit.
    levels : ndarray, shape (F, P)
        Frames with loads.
    loads : BenchLoads
        What was written down for them.
    """
    known, pad, shared = search.known, search.sensor, fit.state.shared
    lasting = [group for group in known.groups if group.path not in (*DRIFTS, PLACEMENT)]
    # small errors of contacts' tractions are another in every frame
    more = np.sqrt(np.maximum(fit.excess, max(fit.chi2, 1.0)))
    spread = fit.covariance * np.outer(more, more)
    values, units = _values(known, search.layers(shared), shared, np.sqrt(np.diag(spread)))
    unit = np.ones(len(shared))
    for group in lasting:
        if group.path != RESIDUAL:
            unit[group.begin] = units[group.path]
    covariance = spread * np.outer(unit, unit)
    singles = np.array([group.begin for group in lasting if group.path != RESIDUAL])
    paths = tuple(group.path for group in lasting if group.path != RESIDUAL)
    stds = dict(zip(paths, np.sqrt(np.diag(covariance)[singles]).tolist(), strict=True))
    values, stds = _within(pad, values, stds)
    rough = known.group(RESIDUAL)
    assert rough is not None
    mean = np.zeros(len(shared))
    mean[rough.place] = shared[rough.place]
    squares = np.square(mean) + np.diag(fit.covariance)
    stds[RESIDUAL] = max(float(np.sqrt(known.residual_square(squares[rough.place]))), LEAST)
    scale = np.ones(len(shared))
    for group in lasting:
        size = stds[group.path] / (group.std if group.path == RESIDUAL else 1.0)
        scale[group.place] = 1 / size
    knowledge = PadKnowledge(
        {group.path: stds[group.path] for group in lasting},
        {group.path: group.end - group.begin for group in lasting},
        mean * scale,
        covariance * np.outer(scale, scale),
    )
    gain = fit.posterior.expected.sizes["gain"] * known.model.sensor.camera.drift
    drift = gain if fit.shown("gain") else pad.camera.drift
    contacts = {path: pad.tolerances[path] for path in (PLACEMENT, SIZE) if path in pad.tolerances}
    made = with_values(pad, {**values, DRIFTS[0]: float(drift)}).model_copy(
        update={"tolerances": Tolerances({**contacts, **stds})}
    )
    influence = search.model.influence
    model = characterize_pad(made, None, len(influence.x), len(influence.profile))
    judged = judgement(fit, levels, loads)
    relative = np.array([1.0 if path.startswith("camera") else values[path] for path in paths])
    own = covariance[np.ix_(singles, singles)] / np.outer(relative, relative)
    layers = np.array([is_layer(path) for path in paths])
    names = tuple(path for path in paths if is_layer(path))
    outliers = tuple(np.flatnonzero(~fit.kept[: len(levels)]).tolist())
    found = Calibration(
        names=paths,
        drawing=np.array([_drawn(known, path) for path in paths]),
        values=np.array([values[path] for path in paths]),
        covariance=own,
        unidentified=unidentified(names, own[np.ix_(layers, layers)]),
        outliers=outliers,
        dead=tuple(np.flatnonzero(~fit.sound).tolist()),
        chi2=fit.chi2,
        findings=(*judged.words, *_findings(outliers, loads)),
        checked=tuple(fit.checked),
        usable=judged.usable,
    )
    provenance = {
        **model.provenance,
        "method": "double Fourier series, calibrated",
        "calibration frames": int(fit.kept.sum()),
    }
    return replace(model, provenance=provenance, calibration=found, known=knowledge)


def _drawn(known: BenchUncertainty, path: str) -> float:
    found = number_at(known.model.sensor, path)
    return 0.0 if found is None else found[0]


def _values(
    known: BenchUncertainty, layers: dict[str, float], shared: Array, stds: Array
) -> tuple[dict[str, float], dict[str, float]]:
    """Values that were found, and their derivatives by their unknowns."""
    values, units = {}, {}
    for group in known.groups:
        path = group.path
        if path in (RESIDUAL, PLACEMENT, *DRIFTS):
            continue
        if path in layers:
            values[path] = layers[path]
            units[path] = layers[path] * known.logarithmic(group)
        elif path == BLUR:
            values[path], units[path] = known.blur(shared, stds[group.begin])
        else:
            values[path] = _drawn(known, path) + group.std * float(shared[group.begin])
            units[path] = group.std
    return values, units


def _within(
    pad: Pad, values: dict[str, float], stds: dict[str, float]
) -> tuple[dict[str, float], dict[str, float]]:
    """Values and deviations as a drawing may state them."""
    values, stds = dict(values), dict(stds)
    for path, value in values.items():
        stated = number_at(with_values(pad, {path: value}), path)
        assert stated is not None
        allowed = limits(stated[1])
        values[path] = value = float(np.clip(value, allowed.low, allowed.high))
        stds[path] = min(stds[path], min(value - allowed.above, allowed.below - value) / WITHIN)
    return values, stds


def _findings(outliers: tuple[int, ...], loads: BenchLoads) -> list[str]:
    """What was recorded of frames that were left out."""
    if not outliers:
        return []
    said = in_words(loads.rows(list(outliers)))
    return [
        f"Frame {row}, recorded as {words!r}, contradicts the others and was left out."
        for row, words in zip(outliers, said, strict=True)
    ]
