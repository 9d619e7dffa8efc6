"""Strips of few tactels and of many, brought up to date with frames whose loads nobody knows.

Frames are of the exact series.  A residual that is as rough as the contacts' own phase is told from
loads by its smoothness alone, the less so the fewer tactels there are.
"""

import numpy as np
import pytest
from scipy.stats import chi2

import fringeforce as ff
from calibration.short_strips import calibrated, drifted, squared_distance, strip
from reading.exact_frames import loads

pytestmark = pytest.mark.slow

FRAMES, READ = 8, 6
CHANCE = 1e-4
"""Of a false alarm, for each number of tactels and each side."""


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
        total += squared_distance(found, later, rng, READ)
    freedom = 2 * tactels * strips
    assert chi2.ppf(CHANCE, freedom) < total < chi2.isf(CHANCE, freedom)


def test_a_residual_is_larger_and_rougher_than_stated() -> None:
    """Three times as large, down to a fourth as long: loads do not make up for it."""
    bench, drift, total, strips = strip(3, "9 mm"), ff.Drift(), 0.0, 8
    before = calibrated(bench)
    for number in range(strips):
        rng = np.random.default_rng([84, 3, number])
        later = drifted(bench, rng, drift.shift, drift.light, 3 * drift.residual)
        found = ff.update(before, later.frames(loads(rng, FRAMES, 3), rng))
        assert found.calibration is not None
        assert found.calibration.usable
        total += squared_distance(found, later, rng, READ)
    freedom = 2 * 3 * strips
    assert chi2.ppf(CHANCE, freedom) < total < chi2.isf(CHANCE, freedom)
