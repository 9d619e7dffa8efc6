"""Pads whose lamp is so bright that the converter clips it, within what the drawing allows for."""

import numpy as np
import pytest
from scipy.stats import chi2 as chi_square

import fringeforce as ff
from fringeforce.design.pad import Pad

SMALL = {"tactels.count": [5, 4], "tactels.pitch": "3 mm", "camera.pixels": [96, 80]}
FRAMES = 6


@pytest.fixture(scope="module")
def pad() -> Pad:
    return ff.load_sensor("pad").replace(**SMALL)


def test_clipped_light_within_a_tolerance_of_the_lamp_is_read(pad: Pad) -> None:
    """The lamp is two deviations brighter than drawn."""
    bright = ff.characterize(pad.replace(**{"camera.amplitude": 264.0, "camera.clipped": True}))
    model = ff.characterize(pad.replace(**{"camera.amplitude": "240 +/- 5 %"}))
    reader, rng, total = ff.Reader(model), np.random.default_rng(3), 0.0
    for _ in range(FRAMES):
        forces = np.zeros((20, 3))
        pressed = rng.choice(20, 3, replace=False)
        forces[pressed, 0] = rng.uniform(3.0, 6.0, 3)
        forces[pressed, 1:] = 0.3 * forces[pressed, :1] * rng.uniform(-1, 1, (3, 2))
        frame = bright.expose(forces, rng)
        assert (frame == 255).sum() > 30
        reading = reader.search(frame)
        assert reading.status is ff.Status.OK
        error = (reading.forces - forces).ravel()
        total += error @ np.linalg.solve(reading.covariance, error)
    low, high = chi_square.ppf([1e-4, 1 - 1e-4], FRAMES * 60)
    # a lamp that is as bright in all frames is one error, of at most two deviations in each
    assert low < total < high + 4 * FRAMES
