"""Unknowns of a strip's design: what each value with a tolerance changes of influence and light."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np
from numpy.polynomial.chebyshev import cheb2poly, chebvander
from numpy.typing import NDArray

from fringeforce.base.arrays import Array
from fringeforce.design.light import CHANNELS, CROSSTALK
from fringeforce.design.strip import Sensor
from fringeforce.design.tolerances import REACH, number_at, with_values
from fringeforce.models.as_built import (
    LIGHT_LENGTH,
    PLACEMENT,
    RESIDUAL,
    WIDTH,
    changes_influence,
)
from fringeforce.models.creep import TERMS, Creep
from fringeforce.models.line_moments import REGISTRATION, LineMoments
from fringeforce.models.strip import COVER_MODULUS, SensorModel
from fringeforce.models.strip_nodes import random_field
from fringeforce.models.temperature import COEFFICIENT, REFERENCE

DEGREES = 4, 8, 16
"""Degrees of the polynomials that the influence matrix is followed by, of which the least that is
enough is taken: a camera that is shifted by a contact's width takes the last."""
LEFT_OUT = 5e-4
"""Share of a load's largest influence that they may leave out within `REACH` deviations: less than
a pixel's noise in the phase of all loads."""
RELAXATION = f"{TERMS[0]}."
RELAXING = tuple(f"{path}." for path in TERMS)
"""Begin of the paths of values that act over time, which `reading.creep` allows for."""
THERMAL = COEFFICIENT, REFERENCE
"""Paths of what temperature does to the light, which readings are scaled for."""
RATIO = "relaxation of one layer"
"""Name of the mode of layers that relax unlike."""
DRIFTS = ("camera.drift", "offset drift", RATIO)
"""Names of the modes that are new in every frame."""


@dataclass(frozen=True, eq=False)
class Mode:
    """One standardised unknown that changes influence matrix or light.

    Attributes
    ----------
    name : str
        Dotted path of the design, or what it is.
    std : float
        Its standard deviation, in the unit of the value.
    influence : tuple of ndarray, shape (s, n, 2)
        Change of the influence matrix along the strip with each power of the unknown, beside that
        it moves the contacts [rad/N].
    brightness, darkness : ndarray, shape (m,) or (C, 1), or float
        Change of the amplitude, relative to it, and of the offset, grey levels; along the strip or
        of each channel.
    """

    name: str
    std: float
    influence: tuple[Array, ...] = ()
    brightness: Array | float = 0.0
    darkness: Array | float = 0.0


@dataclass(frozen=True, eq=False)
class BuiltInfluence:
    """Influence matrix of sensors whose values are not as drawn.

    Attributes
    ----------
    model : SensorModel
        As drawn or calibrated.
    x : ndarray, shape (s,)
        Places along the strip where the drawing's camera looks [m].
    residual : ndarray, shape (k, m), or None
        As of `uncertainty`.
    """

    model: SensorModel
    x: Array
    residual: Array | None = None
    _solved: dict[tuple[str, float], SensorModel] = field(default_factory=dict)

    def built(self, values: Mapping[str, float]) -> SensorModel:
        """The model with other values of the design, by path; those of single ones are kept."""
        key = next(iter(values.items()))
        if len(values) == 1 and key in self._solved:
            return self._solved[key]
        design = with_values(self._plain, values)
        drawn = design == self._plain and not self.calibrated
        model = self.model if drawn else self.model.of(design)
        if len(values) == 1:
            self._solved[key] = model
        return model

    @property
    def calibrated(self) -> bool:
        """Whether the model is of one sensor that was measured, and not as drawn."""
        return self.model.calibration is not None or self.model.imaging is not None

    @cached_property
    def _plain(self) -> Sensor:
        sensor = self.model.sensor
        return sensor.replace(tolerances=dict.fromkeys(sensor.tolerances, 0.0))

    def off(self, off: Mapping[str, float]) -> tuple[SensorModel, Array]:
        """The model whose values are so many deviations off, and where its camera looks, (s,)."""
        sensor, places, values = self.model.sensor, self.x, dict[str, float]()
        for path, e in off.items():
            if path in REGISTRATION:
                places = places + e * self.step(path)
            elif (found := number_at(sensor, path)) is not None:
                values[path] = found[0] + e * sensor.tolerances[path]
        return self.built(values) if values else self.model, places

    def __call__(self, off: Mapping[str, float]) -> Array:
        """Influence matrix of these, shape (s, n, 2) [rad/N]."""
        model, places = self.off(off)
        return self.seen(model, places)

    def seen(self, model: SensorModel, places: Array) -> Array:
        """Influence matrix of a model at places on the strip, shape (s, n, 2) [rad/N]."""
        half = self.model.sensor.transducer.length / 2
        return model.influence(np.clip(places, -half, half))

    def step(self, path: str) -> Array:
        """How far a deviation of the camera's shift or scale moves what it sees, shape (s,) [m]."""
        std = self.model.sensor.tolerances[path]
        return std * (self.x if path == "camera.scale" else np.ones_like(self.x))


def design_modes(
    matrix: BuiltInfluence,
    built: SensorModel,
    centre: Mapping[str, float],
    nodes: int,
    lines: LineMoments,
) -> list[Mode]:
    """Unknowns of the values of the drawing, in the order of their paths.

    The camera looks from the centre's place, and what it sees is the centre's strip where it looks
    elsewhere; of single values of the strip all others are as drawn.
    """

    def beside(path: str, whole: Callable[[float], Array]) -> Callable[[float], Array]:
        """Influence matrix of a value without what it changes by moving contacts."""
        return lambda e: whole(e) - lines.moved(path, e - centre.get(path, 0.0))

    sensor, x, modes = matrix.model.sensor, matrix.x, []
    half = sensor.transducer.length / 2
    taken = {PLACEMENT, WIDTH, RESIDUAL, "polariscope.visibility", "camera.blur", "camera.gamma"}
    elsewhere = (*RELAXING, *THERMAL, CROSSTALK)
    channels = sensor.polariscope.pictures
    looking = {path: e for path, e in centre.items() if path in REGISTRATION}

    for path, std in sensor.tolerances.items():
        if path.startswith(CHANNELS):
            modes += _channel_modes(sensor, path, std)
            continue
        found = number_at(sensor, path)
        if path in taken or found is None or path.startswith(elsewhere):
            continue
        value = found[0]
        if path == "camera.amplitude":
            shown = np.array([[one.amplitude is None] for one in channels])
            modes.append(Mode(path, std, brightness=shown * (std / value)))
        elif path == "camera.offset":
            shown = np.array([[one.offset is None] for one in channels])
            modes.append(Mode(path, std, darkness=shown * std))
        elif path in REGISTRATION:
            on = np.abs(x) + REACH * np.abs(matrix.step(path)) <= half
            one = beside(path, partial(_looking, matrix, built, looking, path))
            modes.append(Mode(path, std, _powers_of(one, on)))
        elif changes_influence([path]):
            one = beside(path, partial(_one, matrix, looking, path))
            modes.append(Mode(path, std, _powers_of(one)))
    last = float(Creep.of_ratio(sensor.transducer).amounts.sum())
    if last:  # loads of any age: the ratio is anywhere between those of first and last
        value = sensor.transducer.compliant.youngs_modulus
        spread, places = value * abs(last) / np.sqrt(3), matrix.off(looking)[1]

        def relaxed(e: float) -> Array:
            return matrix.seen(matrix.built({COVER_MODULUS: value + e * spread}), places)

        modes.append(Mode(RATIO, spread, _powers_of(relaxed, reach=np.sqrt(3))))
    uneven = sensor.camera.unevenness
    if uneven:
        for row in uneven * random_field(x, sensor.transducer.length * LIGHT_LENGTH, nodes):
            modes.append(Mode("camera.unevenness", uneven, brightness=row))
    return modes


def _channel_modes(sensor: Sensor, path: str, std: float) -> list[Mode]:
    """Unknowns of the light of one channel, of which other values are taken as they are."""
    *_, number, name = path.split(".")
    own = np.eye(len(sensor.polariscope.pictures))[:, [int(number)]]
    if name == "amplitude":
        return [Mode(path, std, brightness=own * (std / sensor.light[0][int(number)]))]
    return [Mode(path, std, darkness=own * std)] if name == "offset" else []


def _looking(
    matrix: BuiltInfluence, built: SensorModel, others: Mapping[str, float], path: str, e: float
) -> Array:
    """Influence matrix of a strip where the camera looks so many deviations elsewhere."""
    return matrix.seen(built, matrix.off({**others, path: e})[1])


def _one(matrix: BuiltInfluence, others: Mapping[str, float], path: str, e: float) -> Array:
    """Influence matrix where one value is so many deviations off, beside others."""
    return matrix({**others, path: e})


def _powers_of(
    influence: Callable[[float], Array],
    on: NDArray[np.bool_] | slice = slice(None),
    reach: float = REACH,
) -> tuple[Array, ...]:
    """Changes of the influence matrix with the powers of an unknown.

    Of the polynomial through the zeros of the slope of a Chebyshev polynomial, whose series falls
    off geometrically (Trefethen, Approximation Theory and Approximation Practice, chapter 8), what
    is below `LEFT_OUT` is cut off.

    Parameters
    ----------
    influence : callable
        The matrix, shape (s, n, 2), for a value of the unknown.
    on : ndarray of bool, shape (s,), optional
        Where polynomials are to follow; everywhere if not given.
    reach : float
        Largest value that is likely.
    """
    found: dict[float, Array] = {0.0: influence(0.0)}
    largest = np.maximum(np.abs(found[0.0]).max(axis=0), np.finfo(float).tiny)
    for degree in DEGREES:
        at = [float(t) for t in np.round(np.cos(np.pi * np.arange(degree + 1) / degree), 12)]
        for t in at:
            if t not in found:
                found[t] = influence(reach * t)
        values = np.array([found[t] for t in at])
        series = np.tensordot(np.linalg.inv(chebvander(at, degree)), values, axes=1)
        sizes = (np.abs(series[:, on]).max(axis=1) / largest).max(axis=(1, 2))
        beyond = np.append(np.cumsum(sizes[::-1])[::-1], 0.0)[1:]
        count = max(int(np.argmax(beyond < LEFT_OUT)), 1)
        if count < degree - 1:  # what is left out was seen
            break
    powers = np.zeros((count, count + 1))
    for k in range(count + 1):
        own = cheb2poly(np.eye(count + 1)[k])[1:]
        powers[: len(own), k] = own
    powers /= reach ** np.arange(1, count + 1)[:, None]
    return tuple(np.tensordot(powers, series[: count + 1], axes=1))


def drift_modes(model: SensorModel) -> list[Mode]:
    """Light that changes from frame to frame."""
    imaging, camera = model.imaging, model.sensor.camera
    gain, offset = (camera.drift, 0.0) if imaging is None else imaging.drift
    modes = [Mode(DRIFTS[0], gain, brightness=gain)] if gain else []
    return modes + ([Mode(DRIFTS[1], offset, darkness=offset)] if offset else [])
