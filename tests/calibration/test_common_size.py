"""The common size of unknowns against SciPy's density of their data, maximised directly."""

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from scipy.stats import norm

from fringeforce.calibration.common_size import LOST, likeliest_size


def estimated(data: np.ndarray, noise: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Squares of the estimates under a size, over its own, and what data tell of each."""
    share = size**2 / (size**2 + noise)
    return np.square(share * data / size), share


@pytest.mark.parametrize("size", [0.3, 1.0, 4.0])
def test_a_size_is_the_likeliest_of_the_data(size: float) -> None:
    rng = np.random.default_rng(int(10 * size))
    noise = rng.uniform(0.02, 2.0, 80)
    data = rng.normal(0, np.sqrt(size**2 + noise))
    best = minimize_scalar(
        lambda s: -norm.logpdf(data, scale=np.sqrt(s**2 + noise)).sum(),
        bounds=(0.01, 20.0),
        options={"xatol": 1e-6},
    ).x
    # in one go from above, and step by step from below
    assert 10 * likeliest_size(*estimated(data, noise, 10.0)) == pytest.approx(best, rel=2e-3)
    found = 0.1
    for _ in range(60):
        found *= likeliest_size(*estimated(data, noise, found))
    assert found == pytest.approx(best, rel=2e-3)


def test_what_does_not_scatter_is_hidden_by_noise_at_once() -> None:
    rng = np.random.default_rng(1)
    noise = rng.uniform(0.5, 2.0, 60)
    data = 0.7 * rng.normal(0, np.sqrt(noise))  # less than the noise alone
    found = 3.0 * likeliest_size(*estimated(data, noise, 3.0))
    shares = estimated(data, noise, found)[1]
    assert shares.mean() == pytest.approx(LOST / 2, rel=1e-2)
    # and stays as it is
    assert likeliest_size(*estimated(data, noise, found)) == pytest.approx(1, abs=1e-2)


def test_a_size_of_what_nothing_tells_stays() -> None:
    assert likeliest_size(np.zeros(5), np.zeros(5)) == 1.0
    assert likeliest_size(np.zeros(0), np.zeros(0)) == 1.0
