"""What is known of a pad before the next press, and what presses and readings tell.

A bench of presses is that of a calibration: frames are predicted with all that is unknown of them,
see `pads.posterior`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.calibration.bench_loads import BenchLoads, loads_on_tactels
from fringeforce.calibration.bench_search import STILL, UNSTATED
from fringeforce.calibration.calibrate import usual_parameters
from fringeforce.calibration.design_entries import checked_paths
from fringeforce.calibration.pads.bench_uncertainty import is_layer
from fringeforce.calibration.pads.calibrated import stated_value
from fringeforce.calibration.pads.search import PadSearch
from fringeforce.calibration.planning.candidates import (
    TILT,
    Limits,
    pressed_tactels,
    presses,
    resolved,
)
from fringeforce.calibration.planning.knowledge import checked_against
from fringeforce.design.pad import Pad
from fringeforce.estimation.shared_fit import Eliminated
from fringeforce.models.as_built import PLACEMENT, RESIDUAL, SIZE
from fringeforce.models.pad import PadModel, characterize_pad
from fringeforce.models.pad_unknowns import BLUR

TOGETHER = 3
"""Tactels that a typical load of a pad touches."""
BATCH = 16
"""Frames that are predicted at a time: some megabytes each."""


@dataclass(frozen=True, eq=False)
class PadBenchKnowledge:
    """Estimate and covariance of all that a bench of a pad shares, as k modes of unit variance.

    Attributes
    ----------
    model : PadModel
        The pad as drawn or as calibrated.
    paths : tuple of str
        Design values that are unknown.
    """

    model: PadModel
    paths: tuple[str, ...]

    @property
    def sensor(self) -> Pad:
        """The pad, as drawn or as calibrated."""
        return self.model.sensor

    @property
    def places(self) -> Array:
        """Where it can be pressed, shape (n, 2) [m]."""
        return self.sensor.tactels.places

    @cached_property
    def _first(self) -> PadSearch:
        """A search without loads, of whose pad the others are."""
        frame = np.zeros((1, int(np.prod(self.sensor.frame_shape))))
        none = loads_on_tactels(np.zeros((1, len(self.places), 3)), self.places)
        return PadSearch(self.sensor, frame, none, self.paths, model=self.model)

    @cached_property
    def _expected(self) -> tuple[Array, Array]:
        """Mean of what a bench shares, shape (S,), and a root of its covariance, (S, S)."""
        known = self._first.known
        mean, precision = known.expected
        lasting = known.lasting
        covariance = np.linalg.inv(precision)[np.ix_(lasting, lasting)]
        return mean[lasting], np.asarray(np.linalg.cholesky(covariance), dtype=float)

    @cached_property
    def _single(self) -> list[tuple[str, int, float]]:
        """Path, unknown, and what a unit of it is, of every single value."""
        known, found = self._first.known, []
        for group in known.groups:
            # the blur's unknown is its second moment
            if known.lasting[group.begin] and group.path not in (RESIDUAL, BLUR):
                found.append((group.path, group.begin, group.std))
        return found

    @property
    def names(self) -> tuple[str, ...]:
        """Dotted paths of what is unknown."""
        return tuple(path for path, *_ in self._single)

    @property
    def values(self) -> Array:
        """Of what is named, in their own units, shape (d,)."""
        return np.array([stated_value(self.sensor, path) for path in self.names])

    @property
    def own_root(self) -> Array:
        """What every mode changes in the values, in their own units, shape (d, k)."""
        root = self._expected[1]
        return np.array([unit * root[number] for _, number, unit in self._single])

    def imagined(self, pairs: int) -> list[Array]:
        """Modes (k,) of the estimate, about which all is predicted."""
        return [np.zeros(len(self._expected[0]))]

    def candidates(self, limits: Limits) -> Array:
        """Loads that can be applied, shape (C, n, 3) [N]."""
        chosen = pressed_tactels(self.sensor)
        few = presses(len(chosen), 3, limits)
        loads = np.zeros((len(few), len(self.places), 3))
        loads[:, chosen] = few
        return resolved(loads, self._density(loads), limits)

    def typical(self, limits: Limits, count: int) -> Array:
        """Loads that the pad is to read: some tactels touched at random, (count, n, 3) [N]."""
        rng, n = np.random.default_rng(0), len(self.places)
        loads = np.zeros((count, n, 3))
        for load in loads:
            own = rng.choice(n, min(TOGETHER, n), replace=False)
            size = rng.uniform(0, limits.force, len(own))
            tilt = np.radians(rng.uniform(0, TILT, len(own)))
            way = rng.uniform(0, 2 * np.pi, len(own))
            parts = np.cos(tilt), np.sin(tilt) * np.cos(way), np.sin(tilt) * np.sin(way)
            load[own] = (size * np.array(parts)).T
        density = np.maximum(self._density(loads), np.finfo(float).tiny)
        return loads * np.minimum(1, limits.fringe_density / density)[:, None, None]

    def _density(self, loads: Array) -> Array:
        """Fringes per pixel of loads (C, n, 3) where they are densest, shape (C,)."""
        found = []
        for load in loads:
            retardance = self.model.retardance(load)
            steps = (np.diff(retardance, axis=axis) for axis in (-2, -1))
            found.append(max(float(np.linalg.norm(step, axis=0).max()) for step in steps))
        return np.array(found) / (2 * np.pi)

    def told_by(self, loads: Array, modes: Array) -> Iterator[Array]:
        """Information on the modes of every frame of presses (C, n, 3), shape (k, k).

        Presses are those of a finger or a sphere, whose place is written down.
        """
        root = self._expected[1]
        pressed = replace(loads_on_tactels(loads, self.places), tactels=None)
        for _, told in self._told(pressed):
            yield root.T @ told.information @ root

    def readings(self, loads: Array, modes: Array) -> Iterator[tuple[Array, Array]]:
        """What errors of the modes move in readings of loads (j, n, 3), and covariance of noise.

        Readings know which tactels are touched, and how far contacts are beside them if the drawing
        states it.
        """
        stated = self.sensor.tolerances
        parts = zip(("place", "width"), (PLACEMENT, SIZE), self._first.known.units, strict=True)
        drawn = {name: stated.get(path, STILL * unit) / unit for name, path, unit in parts}
        sizes = drawn | {"normal": UNSTATED, "tangential": UNSTATED}
        root = self._expected[1]
        for contacts, told in self._told(loads_on_tactels(loads, self.places), sizes):
            count = 3 * contacts
            yield told.response[:count] @ root, told.spread[:count, :count]

    def _told(
        self, loads: BenchLoads, sizes: Mapping[str, float] | None = None
    ) -> Iterator[tuple[int, Eliminated]]:
        """Number of contacts of every frame, and what it tells, with some scatter."""
        ones = np.ones(min(len(loads), BATCH))
        for begin in range(0, len(loads), BATCH):
            own = loads.rows(np.arange(begin, min(begin + BATCH, len(loads))))
            frames = np.zeros((len(own), int(np.prod(self.sensor.frame_shape))))
            search = PadSearch(self.sensor, frames, own, self.paths, like=self._first)
            search.state = replace(search.state, shared=self._expected[0])
            search.sound[:] = True  # frames that nobody has taken say nothing of pixels
            search.mask()
            posterior = search.posterior(ones[: len(own)], 1.0)
            expected = posterior.expected
            expected = replace(expected, sizes=expected.sizes | dict(sizes or {}))
            terms = replace(posterior, expected=expected).terms(search.state, None)
            counts = own.present.sum(axis=1).tolist()
            yield from zip(counts, map(Eliminated.of, terms), strict=True)


def pad_knowledge(source: Any, parameters: Sequence[str] | None = None) -> PadBenchKnowledge:
    """What a drawing or a calibrated model of a pad says of all unknowns.

    Parameters
    ----------
    source : Pad or PadModel
        A model that was never calibrated says what its drawing says.
    parameters : sequence of str, optional
        As of `knowledge`.

    Raises
    ------
    InputError
        If a path cannot be calibrated, or differs from those of the model's calibration.
    """
    model: PadModel = source if hasattr(source, "sensor") else characterize_pad(source)
    pad = model.sensor
    if (found := model.calibration) is not None:
        paths = tuple(name for name in found.names if is_layer(name))
        checked_against(paths, parameters)
        return PadBenchKnowledge(model, paths)
    paths = checked_paths(pad, tuple(usual_parameters(pad) if parameters is None else parameters))
    return PadBenchKnowledge(model, paths)
