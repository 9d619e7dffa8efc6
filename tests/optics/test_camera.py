"""The line camera: rounding, clipping, and noise of the statistics that it states."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import chisquare, norm

import fringeforce as ff
from fringeforce.design.strip import Camera
from fringeforce.optics.camera import expose, grey_levels, noise_variance

PIXELS = 200_000


def _camera(**changes: Any) -> Camera:
    values = {"pixels": PIXELS, "bits": 8, "amplitude": 245.0, "offset": 5.0, "noise": 5.0}
    return Camera.model_validate(values | changes)


def test_grey_levels_are_the_papers_line() -> None:
    np.testing.assert_allclose(grey_levels(_camera(), [0, 0.5, 1]), [5, 127.5, 250])


def test_without_noise_a_level_is_rounded_to_the_nearest() -> None:
    camera = _camera(amplitude=100.0, offset=0.0, noise=0.0)
    assert expose(camera, [0, 0.104, 0.106, 0.997, 1]).tolist() == [0, 10, 11, 100, 100]


def test_noise_beyond_the_converter_is_clipped_and_does_not_wrap() -> None:
    camera = _camera(amplitude=250.0, noise=40.0, noise_model="gaussian")
    dark, bright = expose(camera, np.zeros(PIXELS), 1), expose(camera, np.ones(PIXELS), 1)
    assert dark.min() == 0
    assert bright.max() == 255
    clipped = norm.cdf((0.5 - 5) / 40), norm.sf((254.5 - 255) / 40)
    assert (dark == 0).mean() == pytest.approx(clipped[0], abs=0.01)
    assert (bright == 255).mean() == pytest.approx(clipped[1], abs=0.01)
    assert dark.mean() < 60 < 200 < bright.mean()


@pytest.mark.parametrize("bits", range(1, 17))
def test_every_depth_of_converter_is_used_to_its_ends(bits: int) -> None:
    full = 2**bits - 1
    camera = _camera(bits=bits, amplitude=float(full), offset=0.0, noise=0.0)
    frame = expose(camera, np.linspace(0, 1, 2 * full + 1))
    assert frame.dtype == (np.uint8 if bits <= 8 else np.uint16)
    assert np.unique(frame).tolist() == list(range(full + 1))


def test_a_seed_repeats_a_frame_and_a_generator_goes_on() -> None:
    camera, light = _camera(), np.full(1000, 0.5)
    np.testing.assert_array_equal(expose(camera, light, 7), expose(camera, light, 7))
    generator = np.random.default_rng(7)
    first, second = expose(camera, light, generator), expose(camera, light, generator)
    np.testing.assert_array_equal(first, expose(camera, light, 7))
    assert (first != second).any()
    assert (expose(camera, light) != expose(camera, light)).any()


@pytest.mark.parametrize("model", ["uniform", "gaussian"])
def test_each_grey_level_comes_as_often_as_the_noise_says(model: str) -> None:
    camera = _camera(noise_model=model)
    frame = expose(camera, np.full(PIXELS, 95 / 245), rng=2).astype(int) - 100
    if model == "uniform":  # 5 grey levels either side; the outermost catch half a level each
        levels, share = np.arange(-5, 6), np.array([0.5, *[1] * 9, 0.5]) / 10
    else:
        levels = np.arange(-12, 13)
        share = norm.cdf((levels + 0.5) / 5) - norm.cdf((levels - 0.5) / 5)
        frame = frame[np.abs(frame) <= 12]
    counts = np.array([(frame == level).sum() for level in levels])
    assert counts.sum() == len(frame)
    assert chisquare(counts, share / share.sum() * len(frame)).pvalue > 1e-3


@pytest.mark.parametrize(
    ("model", "noise", "variance"),
    [
        ("uniform", 5.0, 25 / 3 + 1 / 12),
        ("uniform", 0.0, 1 / 12),
        ("gaussian", 3.0, 9 + 1 / 12),
    ],
)
def test_noise_and_rounding_add_up_to_the_stated_variance(
    model: str, noise: float, variance: float
) -> None:
    camera = _camera(noise=noise, noise_model=model, offset=20.0, amplitude=200.0)
    light = np.linspace(0, 1, PIXELS)
    error = expose(camera, light, rng=3) - (200 * light + 20)
    deviation = np.std(error**2) / np.sqrt(PIXELS)
    assert np.mean(error**2) == pytest.approx(variance, abs=4 * deviation + 1e-3)
    assert np.mean(error) == pytest.approx(0, abs=4 * np.sqrt(variance / PIXELS))
    assert noise_variance(camera) == pytest.approx(variance)


def test_a_batch_has_independent_noise_in_every_frame() -> None:
    camera = _camera()
    frames = expose(camera, np.full((2, 3, 5000), 0.5), rng=4)
    assert frames.shape == (2, 3, 5000)
    correlation = np.corrcoef(frames.reshape(6, -1).astype(float))
    np.testing.assert_allclose(correlation, np.eye(6), atol=4.5 / np.sqrt(5000))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_light_that_is_not_finite_is_refused(bad: float) -> None:
    with pytest.raises(ff.FringeforceError, match="not finite"):
        expose(_camera(), [0.5, bad])
