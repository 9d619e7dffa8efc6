"""Climbing to the top of a frame's likelihood, against SciPy; and telling explanations apart."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from fringeforce.estimation.likelihood import Response
from fringeforce.estimation.strip import Strip
from fringeforce.estimation.strip_fit import Phases, climb, node_phase

P, M = 700, 10
RESPONSE = Response(240.0, 6.0, 9.0)


@pytest.fixture
def influence() -> np.ndarray:
    x = np.linspace(0, 1, P)[:, None]
    return 4 * np.exp(-(((x - np.linspace(0, 1, M)) / 0.12) ** 2))


@pytest.fixture
def strip(influence: np.ndarray) -> Strip:
    return Strip.of(influence, RESPONSE, np.ones(P, bool))


def noisy(influence: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Loads and a frame of them."""
    loads, noise = np.linspace(1, 2, M), np.random.default_rng(seed).normal(0, 3, P)
    return loads, np.rint(RESPONSE.level(influence @ loads) + noise)


def residuals(influence: np.ndarray, frame: np.ndarray, loads: np.ndarray) -> np.ndarray:
    return (RESPONSE.level(influence @ loads) - frame) / 3


@pytest.mark.parametrize("away", [0.02, 0.2])
@pytest.mark.parametrize("seed", range(4))
def test_a_climb_ends_at_a_top_where_no_step_gains(influence, strip, away, seed) -> None:
    loads, frame = noisy(influence, seed)
    start = loads + away * np.random.default_rng(seed).normal(size=M)
    optimum = climb(strip, frame, start, 60, 1e-3)
    np.testing.assert_allclose(
        optimum.loss, (residuals(influence, frame, optimum.loads) ** 2).sum(), rtol=1e-3
    )
    # SciPy, from there, finds nothing that gains more than noise would show
    best = least_squares(lambda at: residuals(influence, frame, at), optimum.loads, method="lm")
    assert optimum.loss - 2 * best.cost < 0.1
    np.testing.assert_allclose(optimum.loads, best.x, atol=0.01)


def test_where_a_whole_step_would_lose_a_shorter_one_gains(influence, strip) -> None:
    frame = np.rint(RESPONSE.level(influence @ np.full(M, 0.1)))
    outcomes = []
    for seed in range(20):
        # near no load at all, levels hardly say how far it is
        start = np.random.default_rng(seed).uniform(0.005, 0.02, M)
        left = residuals(influence, frame, start)
        jacobian = RESPONSE.slope(influence @ start)[:, None] * influence / 3
        whole = start - np.linalg.lstsq(jacobian, left, rcond=None)[0]
        lost = (residuals(influence, frame, whole) ** 2).sum() > (left**2).sum()
        gained = climb(strip, frame, start, 1, 1e-3).loss < 0.99 * (left**2).sum()
        outcomes.append((lost, gained))
    assert sum(lost for lost, _ in outcomes) > 5
    assert all(gained for _, gained in outcomes)


def test_a_climb_that_is_too_short_keeps_the_best_it_saw(influence, strip) -> None:
    frame = np.rint(RESPONSE.level(influence @ np.linspace(1, 2, M)))
    start = np.full(M, 1.4)
    losses = [climb(strip, frame, start, steps, 1e-3).loss for steps in range(6)]
    assert losses == sorted(losses, reverse=True)
    assert losses[-1] < losses[0]


def test_phases_are_known_by_their_largest_difference(influence, strip) -> None:
    loads = np.linspace(1, 2, M)
    phase, step = node_phase(strip, loads), node_phase(strip, 0.1 * np.eye(M)[3])
    phases, apart = Phases(False, len(phase)), float(np.abs(step).max())
    assert not phases.know(phase, 1.0)
    assert phases.distance(phase) == np.inf
    phases.add(phase)
    assert phases.distance(phase + step) == pytest.approx(apart, rel=1e-4)
    assert phases.know(phase + step, 1.01 * apart)
    assert not phases.know(phase + step, 0.99 * apart)
    assert not phases.know(-phase, 1.0)


def test_a_phase_and_its_negative_are_one_where_levels_are_even(influence, strip) -> None:
    phase = node_phase(strip, np.linspace(1, 2, M))
    phases = Phases(True, len(phase))
    phases.add(phase)
    assert phases.know(-phase, 1e-3)
    assert phases.distance(-phase) == 0
    assert phases.distance(np.zeros_like(phase)) == pytest.approx(np.abs(phase).max())


def test_only_new_explanations_are_admitted_and_none_is_forgotten(influence, strip) -> None:
    rng = np.random.default_rng(0)
    loads = np.concatenate([rng.normal(size=(40, M)), np.zeros((1, M))])
    phases = Phases(False, len(strip.watched))
    assert list(phases.admit(strip, loads, 1e-3)) == list(range(41))
    assert list(phases.admit(strip, loads[::-1], 1e-3)) == []
    assert list(
        phases.admit(strip, np.vstack([loads[:2], loads[:1] + 1, loads[:1] + 1]), 0.01)
    ) == [2]
    assert len(phases) == 42
