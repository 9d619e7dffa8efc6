"""Where nothing is folded the beam search is linear regression; where phases fold, it unfolds."""

import numpy as np
import pytest

from fringeforce.estimation.phase.branches import branches

BLOCKS, LOADS, SCALE, NOISE = 160, 4, 2.0, 0.03
X = np.linspace(0, 1, BLOCKS)
INFLUENCE = np.exp(-(((X[:, None] - np.linspace(0.1, 0.9, LOADS)) / 0.2) ** 2))


def searched(
    phase: np.ndarray, influence: np.ndarray, bias: float = 0.0, fold: bool = True, width: int = 64
) -> tuple[np.ndarray, np.ndarray]:
    """Search a row of phases of which only the distance to the next multiple of 2 pi is known."""
    known = np.arccos(np.cos(phase)) if fold else phase
    blocks = len(phase)
    states, scores = branches(
        known,
        np.full(blocks, NOISE**2),
        np.full(blocks, not fold),
        np.full(blocks, bias),
        SCALE * influence,
        width,
        5.0,
        40.0,
    )
    return SCALE * states, scores


def regression(phase: np.ndarray, influence: np.ndarray) -> tuple[np.ndarray, float]:
    """Posterior mean of the loads, and the squared deviations of the phases from expectation."""
    together = SCALE**2 * influence @ influence.T + NOISE**2 * np.eye(len(phase))
    weighted = np.linalg.solve(together, phase)
    return SCALE**2 * influence.T @ weighted, float(phase @ weighted)


@pytest.mark.parametrize("bias", [0.4, -0.7])
@pytest.mark.parametrize("seed", range(3))
def test_known_phases_give_the_posterior_of_a_linear_model(seed: int, bias: float) -> None:
    rng = np.random.default_rng(seed)
    clean = INFLUENCE @ rng.uniform(0.3, 0.9, LOADS)
    phase = clean + rng.normal(0, NOISE, BLOCKS)
    means, scores = searched(phase + bias, INFLUENCE, bias, fold=False)
    expected, square = regression(phase, INFLUENCE)
    np.testing.assert_allclose(means[0], expected, atol=1e-9)
    assert scores[0] == pytest.approx(square, rel=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_folded_phases_are_unfolded_to_the_same_posterior(seed: int) -> None:
    rng = np.random.default_rng(seed)
    # the scan starts where the strip is dark, as strips do, and peaks at several half turns
    influence = np.sin(np.pi * np.outer(np.linspace(0, 1, 600), np.arange(1, LOADS + 1)))
    loads = np.array([5.0, -1.0, 1.5, 0.8]) * rng.uniform(0.7, 1.1, LOADS)
    clean = influence @ loads
    assert clean.max() > 1.2 * np.pi
    phase = clean + rng.normal(0, NOISE, 600)
    means, scores = searched(phase, influence)
    assert (np.diff(scores) >= 0).all()
    expected, _ = regression(phase, influence)
    nearest = min((means[0] - expected, means[0] + expected), key=lambda e: np.abs(e).max())
    assert np.abs(nearest).max() < 0.1


def test_a_broken_block_is_passed_over() -> None:
    phase = INFLUENCE @ np.array([0.4, 0.8, 0.6, 0.5])
    broken = phase.copy()
    broken[90] += np.pi  # as far from any multiple as can be
    spoilt, scores = searched(broken + 0.4, INFLUENCE, 0.4, fold=False)
    sound = np.arange(BLOCKS) != 90
    expected, square = regression(phase[sound], INFLUENCE[sound])
    np.testing.assert_allclose(spoilt[0], expected, atol=1e-9)
    assert scores[0] == pytest.approx(square + 5.0**2, rel=1e-9)  # the gate is 5 deviations


@pytest.mark.parametrize("width", [1, 5])
def test_no_more_hypotheses_are_kept_than_asked_for(width: int) -> None:
    phase = INFLUENCE @ np.array([4.0, 3.0, 5.0, 2.0])
    means, scores = searched(phase, INFLUENCE, width=width)
    assert 1 <= len(means) == len(scores) <= width
    assert scores.max() <= scores.min() + 40.0
