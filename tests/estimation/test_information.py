"""Few products say what all pixels would."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.estimation.following import covariance_at
from fringeforce.estimation.information import EXACT, spacing
from fringeforce.estimation.strip import Strip
from fringeforce.estimation.vector_loops import gather

MASKS = 10
UNIT = 2.0**-24
"""Unit roundoff of single precision."""


@pytest.mark.parametrize(("pixels", "every"), [(2048, 8), (1024, 4), (256, 1)])
@pytest.mark.parametrize("size", [0.5, 16.0])
def test_deviations_are_those_of_all_pixels_whatever_the_fringes_and_dead_ones(
    sensor: ff.Sensor, pixels: int, every: int, size: float
) -> None:
    model = ff.characterize(sensor.replace(**{"camera.pixels": pixels}))
    influence = model.pixel_influence.reshape(pixels, -1)
    loads = ff.polar(size, 10, 11).ravel()
    whole = model.response.slope(influence @ loads) / np.sqrt(model.response.variance)
    rng = np.random.default_rng(pixels)
    for used in rng.random((MASKS, pixels)) > 0.02:
        assert spacing(influence, used) == every
        slope = whole * used
        information = (influence.T * slope**2) @ influence
        exact = np.diag(np.linalg.inv(information))
        strip = Strip.of(influence, model.response, used)
        nodes, weight = strip.nodes[:22].astype(float), np.empty(strip.layout.places, np.float32)
        gather(strip.layout.lay(slope**2), strip.shares, weight)
        shared = np.diag(np.linalg.inv((nodes * weight) @ nodes.T))
        # what the nodes leave out
        np.testing.assert_allclose(shared, exact, rtol=EXACT)
        # what single precision adds, with or without fused products: an inverse is sure to the
        # unit roundoff times the condition number of the matrix with a unit diagonal (Higham,
        # Accuracy and Stability of Numerical Algorithms, 2nd ed., section 10.1; Demmel 1989)
        unit = 1 / np.sqrt(np.diag(information))
        sure = UNIT * np.linalg.cond(information * np.outer(unit, unit))
        np.testing.assert_allclose(np.diag(covariance_at(strip, loads)), shared, rtol=sure)
