"""Strips of few tactels and of many, whose residual is as rough as somebody says."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import fringeforce as ff
from fringeforce.models.imaging import Calibration, Imaging
from fringeforce.models.strip import SensorModel
from reading.exact_frames import Bench, drawing, loads

Array = NDArray[np.float64]

PIXELS = 256
LONGEST, SHORTEST = 5e-3, 1.25e-3
"""Correlation lengths of the residual that comes on top: that of the drawing, and a fourth [m]."""


def strip(tactels: int, length: str) -> Bench:
    sensor = drawing(
        **{
            "transducer.length": length,
            "tactels.count": tactels,
            "tactels.contact_width": "0.2 mm",
            "camera.pixels": PIXELS,
            "camera.amplitude": 200.0,
            "camera.offset": 15.0,
            "camera.noise": 3.0,
        }
    )
    none = np.zeros(PIXELS)
    return Bench(sensor, sensor.tactels.positions, np.full(tactels, 0.2e-3), 0.0, none, none + 1)


def kept(bench: Bench) -> Bench:
    """The same with an influence that is computed once."""
    influence = bench.influence()
    bench.influence = lambda: influence  # type: ignore[method-assign]
    return bench


def smooth(places: Array, length: float, rng: np.random.Generator) -> Array:
    """A Gaussian process of unit variance and this correlation length, from its covariance."""
    covariance = np.exp(-np.square(np.subtract.outer(places, places) / length) / 2)
    root = np.linalg.cholesky(covariance + 1e-8 * np.eye(len(places)))
    return np.asarray(root @ rng.standard_normal(len(places)))


def drifted(
    bench: Bench, rng: np.random.Generator, shift: float, light: float, residual: float
) -> Bench:
    """The strip with another place of its camera [m], light and residual [rad], by deviations.

    The residual has a correlation length of its own.
    """
    places = bench.sensor.pixel_positions
    length = LONGEST * (SHORTEST / LONGEST) ** rng.random()
    uneven = smooth(places, 0.3 * bench.sensor.transducer.length, rng)
    gain = (1 + light * rng.standard_normal()) * (1 + light * uneven)
    return kept(
        replace(
            bench,
            shift=shift * rng.standard_normal(),
            residual=residual * smooth(places, length, rng),
            gain=gain,
        )
    )


def calibrated(bench: Bench) -> SensorModel:
    """A model of which nothing is uncertain but what drifts."""
    camera, places = bench.sensor.camera, bench.sensor.pixel_positions
    light = camera.amplitude * bench.gain, np.full(PIXELS, camera.offset)
    names, values = ("camera shift", "camera scale"), np.array([0.0, 1.0])
    return replace(
        ff.characterize(bench.sensor),
        imaging=replace(
            Imaging.known(places, *light),
            influence_modes=np.zeros((0, PIXELS, bench.sensor.tactels.count, 2)),
            residual=bench.residual,
        ),
        calibration=Calibration(
            names, values, values, np.zeros((2, 2)), (), (), (), 1.0, (), modes=np.zeros((2, 0))
        ),
    )


def squared_distance(
    model: SensorModel, bench: Bench, rng: np.random.Generator, read: int
) -> float:
    """Mean squared distance of readings by a model to forces that act on a bench, by frames.

    Of one model the readings' errors go together, so that means scatter less than single ones.
    """
    count = model.sensor.tactels.total
    reader, forces, squares = ff.Reader(model), loads(rng, read, count), list[float]()
    for frame, acted in zip(bench.frames(forces, rng), forces, strict=True):
        reading = reader.search(frame)
        if reading.ok:
            off = (reading.forces - acted).ravel()
            squares.append(float(off @ np.linalg.solve(reading.covariance, off)))
    assert len(squares) > read / 2
    return float(np.mean(squares))
