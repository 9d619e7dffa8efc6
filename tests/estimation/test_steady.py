"""Where levels are flat: information and the phase's own variance, made to agree."""

import numpy as np
import pytest

from fringeforce.estimation.gauss_newton import Place
from fringeforce.estimation.likelihood import Response
from fringeforce.estimation.running_mean import REMEMBERED, steady
from fringeforce.estimation.strip import Strip

P, SIGMA = 700, 3.0
RESPONSE = Response(240.0, 6.0, SIGMA**2)


def agreed(influence: np.ndarray, loads: np.ndarray) -> np.ndarray:
    """Covariance whose phase variance v enters E[sin^2 p] = (1 - exp(-2 v) cos 2p) / 2."""
    phase, variance = influence @ loads, np.full(len(influence), 0.1)
    inverse = np.zeros((len(loads), len(loads)))
    for _ in range(300):
        square = (1 - np.exp(-2 * variance) * np.cos(2 * phase)) / 2
        weight = square * (RESPONSE.amplitude / (2 * SIGMA)) ** 2
        inverse = np.linalg.inv((influence * weight[:, None]).T @ influence)
        variance = np.sqrt(variance * np.einsum("ki,ij,kj->k", influence, inverse, influence))
    return inverse


@pytest.mark.parametrize("size", [0.01, 0.05, 0.3, 1.0])
def test_the_matrix_and_the_variance_of_the_phase_agree(size: float) -> None:
    x = np.linspace(0, 1, P)[:, None]
    influence = 2 * np.exp(-(((x - np.linspace(0, 1, 5)) / 0.2) ** 2))
    loads = size * np.array([1.0, 0.6, 1.3, 0.9, 0.7])
    strip = Strip.of(influence, RESPONSE, np.ones(P, bool))
    place, variance = Place.at(strip, loads), np.zeros(strip.layout.places, np.float32)
    steady(strip.arrays, place.arrays, variance, np.zeros(REMEMBERED))
    exact = agreed(influence, loads)
    deviations, wanted = np.sqrt(np.diag(place.covariance)), np.sqrt(np.diag(exact))
    np.testing.assert_allclose(deviations, wanted, rtol=0.04)
    nodes = influence[:: strip.layout.every]
    spread = np.einsum("ki,ij,kj->k", nodes, exact, nodes)
    np.testing.assert_allclose(
        variance[strip.layout.order[:: strip.layout.every]], spread, rtol=0.06
    )
