"""Weights of explanations, and the mixture of several, against drawn samples."""

import numpy as np
import pytest

from fringeforce.estimation.covariance import marginal_information
from fringeforce.estimation.hypotheses import MetPhases, mixture, posterior_weights


def test_weights_are_ratios_of_masses() -> None:
    weights = posterior_weights(np.log([3.0, 1.0]) - 5000.0)
    np.testing.assert_allclose(weights, [0.75, 0.25])


def test_a_mixture_has_the_moments_of_its_samples() -> None:
    rng, weights = np.random.default_rng(), np.array([0.7, 0.3])
    means = np.array([[1.0, 2.0], [3.0, -1.0]])
    covariances = np.array([[[1.0, 0.3], [0.3, 0.5]], [[0.2, 0.0], [0.0, 2.0]]])
    mean, covariance = mixture(weights, means, covariances)
    count = 400_000
    parts = [
        rng.multivariate_normal(*one, round(share * count))
        for one, share in zip(zip(means, covariances, strict=True), weights, strict=True)
    ]
    drawn = np.concatenate(parts)
    np.testing.assert_allclose(mean, drawn.mean(axis=0), atol=0.02)
    np.testing.assert_allclose(covariance, np.cov(drawn.T), atol=0.05)


@pytest.mark.parametrize("count", [1, 3, 5])
def test_marginal_information_is_the_inverse_of_a_block_of_the_covariance(count: int) -> None:
    root = np.random.default_rng(1).normal(size=(9, 5))
    whole = root.T @ root
    block = np.linalg.inv(whole)[:count, :count]
    np.testing.assert_allclose(np.linalg.inv(marginal_information(whole, count)), block)


@pytest.mark.parametrize("even", [False, True])
def test_phases_are_met_again_within_their_limits(even: bool) -> None:
    rng = np.random.default_rng(4)
    met, phases = MetPhases(even), rng.standard_normal((40, 7))
    for phase in phases:
        met.add(phase, 0.2)
    for phase in phases:
        for other in (phase + rng.uniform(-0.19, 0.19, 7), -phase, phase + 0.21):
            near = np.abs(phases - other).max(axis=1).min() < 0.2
            mirrored = np.abs(phases + other).max(axis=1).min() < 0.2
            assert met.holds(other) == (near or (even and mirrored))
