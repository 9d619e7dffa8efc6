"""Few products say what all pixels would."""

import numpy as np
import pytest
from scipy.linalg import eigh

import fringeforce as ff
from fringeforce.estimation.following import covariance_at
from fringeforce.estimation.gauss_newton import Place
from fringeforce.estimation.information import EXACT, even_units, spacing
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
    np.testing.assert_allclose(np.diag(shared), np.diag(exact), rtol=2e-3)
    found = covariance_at(strip, loads)
    np.testing.assert_allclose(np.diag(found), np.diag(exact), rtol=2e-3)
    values = eigh(found, exact, eigvals_only=True)
    np.testing.assert_allclose(values, 1, atol=2 * EXACT)


DESIGNS = {
    "few pixels for many tactels": (512, 23, 0.5e-3, 0.5e-3),
    "a thick cover": (2048, 11, 1e-3, 2e-3),
    "many tactels": (1500, 32, 0.6e-3, 0.3e-3),
    "as shipped": (2048, 11, 1e-3, 0.5e-3),
}


@pytest.mark.parametrize("name", DESIGNS)
def test_covariances_in_single_precision_are_exact_in_every_direction(
    sensor: ff.Sensor, name: str
) -> None:
    """Against the sum over all pixels in double precision; conditions up to 1e8."""
    pixels, count, pitch, cover = DESIGNS[name]
    model = ff.characterize(
        sensor.replace(
            **{
                "camera.pixels": pixels,
                "tactels.count": count,
                "tactels.pitch": pitch,
                "transducer.compliant.thickness": cover,
            }
        )
    )
    influence, used = model.frame_influence, np.ones(pixels, dtype=bool)
    strip, rng = Strip.of(influence, model.response, used), np.random.default_rng(pixels)
    for largest in (0.5, 2.0, 4.0):
        size, angle = largest * rng.random(count), rng.uniform(-20, 20, count)
        loads = ff.polar(size, angle).ravel()
        slope = model.response.slope(influence @ loads) / np.sqrt(model.response.variance)
        exact = np.linalg.inv((influence.T * slope**2) @ influence)
        for found in (covariance_at(strip, loads), Place.at(strip, loads).covariance):
            np.testing.assert_allclose(eigh(found, exact, eigvals_only=True), 1, atol=0.05)


def test_units_are_newtons_where_single_precision_loses_nothing_in_them() -> None:
    x = np.linspace(0, 1, 400)[:, None]
    apart = np.exp(-(((x - np.array([0.2, 0.5, 0.8])) / 0.2) ** 2))
    close = np.exp(-(((x - np.array([0.49, 0.5, 0.51])) / 0.2) ** 2))
    used = np.ones(400, dtype=bool)
    np.testing.assert_array_equal(even_units(apart, used), np.eye(3))
    units = even_units(close, used)
    np.testing.assert_allclose(units @ units.T, close.T @ close, rtol=1e-9)
