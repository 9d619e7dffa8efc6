"""From the fit of a bench to a calibrated pad: what was found, and how sure all of it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.bench_loads import BenchLoads, in_words
from fringeforce.calibration.bench_record import bench_record
from fringeforce.calibration.findings import unidentified
from fringeforce.calibration.fit import BenchFit
from fringeforce.calibration.judgement import judgement
from fringeforce.calibration.pads.bench_uncertainty import BenchUncertainty, is_layer
from fringeforce.calibration.pads.search import PadSearch
from fringeforce.calibration.timed_loads import TimedLoads
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import Tolerances, limits, number_at, with_values
from fringeforce.models.as_built import PLACEMENT, RESIDUAL, SIZE
from fringeforce.models.design_modes import DRIFTS
from fringeforce.models.imaging import Calibration
from fringeforce.models.pad import PadModel, characterize_pad
from fringeforce.models.pad_knowledge import PadKnowledge
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.models.pad_unknowns import BLUR, FIELDS, UNEVEN

WITHIN = 3.1
"""Deviations that a drawing allows a value to be from the end of its range, and a little more."""
LEAST = 1e-3
"""Smallest residual [rad], and unevenness of the light, that is worth an unknown."""


def calibrated_pad(
    search: PadSearch, fit: BenchFit, levels: Array, known: BenchLoads | TimedLoads
) -> PadModel:
    """The calibrated model of a pad.

    Parameters
    ----------
    search : PadSearch
        Where it was found.
    fit : BenchFit
        The fit.
    levels : ndarray, shape (F, P)
        Frames with loads.
    known : BenchLoads or TimedLoads
        What was written down for them.
    """
    loads = known if isinstance(known, BenchLoads) else known.at(fit.delay)
    own = fit.posterior.bench.at.own("pad")
    unsure, pad, shared = search.known, search.sensor, fit.state.shared[own]
    told, excess = fit.covariance[own, own], fit.excess[own]
    lasting = [group for group in unsure.groups if group.path not in (*DRIFTS, PLACEMENT)]
    # small errors of contacts' tractions are another in every frame
    more = np.sqrt(np.maximum(excess, max(fit.chi2, 1.0)))
    spread = told * np.outer(more, more)
    values, units = found_values(unsure, search.layers(shared), shared, np.sqrt(np.diag(spread)))
    unit = np.ones(len(shared))
    mean = np.zeros(len(shared))
    for group in lasting:
        if group.path in FIELDS:
            mean[group.place] = shared[group.place]
        else:
            unit[group.begin] = units[group.path]
    covariance = spread * np.outer(unit, unit)
    squares = np.square(mean) + np.diag(told)
    gain = fit.posterior.expected.sizes["gain"] * unsure.model.sensor.camera.drift
    drift = gain if fit.shown("gain") else pad.camera.drift
    begun = with_values(pad, {**values, DRIFTS[0]: float(drift)})
    made, knowledge, stds = known_pad(unsure, begun, covariance, mean, squares)
    paths = tuple(path for path in stds if path not in FIELDS)
    values = {path: stated_value(made, path) for path in paths}
    singles = np.array([group.begin for group in lasting if group.path not in FIELDS])
    influence = search.model.influence
    model = characterize_pad(made, None, len(influence.x), len(influence.profile))
    judged = judgement(fit, levels, loads, {path: (values[path], stds[path]) for path in paths})
    relative = np.array([1.0 if path.startswith("camera") else values[path] for path in paths])
    own = covariance[np.ix_(singles, singles)] / np.outer(relative, relative)
    layers = np.array([is_layer(path) for path in paths])
    names = tuple(path for path in paths if is_layer(path))
    outliers = tuple(np.flatnonzero(~fit.kept[: len(levels)]).tolist())
    found = Calibration(
        names=paths,
        drawing=np.array([stated_value(unsure.model.sensor, path) for path in paths]),
        values=np.array([values[path] for path in paths]),
        covariance=own,
        unidentified=unidentified(names, own[np.ix_(layers, layers)]),
        outliers=outliers,
        dead=tuple(np.flatnonzero(~fit.sound).tolist()),
        chi2=fit.chi2,
        findings=(*judged.words, *wrong_presses(outliers, loads)),
        checked=tuple(fit.checked),
        usable=judged.usable,
        delay=fit.delay,
        record=bench_record(search, fit, levels, loads),
    )
    provenance = {
        **model.provenance,
        "method": "double Fourier series, calibrated",
        "calibration frames": int(fit.kept[: len(levels)].sum()),
    }
    return replace(model, provenance=provenance, calibration=found, known=knowledge)


def known_pad(
    unsure: PadUncertainty, pad: Pad, covariance: Array, mean: Array, squares: Array
) -> tuple[Pad, PadKnowledge, dict[str, float]]:
    """A pad with what is known of it as tolerances, and all of these together.

    Parameters
    ----------
    unsure : PadUncertainty
        Whose unknowns last, but for those of single frames.
    pad : Pad
        With the values that were found.
    covariance : ndarray, shape (S, S)
        Of the values in their units, and of the modes of fields in those of `unsure`.
    mean : ndarray, shape (S,)
        Of the modes of fields.
    squares : ndarray, shape (S,)
        Mean squares of these.

    Returns
    -------
    pad : Pad
        With values within what a drawing may state.
    known : PadKnowledge
        Mean and covariance of its tolerances.
    stds : dict
        The tolerances by their paths.
    """
    lasting = [group for group in unsure.groups if group.path not in (*DRIFTS, PLACEMENT)]
    singles = [group for group in lasting if group.path not in FIELDS]
    deviations = np.sqrt(np.diag(covariance))
    stds = {group.path: float(deviations[group.begin]) for group in singles}
    values, stds = _within(pad, {path: stated_value(pad, path) for path in stds}, stds)
    for path in FIELDS:
        if group := unsure.group(path):
            field = unsure.residual if path == RESIDUAL else unsure.shades
            stds[path] = max(float(np.sqrt(field.square(squares[group.place]))), LEAST)
    scale = np.ones(len(mean))
    for group in lasting:
        size = stds[group.path] / (group.std if group.path in FIELDS else 1.0)
        scale[group.place] = 1 / size
    known = PadKnowledge(
        {group.path: stds[group.path] for group in lasting},
        {group.path: group.end - group.begin for group in lasting},
        mean * scale,
        covariance * np.outer(scale, scale),
    )
    contacts = {path: pad.tolerances[path] for path in (PLACEMENT, SIZE) if path in pad.tolerances}
    if UNEVEN in stds:
        values[UNEVEN] = stds[UNEVEN]
    stated = {path: std for path, std in stds.items() if path != UNEVEN}
    made = _stateable(with_values(pad, values)).model_copy(
        update={"tolerances": Tolerances({**contacts, **stated})}
    )
    return made, known, stds


def _stateable(pad: Pad) -> Pad:
    """A pad whose light is one that a drawing may state: within the converter's range, or clipped.

    Noise that is uniform never takes grey levels below zero.
    """
    camera = pad.camera
    noise = camera.noise if camera.noise_model == "uniform" else 0.0
    offset = float(max(camera.offset, noise))
    beyond = bool(camera.amplitude + offset + noise > camera.full_scale)
    update = {"offset": offset, "clipped": camera.clipped or beyond}
    return pad.model_copy(update={"camera": camera.model_copy(update=update)})


def stated_value(pad: Pad, path: str) -> float:
    """The value at a dotted path; zero if there is none."""
    found = number_at(pad, path)
    return 0.0 if found is None else found[0]


def found_values(
    known: BenchUncertainty, layers: dict[str, float], shared: Array, stds: Array
) -> tuple[dict[str, float], dict[str, float]]:
    """Values that were found, and their derivatives by their unknowns.

    Parameters
    ----------
    known : BenchUncertainty
        What was uncertain.
    layers : dict
        Values that enter by their logarithms.
    shared : ndarray, shape (S,)
        Unknowns of the pad, as found.
    stds : ndarray, shape (S,)
        Their deviations.
    """
    values, units = {}, {}
    for group in known.groups:
        path = group.path
        if path in (*FIELDS, PLACEMENT, *DRIFTS):
            continue
        if path in layers:
            values[path] = layers[path]
            units[path] = layers[path] * known.logarithmic(group)
        elif path == BLUR:
            values[path], units[path] = known.camera.blur(shared, stds[group.begin])
        else:
            values[path] = stated_value(known.model.sensor, path) + group.std * float(
                shared[group.begin]
            )
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


def wrong_presses(outliers: tuple[int, ...], loads: BenchLoads) -> list[str]:
    """What was recorded of frames that were left out."""
    if not outliers:
        return []
    said = in_words(loads.rows(list(outliers)))
    return [
        f"Frame {row}, recorded as {words!r}, contradicts the others and was left out."
        for row, words in zip(outliers, said, strict=True)
    ]
