"""Bad pixels are found as often as they should be, and sound ones as seldom as is said."""

import numpy as np
import pytest
from scipy.stats import chi2, norm

from fringeforce.estimation.bad_pixels import BAD, OUTLIER, isolated, outlying, stuck_pixels
from fringeforce.estimation.likelihood import Response


def test_an_outlier_is_what_normal_noise_exceeds_by_the_stated_chance() -> None:
    assert 2 * norm.sf(OUTLIER) == pytest.approx(BAD)


@pytest.mark.parametrize("frames", [1, 20, 300])
def test_a_pixel_is_outlying_where_its_squares_exceed_chi_squares_quantile(frames: int) -> None:
    limit = np.sqrt(chi2.isf(BAD, frames) / frames)
    residuals = np.outer(np.resize([1.0, -1.0], frames), limit * np.array([0.0, 0.999, 1.001]))
    assert list(outlying(residuals)) == [False, False, True]
    assert not outlying(residuals, usual=1.1).any()


def test_single_spikes_are_isolated_and_the_densest_fringes_are_not() -> None:
    response = Response(200.0, 20.0, 4.0)
    phase = np.cumsum(np.linspace(0, 1.0, 600))
    noise = np.random.default_rng(0).normal(0, 2, 600)
    levels = response.level(phase) + noise
    assert not isolated(levels, response).any()
    flat = np.full(600, 20.0) + noise
    flat[[100, 400]] += [90.0, 200.0]
    assert list(np.flatnonzero(isolated(flat, response))) == [100, 400]


def test_a_pixel_is_stuck_where_it_has_less_noise_than_its_camera() -> None:
    levels = np.random.default_rng(0).normal(50, 2, (40, 30))
    levels[:, 7] = 50
    assert list(np.flatnonzero(stuck_pixels(levels, 2.0))) == [7]
    assert not stuck_pixels(levels, 0.3).any()
