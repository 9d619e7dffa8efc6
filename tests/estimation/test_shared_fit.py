"""What frames tell of unknowns that they share, beside random numbers of known variance."""

import numpy as np
import pytest
from scipy.stats import chi2

from fringeforce.estimation.shared_fit import Eliminated, FrameTerms, excess_scatter

FRAMES = 200
RARE = 1e-6


def told(gradients: np.ndarray, information: np.ndarray) -> list[Eliminated]:
    """Of frames without unknowns of their own."""
    own, cross, step = np.zeros((0, 0)), np.zeros((0, len(information))), np.zeros(0)
    return [Eliminated.of(FrameTerms(own, cross, information, step, one)) for one in gradients]


@pytest.mark.parametrize("variance", [1.0, 6.0])
def test_scatter_beyond_noise_is_told(variance: float) -> None:
    rng, information = np.random.default_rng(0), np.array([[4.0, 1.0], [1.0, 2.0]])
    noise = rng.multivariate_normal(np.zeros(2), variance * information, FRAMES)
    at_best = noise - noise.mean(axis=0)
    covariance = np.linalg.inv(FRAMES * information)
    found = excess_scatter(told(at_best, information), np.ones(FRAMES), covariance)
    low, high = chi2(FRAMES - 1).ppf([RARE, 1 - RARE]) / (FRAMES - 1)
    assert (low < found / variance).all()
    assert (found / variance < high).all()


def test_a_single_frame_does_not_scatter() -> None:
    information = np.diag([4.0, 1e-4])
    alone = told(np.array([[1e-3, -1e-8]]), information)
    found = excess_scatter(alone, np.ones(1), np.linalg.inv(information))
    assert (found == 1).all()
