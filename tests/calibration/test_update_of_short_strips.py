"""Strips of few tactels and of many, brought up to date with frames whose loads nobody knows.

Frames are of the exact series.  A residual that is as rough as the contacts' own phase is told from
loads by its smoothness alone, the less so the fewer tactels there are.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

import fringeforce as ff
from fringeforce.models.imaging import Calibration, Imaging
from reading.exact_frames import Bench, drawing, loads

Array = NDArray[np.float64]
pytestmark = pytest.mark.slow

PIXELS, FRAMES, READ = 256, 12, 6
LONGEST, SHORTEST = 5e-3, 1.25e-3
"""Correlation lengths of the residual that comes on top: that of the drawing, and a fourth [m]."""
CHANCE = 1e-4
"""Of a false alarm, for each number of tactels and each side."""


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


def calibrated(bench: Bench) -> ff.SensorModel:
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


def smooth(places: Array, length: float, rng: np.random.Generator) -> Array:
    """A Gaussian process of unit variance and this correlation length, from its covariance."""
    covariance = np.exp(-np.square(np.subtract.outer(places, places) / length) / 2)
    root = np.linalg.cholesky(covariance + 1e-8 * np.eye(len(places)))
    return np.asarray(root @ rng.standard_normal(len(places)))


def drifted(bench: Bench, rng: np.random.Generator) -> Bench:
    """The strip some weeks on, by as much as `ff.Drift` says."""
    drift, places = ff.Drift(), bench.sensor.pixel_positions
    length = LONGEST * (SHORTEST / LONGEST) ** rng.random()
    uneven = smooth(places, 0.3 * bench.sensor.transducer.length, rng)
    light = (1 + drift.light * rng.standard_normal()) * (1 + drift.light * uneven)
    return kept(
        replace(
            bench,
            shift=drift.shift * rng.standard_normal(),
            residual=drift.residual * smooth(places, length, rng),
            gain=light,
        )
    )


@pytest.mark.parametrize(
    ("tactels", "length", "strips"),
    [(2, "8 mm", 6), (3, "9 mm", 6), (5, "11 mm", 4), (11, "25 mm", 2)],
)
def test_readings_of_updated_strips_err_as_they_say(tactels, length, strips) -> None:
    """Means of squared distances of the readings by one model scatter less than single ones."""
    bench, total = strip(tactels, length), 0.0
    before = calibrated(bench)
    for number in range(strips):
        rng = np.random.default_rng([83, tactels, number])
        later = drifted(bench, rng)
        found = ff.update(before, later.frames(loads(rng, FRAMES, tactels), rng))
        assert found.calibration is not None
        assert found.calibration.usable
        reader, forces, squares = ff.Reader(found), loads(rng, READ, tactels), []
        for frame, true in zip(later.frames(forces, rng), forces, strict=True):
            reading = reader.search(frame)
            if reading.ok:
                off = (reading.forces - true).ravel()
                squares.append(off @ np.linalg.solve(reading.covariance, off))
        assert len(squares) > READ / 2
        total += float(np.mean(squares))
    freedom = 2 * tactels * strips
    assert chi2.ppf(CHANCE, freedom) < total < chi2.isf(CHANCE, freedom)
