"""Fills the record of a bench from its fit."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.fit import BenchFit
from fringeforce.contacts.resultant import Resultant, touch
from fringeforce.design.strip import Sensor
from fringeforce.estimation.frame_exposure import expose
from fringeforce.estimation.shared_fit import Eliminated
from fringeforce.models.as_built import PLACEMENT
from fringeforce.models.bench_record import BenchRecord
from fringeforce.models.strip import SensorModel
from fringeforce.reading.reader import Reader

GROUPS = 128
"""Groups of neighbouring pixels at most, of which residuals are kept: a picture shows no more."""
READ = 5
"""Frames left out that are read to say where their contact was; the others are only marked."""


def bench_record(
    fit: BenchFit, model: SensorModel, levels: Array, loads: BenchLoads
) -> BenchRecord:
    """What pictures of a calibration need.

    Parameters
    ----------
    fit : BenchFit
        The fit.
    model : SensorModel
        The calibrated model, by which the single contacts of frames left out are read.
    levels : ndarray, shape (F, P)
        Frames with loads.
    loads : BenchLoads
        What was written down for them.
    """
    count = len(levels)
    posterior = replace(fit.posterior, shares=np.ones(len(fit.posterior.shares)))
    models = fit.models
    _, squares, counts = posterior.loss(fit.state, models)
    size, bench = posterior.bench.contacts.size, posterior.bench
    covariance, terms = fit.covariance, posterior.terms(fit.state, models)
    frames, written, found, std, residuals = [], [], [], [], []
    left_out = np.flatnonzero(~fit.kept[:count])
    # a model of no use reads nothing that can be believed
    usable = model.calibration is not None and model.calibration.usable
    reader = _anywhere(model) if usable and left_out.size else None
    for f, told in zip(range(count), terms, strict=False):
        unknowns, frame = fit.state.own[f], models.of_frame(f)
        level = expose(frame, models.unknowns(f, unknowns, fit.state.shared))[0]
        left = (levels[f] - level) / np.sqrt(frame.variance)
        residuals.append(_grouped(np.where(np.isfinite(bench.frames[f]), left, np.nan)))
        own = np.flatnonzero(bench.which[f] >= 0)
        k = len(own)
        if not k:
            continue
        stated = np.column_stack([loads.places[f, own], loads.forces[f, own], loads.widths[f, own]])
        grid = loads.places[f, own] - bench.beside[f, own]
        deviations = np.sqrt(np.maximum(Eliminated.of(told).variances(covariance)[: 4 * k], 0.0))
        forces, sizes = unknowns[: 2 * k].reshape(k, 2), deviations[: 2 * k].reshape(k, 2)
        places = grid + size.place * unknowns[2 * k : 3 * k]
        widths = size.width + size.width_std * unknowns[3 * k : 4 * k]
        there = np.column_stack([places, forces, widths])
        unsure = np.column_stack(
            [
                size.place * deviations[2 * k : 3 * k],
                sizes,
                size.width_std * deviations[3 * k :],
            ]
        )
        if not fit.kept[f]:
            # contacts that contradict cannot move as far as they are wrong
            there, unsure = np.full((2, k, 4), np.nan)
            if reader is not None and k == 1 and f in left_out[:READ]:
                there[0], unsure[0] = _read(reader, levels[f])
        frames += [f] * k
        written.append(stated)
        found.append(there)
        std.append(unsure)
    none = np.empty((0, 4))
    return BenchRecord(
        np.array(frames, dtype=np.intp),
        np.concatenate([none, *written]),
        np.concatenate([none, *found]),
        np.concatenate([none, *std]),
        np.array(residuals),
        (squares / np.maximum(counts, 1.0))[:count],
        np.array(fit.aside, dtype=float).reshape(-1, 4),
    )


def _grouped(left: Array) -> Array:
    """Sums of neighbouring residuals over the root of their number."""
    groups = np.array_split(left, min(GROUPS, len(left)))
    number = np.array([np.isfinite(group).sum() for group in groups])
    sums = np.array([np.nansum(group) for group in groups])
    return np.where(number > 0, sums / np.sqrt(np.maximum(number, 1)), np.nan)


def _anywhere(model: SensorModel) -> Reader:
    """A reader that allows for contacts anywhere between the tactels, where no tolerance does."""
    if model.sensor.skin is not None or PLACEMENT in model.sensor.tolerances:
        return Reader(model)
    between = 1e3 * model.sensor.tactels.pitch / np.sqrt(12)  # of what is uniform over a pitch
    return Reader(model.with_tolerances(**{PLACEMENT: f"0 +/- {between:.6g} mm"}))


def _read(reader: Reader, levels: Array) -> tuple[Array, Array]:
    """Place, forces and width of the one contact of a frame, and their deviations."""
    reading = reader.search(levels)
    if not reading.trusted:
        return np.full(4, np.nan), np.full(4, np.nan)
    sensor = cast(Sensor, reader.model.sensor)
    total: Resultant = reading.total or touch(sensor, reading).total
    centre = float(total.centre_covariance[0, 0])
    values = [total.centre[0], *total.force, np.nan]
    unsure = [np.sqrt(centre), *np.sqrt(np.diag(total.force_covariance)), np.nan]
    return np.array(values), np.array(unsure)
