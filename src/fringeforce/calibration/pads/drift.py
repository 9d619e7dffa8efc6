"""What drifted on the bench of a pad since its calibration.

All frames share what lasts of a pad, with the calibration widened by the drift as prior.  Frames of
known presses are searched as those of a calibration are.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.bench_search import inverse
from fringeforce.calibration.drift_report import EXPLAINED, FORCES, ROUNDS, Drift, Told, missed
from fringeforce.calibration.fit import fitted
from fringeforce.calibration.judgement import wrong_forces
from fringeforce.calibration.pads.calibrated import (
    found_values,
    known_pad,
    stated_value,
    wrong_presses,
)
from fringeforce.calibration.pads.drift_bench import SkinBench, TactelBench
from fringeforce.calibration.pads.drift_search import DriftSearch
from fringeforce.calibration.timed_loads import TimedLoads
from fringeforce.design.pad import Pad
from fringeforce.design.tolerances import Tolerances, with_values
from fringeforce.models.as_built import RESIDUAL
from fringeforce.models.pad import PadModel, characterize_pad
from fringeforce.models.pad_knowledge import PadKnowledge
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.models.pad_unknowns import EFFECTS, FIELDS, UNEVEN


class Drifted(NamedTuple):
    """What frames say of a pad that may have drifted.

    Attributes
    ----------
    unsure : PadUncertainty
        What is uncertain about it.
    before : (ndarray, ndarray)
        Mean, shape (S,), and precision, (S, S), of what lasts before the frames.
    shared, covariance : ndarray, shapes (S,) and (S, S)
        What lasts, after them.
    explained : ndarray of bool, shape (F,)
        Frames that are explained.
    wrong : str
        What is against the model besides frames that are not explained, if anything.
    words : tuple of str
        What is said of presses that were left out.
    delay : float
        By which a log of the loads is behind the frames [s].
    search : DriftSearch, optional
        Where layers enter by their logarithms.
    """

    unsure: PadUncertainty
    before: tuple[Array, Array]
    shared: Array
    covariance: Array
    explained: Mask
    wrong: str = ""
    words: tuple[str, ...] = ()
    delay: float = 0.0
    search: DriftSearch | None = None

    def values(self, pad: Pad, shared: Array) -> tuple[Mapping[str, float], Mapping[str, float]]:
        """Values of a pad under unknowns that last, shape (S,), and derivatives by these."""
        if self.search is not None:
            stds = np.sqrt(np.diag(self.covariance))
            layers = self.search.layers(shared)
            return found_values(self.search.known, layers, shared, stds)
        unsure = self.unsure
        own = [g for g in unsure.groups if unsure.lasting[g.begin] and g.path not in FIELDS]
        return (
            {g.path: stated_value(pad, g.path) + g.std * float(shared[g.begin]) for g in own},
            {g.path: g.std for g in own},
        )


def updated_pad(
    model: PadModel,
    levels: Array,
    known: Array | BenchLoads | TimedLoads | None,
    drift: Drift,
    unloaded: bool,
    report: Progress,
) -> PadModel:
    """`update` for a pad.

    Parameters
    ----------
    model : PadModel
        Calibrated.
    levels : ndarray, shape (F, P)
        Grey levels.
    known : ndarray, shape (F, 3n), BenchLoads or TimedLoads, optional
        Forces of tactels that acted [N], or presses as they are written down; they are found with
        the rest if not given, or contacts of a skin.
    drift : Drift
        What may have changed.
    unloaded : bool
        Whether nothing touches the pad.
    report : callable
        Told what is done.
    """
    if model.known is None or model.calibration is None:
        raise InputError("This pad was never calibrated; calibrate it first.")
    loosened = _loosened(model, drift)
    if isinstance(known, BenchLoads | TimedLoads):
        return _updated(model, _under_presses(loosened, levels, known, report))
    anywhere = model.sensor.skin is not None and known is None
    kind = SkinBench if anywhere else TactelBench
    bench = kind(loosened, levels, known)
    total = len(levels) + ROUNDS
    frames = []
    for number in range(len(levels)):
        report(f"Finding what drifted in {len(levels)} frames", number, total)
        frames.append(bench.begun(number))
    state, information, explained = bench.together(frames, report, total)
    if explained.any() and not explained.all():
        # what is hard to find under all drift may be easy under that of the others
        nearer = kind(_told_by(loosened, bench.unsure, state.shared, information), levels, known)
        for number in np.flatnonzero(~explained).tolist():
            frames[number] = nearer.begun(number)
        state, information, explained = bench.together(frames, report, total, state.shared)
    report("Done", total, total)
    covariance = inverse(information)
    return _updated(model, Drifted(bench.unsure, bench.prior, state.shared, covariance, explained))


def _under_presses(
    loosened: PadModel, levels: Array, known: BenchLoads | TimedLoads, report: Progress
) -> Drifted:
    """What frames of presses say that are written down, and perhaps wrongly."""
    search = DriftSearch(loosened, levels, known)
    fit = fitted(search, report)
    loads = known if isinstance(known, BenchLoads) else known.at(fit.delay)
    wrong = wrong_forces(fit)
    outliers = tuple(np.flatnonzero(~fit.explained).tolist())
    return Drifted(
        search.known,
        search.prior,
        fit.state.shared[fit.posterior.bench.at.own("pad")],
        search.uncertain(fit),
        fit.explained,
        f"Do not use this model: {wrong} Compare the loads with the frames." if wrong else "",
        tuple(wrong_presses(outliers, loads)),
        fit.delay,
        search,
    )


def _loosened(model: PadModel, drift: Drift) -> PadModel:
    """The pad with what is known of it widened by the drift, tolerances and all."""
    known, pad = model.known, model.sensor
    assert known is not None
    amplitude = pad.camera.amplitude
    drifts = {
        "camera.amplitude": drift.light * amplitude,
        "camera.offset": drift.offset * amplitude,
        "camera.shift_x": drift.shift,
        "camera.shift_y": drift.shift,
        "camera.scale": drift.scale,
        RESIDUAL: drift.residual,
    }
    wide = {path: float(np.hypot(std, drifts.get(path, 0.0))) for path, std in known.stds.items()}
    stated = {path: std for path, std in wide.items() if path != UNEVEN}
    # unknowns are measured in the tolerances
    scale, added = (
        np.concatenate([np.full(count, share(path)) for path, count in known.counts.items()])
        for share in (
            lambda path: known.stds[path] / wide[path],
            lambda path: (drifts.get(path, 0.0) / wide[path]) ** 2,
        )
    )
    covariance = known.covariance * np.outer(scale, scale) + np.diag(added)
    return replace(
        model,
        sensor=pad.model_copy(update={"tolerances": Tolerances({**pad.tolerances, **stated})}),
        known=PadKnowledge(wide, known.counts, known.mean * scale, covariance),
    )


def _told_by(
    model: PadModel, unsure: PadUncertainty, shared: Array, information: Array
) -> PadModel:
    """The pad with what frames have told of what lasts, shape (S,), and its information."""
    lasting = [group for group in unsure.groups if unsure.lasting[group.begin]]
    stds = {group.path: group.std for group in lasting}
    counts = {group.path: group.end - group.begin for group in lasting}
    return replace(model, known=PadKnowledge(stds, counts, shared, inverse(information)))


def _updated(model: PadModel, drifted: Drifted) -> PadModel:
    """The pad as found, with what is left uncertain and words on what changed."""
    unsure, found, pad = drifted.unsure, model.calibration, model.sensor
    assert found is not None
    shared, covariance, explained = drifted.shared, drifted.covariance, drifted.explained
    told = list(_told(drifted))
    # what frames do not tell of stays; the rest is as it is then
    groups = (unsure.group(path) for one in told if not one.known for path in one.paths)
    left = [np.arange(group.begin, group.end) for group in groups if group is not None]
    if left:
        kept = np.concatenate(left)
        off = (shared - drifted.before[0])[kept]
        moved = covariance[:, kept] @ np.linalg.solve(covariance[np.ix_(kept, kept)], off)
        shared = shared - moved
    unit, mean = np.ones(len(shared)), np.zeros(len(shared))
    values, units = drifted.values(pad, shared)
    for group in unsure.groups:
        if group.path in units:
            unit[group.begin] = units[group.path]
        elif group.path in FIELDS:
            mean[group.place] = shared[group.place]
    whole = covariance * np.outer(unit, unit)
    squares = np.asarray(np.square(mean) + np.diag(covariance), dtype=float)
    made, known, _ = known_pad(unsure, with_values(pad, values), whole, mean, squares)
    influence = model.influence
    later = characterize_pad(made, None, len(influence.x), len(influence.profile))
    begins = [unsure.group(name) for name in found.names]
    own = np.array([group.begin for group in begins if group is not None])
    reached = np.array([stated_value(made, name) for name in found.names])
    relative = np.array([name.startswith("camera") for name in found.names])
    relative = np.where(relative, 1.0, reached)
    calibration = replace(
        found,
        values=reached,
        covariance=whole[np.ix_(own, own)] / np.outer(relative, relative),
        outliers=tuple(np.flatnonzero(~explained).tolist()),
        usable=bool(explained.mean() >= EXPLAINED) and not drifted.wrong,
        delay=drifted.delay,
        record=None,
        findings=(
            *[drifted.wrong] * bool(drifted.wrong),
            *missed(explained),
            *drifted.words,
            *map(str, told),
            *[FORCES] * (drifted.search is None),
        ),
    )
    return replace(later, provenance=model.provenance, calibration=calibration, known=known)


def _told(drifted: Drifted) -> Iterator[Told]:
    """What the frames tell of each thing that may drift."""
    unsure, shared, covariance = drifted.unsure, drifted.shared, drifted.covariance
    pad, (mean, precision) = unsure.model.sensor, drifted.before
    before = inverse(precision)

    def told(name: str, unit: str, path: str, change: Array) -> Told:
        std, first = (float(np.sqrt(change @ c @ change)) for c in (covariance, before))
        return Told(name, unit, (path,), float(change @ (shared - mean)), std, first)

    for path, name, unit, size in (
        ("camera.amplitude", "The light", "%", 100 / pad.camera.amplitude),
        ("camera.offset", "The dark level", "grey levels", 1.0),
        (RESIDUAL, "The residual", "rad where it changed most", 1.0),
        ("camera.shift_x", "The camera's place along x", "mm", 1e3),
        ("camera.shift_y", "The camera's place along y", "mm", 1e3),
        ("camera.scale", "The camera's scale", "%", 100.0),
    ):
        group = unsure.group(path)
        if group is None:
            continue
        change = np.zeros(len(shared))
        change[group.place] = size * group.std
        if path == RESIDUAL:
            change[group.place] = _most(unsure, (shared - mean)[group.place])
        yield told(name, unit, path, change)
    if drifted.search is not None:
        for path in EFFECTS:
            if (group := unsure.group(path)) is not None:
                change = np.zeros(len(shared))
                change[group.place] = 100 * drifted.search.known.logarithmic(group)
                yield told("The strength of the effect", "%", path, change)


def _most(unsure: PadUncertainty, change: Array) -> Array:
    """What the modes of the residual are worth where they change it most, shape (r,) [rad]."""
    base = unsure.model.influence
    fields, _ = unsure.residual.at(base.x[::4], base.y[::4])
    parts = change.reshape(2, -1) @ fields
    part, place = np.unravel_index(np.abs(parts).argmax(), parts.shape)
    found = np.zeros((2, len(fields)))
    found[part] = fields[:, place]
    return found.ravel()
