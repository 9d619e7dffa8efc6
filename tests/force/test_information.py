"""Few products say what all pixels would."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.force.following import covariance_at
from fringeforce.force.information import EXACT, spacing, spread
from fringeforce.force.strip import Strip


@pytest.mark.parametrize("every", [2, 4])
def test_a_quintic_between_the_nodes_is_summed_exactly(every: int) -> None:
    rng = np.random.default_rng(every)
    nodes = 20
    values = np.zeros(nodes * every, dtype=np.float32)
    values[2 * every : (nodes - 3) * every] = rng.random((nodes - 5) * every)
    weight = np.empty(nodes, dtype=np.float32)
    spread(values, every, weight)
    quintic = np.polynomial.Polynomial(rng.normal(size=6))
    x = np.arange(len(values)) / len(values)
    assert weight @ quintic(x[::every]) == pytest.approx(values @ quintic(x), rel=1e-5, abs=1e-5)


@pytest.mark.parametrize(("pixels", "every"), [(2048, 4), (1024, 2), (256, 1)])
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
    found = covariance_at(Strip.of(influence, model.response, used), loads)
    np.testing.assert_allclose(np.diag(found), np.diag(exact), rtol=EXACT)
