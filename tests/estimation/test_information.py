"""Few products say what all pixels would."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.estimation.following import covariance_at
from fringeforce.estimation.information import EXACT, spacing
from fringeforce.estimation.strip import Strip
from fringeforce.estimation.vector_loops import gather


@pytest.mark.parametrize(("pixels", "every"), [(2048, 8), (1024, 4), (256, 1)])
@pytest.mark.parametrize("size", [0.5, 16.0])
def test_deviations_are_those_of_all_pixels_whatever_the_fringes_and_dead_ones(
    sensor: ff.Sensor, pixels: int, every: int, size: float
) -> None:
    model = ff.characterize(sensor.replace(**{"camera.pixels": pixels}))
    influence = model.pixel_influence.reshape(pixels, -1)
    rng = np.random.default_rng(pixels)
    used = rng.random(pixels) > 0.02
    assert spacing(influence, used) == every
    loads = ff.polar(size, 10, 11).ravel()
    slope = model.response.slope(influence @ loads) * used
    slope /= np.sqrt(model.response.variance)
    exact = np.linalg.inv((influence.T * slope**2) @ influence)
    strip = Strip.of(influence, model.response, used)
    nodes, weight = strip.nodes[:22].astype(float), np.empty(strip.layout.places, np.float32)
    gather(strip.layout.lay(slope**2), strip.shares, weight)
    shared = np.linalg.inv((nodes * weight) @ nodes.T)
    np.testing.assert_allclose(np.diag(shared), np.diag(exact), rtol=EXACT)
    found = covariance_at(strip, loads)
    np.testing.assert_allclose(np.diag(found), np.diag(exact), rtol=EXACT)
