"""Fills the record of a bench from its fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.calibration.bench_search import BenchSearch
from fringeforce.calibration.fit import BenchFit
from fringeforce.estimation.shared_fit import Eliminated
from fringeforce.models.bench_record import BenchRecord

GROUPS = 128, 32
"""Groups of neighbouring pixels at most along each axis, of lines and of images, of which residuals
are kept: a picture shows no more."""


def bench_record(
    search: BenchSearch, fit: BenchFit, levels: Array, loads: BenchLoads
) -> BenchRecord:
    """What pictures of a calibration need; contacts of frames left out are not found.

    Parameters
    ----------
    search : BenchSearch
        Where it was found.
    fit : BenchFit
        The fit.
    levels : ndarray, shape (F, P)
        Frames with loads.
    loads : BenchLoads
        What was written down for them.
    """
    count, sensor = len(levels), fit.sensor
    posterior = replace(fit.posterior, shares=np.ones(len(fit.posterior.shares)))
    models = fit.models
    _, squares, counts = posterior.loss(fit.state, models)
    covariance, terms = fit.covariance, posterior.terms(fit.state, models)
    left = np.where(fit.sound & search.seen, search.residuals(models), np.nan)[:count]
    columns = len(sensor.components) + sensor.dimensions + 1
    written, there, unsure = ([np.empty((0, columns))] for _ in range(3))
    frames = list[int]()
    for f, told in zip(range(count), terms, strict=False):
        k = int((search.which[f] >= 0).sum())
        own = np.flatnonzero(loads.present[f])
        if not k:
            continue
        frames += [f] * k
        stated = loads.places[f, own], loads.forces[f, own], loads.widths[f, own]
        deviations = np.sqrt(np.maximum(Eliminated.of(told).variances(covariance), 0.0))
        found = posterior.table(f, fit.state.own[f])
        std = posterior.table(f, deviations, deviations=True)
        if not fit.kept[f]:
            # contacts that contradict cannot move as far as they are wrong
            found, std = np.full((2, *found.shape), np.nan)
        written.append(np.column_stack(stated))
        there.append(found)
        unsure.append(std)
    return BenchRecord(
        np.array(frames, dtype=np.intp),
        np.concatenate(written),
        np.concatenate(there),
        np.concatenate(unsure),
        np.array([_grouped(row.reshape(sensor.frame_shape), sensor.dimensions) for row in left]),
        (squares / np.maximum(counts, 1.0))[:count],
        np.array(fit.aside, dtype=float).reshape(-1, 4),
    )


def _grouped(left: Array, dimensions: int) -> Array:
    """Sums of neighbouring residuals, and of those of channels, over the root of their number."""
    number = np.isfinite(left).astype(float)
    sums = np.nan_to_num(left)
    channels = left.ndim - dimensions
    for axis, length in enumerate(left.shape):
        groups = 1 if axis < channels else min(length, GROUPS[dimensions - 1])
        begins = [int(part[0]) for part in np.array_split(np.arange(length), groups)]
        number, sums = (np.add.reduceat(v, begins, axis=axis) for v in (number, sums))
    found = np.where(number > 0, sums / np.sqrt(np.maximum(number, 1)), np.nan)
    return found.reshape(found.shape[channels:])
