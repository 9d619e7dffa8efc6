"""Where levels are flat: the matrix and the phase's own variance agree, as SciPy finds them to."""

import numpy as np
import pytest
from uncertain_phase import agreed

from fringeforce.estimation.gauss_newton import Place
from fringeforce.estimation.likelihood import Response
from fringeforce.estimation.running_mean import MEAN, update_running_mean
from fringeforce.estimation.strip import Strip

P, SIGMA = 700, 3.0
RESPONSE = Response(240.0, 6.0, SIGMA**2)


def begun(influence: np.ndarray, loads: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Covariance of the loads; variance of the phase at every so many pixels; how many."""
    strip = Strip.of(influence, RESPONSE, np.ones(P, bool))
    place, variance = Place.at(strip, loads), np.zeros(strip.layout.places, np.float32)
    update_running_mean(strip.arrays, place, variance, np.zeros(1, MEAN)[0])
    every = strip.layout.every
    return place.covariance, variance[strip.layout.order[::every]], every


@pytest.mark.parametrize("size", [0.01, 0.05, 0.3, 1.0])
def test_the_matrix_and_the_variance_of_the_phase_agree(size: float) -> None:
    x = np.linspace(0, 1, P)[:, None]
    influence = 2 * np.exp(-(((x - np.linspace(0, 1, 5)) / 0.2) ** 2))
    loads = size * np.array([1.0, 0.6, 1.3, 0.9, 0.7])
    covariance, variance, every = begun(influence, loads)
    exact = agreed(influence, loads, RESPONSE)
    deviations, wanted = np.sqrt(np.diag(covariance)), np.sqrt(np.diag(exact))
    np.testing.assert_allclose(deviations, wanted, rtol=0.02)
    nodes = influence[::every]
    spread = np.einsum("ki,ij,kj->k", nodes, exact, nodes)
    np.testing.assert_allclose(variance, spread, rtol=0.06)


def test_in_the_dark_the_curvature_of_the_level_bounds_the_phase() -> None:
    """All pixels see one phase p = 0: v A^2 (1 - exp(-2 v)) / 8 = sigma^2 / P, v small."""
    influence = np.ones((P, 1))
    covariance, variance, _ = begun(influence, np.zeros(1))
    closed = 2 * SIGMA / (RESPONSE.amplitude * np.sqrt(P))
    assert covariance[0, 0] == pytest.approx(closed, rel=0.02)
    np.testing.assert_allclose(variance, closed, rtol=0.02)
    # the likeliest phase of frames of noise: A p^2 / 4 is their mean where that is positive
    means = np.random.default_rng(0).normal(0, SIGMA / np.sqrt(P), 100_000)
    scatter = np.mean(4 / RESPONSE.amplitude * np.maximum(means, 0))
    assert 0.7 * covariance[0, 0] < scatter < covariance[0, 0]
