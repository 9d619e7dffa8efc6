"""Strips of few tactels and of many, brought up to date with frames whose loads nobody knows.

Frames are of the exact series.  A residual that is as rough as the contacts' own phase is told from
loads by its smoothness alone, the less so the fewer tactels there are.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

import fringeforce as ff
from calibration.short_strips import PIXELS, drifted, strip
from fringeforce.models.imaging import Calibration, Imaging
from reading.exact_frames import Bench, loads

pytestmark = pytest.mark.slow

FRAMES, READ = 12, 6
CHANCE = 1e-4
"""Of a false alarm, for each number of tactels and each side."""


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


@pytest.mark.parametrize(
    ("tactels", "length", "strips"),
    [(2, "8 mm", 6), (3, "9 mm", 6), (5, "11 mm", 4), (11, "25 mm", 2)],
)
def test_readings_of_updated_strips_err_as_they_say(tactels, length, strips) -> None:
    """Means of squared distances of the readings by one model scatter less than single ones."""
    bench, drift, total = strip(tactels, length), ff.Drift(), 0.0
    before = calibrated(bench)
    for number in range(strips):
        rng = np.random.default_rng([83, tactels, number])
        later = drifted(bench, rng, drift.shift, drift.light, drift.residual)
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
