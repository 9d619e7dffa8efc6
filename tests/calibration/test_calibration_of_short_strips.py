"""Strips of few tactels and of many, calibrated with known loads.

Frames are of the exact series.  A residual that is rougher than the drawing says, if it may not be,
is taken for other design values and another scale of the camera, the more so the shorter the strip.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

import fringeforce as ff
from calibration.short_strips import drifted, squared_distance, strip
from reading.exact_frames import Bench, loads

pytestmark = pytest.mark.slow

FRAMES, READ, LARGEST = 16, 6, 2.5
CHANCE = 1e-4
"""Of a false alarm, for each number of tactels, each side and each of the two statistics."""
LAYERS = {
    "transducer.photoelastic.strain_optic_coefficient": 0.03,
    "transducer.compliant.youngs_modulus": 0.03,
    "transducer.compliant.thickness": 0.01,
}
"""What the strip differs by from its drawing, in deviations of the values' logarithms."""


def built(drawn: Bench, rng: np.random.Generator) -> tuple[Bench, np.ndarray]:
    """A strip that differs from its drawing, and the logarithms of its values over the drawing's.

    Behind them its camera's shift [m] and the change of its scale, which is none.
    """
    off = np.array([std * rng.standard_normal() for std in LAYERS.values()])
    layers = drawn.sensor.transducer
    values = [
        layers.photoelastic.strain_optic_coefficient,
        layers.compliant.youngs_modulus,
        layers.compliant.thickness,
    ]
    made = dict(zip(LAYERS, (np.array(values) * np.exp(off)).tolist(), strict=True))
    bench = replace(drawn, sensor=drawn.sensor.replace(**made))
    found = drifted(bench, rng, 0.1e-3, 0.03, 0.1)
    return found, np.append(off, [found.shift, 0.0])


def presses(rng: np.random.Generator, tactels: int) -> np.ndarray:
    """Loads of about half the tactels in every frame [N]."""
    forces = loads(rng, FRAMES, tactels, LARGEST)
    forces[rng.random(forces.shape[:2]) < 0.5] = 0.0
    return forces


@pytest.mark.parametrize(
    ("tactels", "length", "strips"),
    [(2, "8 mm", 6), (3, "9 mm", 6), (5, "11 mm", 4), (11, "25 mm", 2)],
)
def test_values_and_readings_of_calibrated_strips_err_as_they_say(tactels, length, strips) -> None:
    """Means of squared distances of the readings by one model scatter less than single ones."""
    drawn, values, readings = strip(tactels, length), 0.0, 0.0
    names = (*LAYERS, "camera shift", "camera scale")
    for number in range(strips):
        rng = np.random.default_rng([84, tactels, number])
        bench, true = built(drawn, rng)
        forces = presses(rng, tactels)
        model = ff.calibrate(drawn.sensor, bench.frames(forces, rng), forces)
        found = model.calibration
        assert found is not None
        assert found.usable
        assert found.names == names
        value = np.append(np.log(found.values[:3] / found.drawing[:3]), found.values[3:] - [0, 1])
        off = (value - true) / (stds := np.sqrt(np.diag(found.covariance)))
        values += off @ np.linalg.solve(found.covariance / np.outer(stds, stds), off)
        readings += squared_distance(model, bench, rng, READ)
    for total, freedom in ((values, len(names) * strips), (readings, 2 * tactels * strips)):
        assert chi2.ppf(CHANCE, freedom) < total < chi2.isf(CHANCE, freedom)
