"""The damped climb on all pixels: to SciPy's optimum, in few evaluations, whatever is seen."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from fringeforce.base.errors import InputError
from fringeforce.estimation import estimate
from fringeforce.estimation.estimate import maximum_likelihood
from fringeforce.estimation.likelihood import Response

P = 700
LOADS = np.array([1.0, 0.6, 1.3, 0.9, 0.7])
RESPONSE = Response(200.0, 20.0, 9.0)


@pytest.fixture
def influence() -> np.ndarray:
    x = np.linspace(0, 1, P)[:, None]
    return 4 * np.exp(-(((x - np.linspace(0, 1, 5)) / 0.2) ** 2))


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[np.ndarray]:
    """Loads at which frames are evaluated from now on."""
    evaluated, seen = estimate.evaluated, []

    def count(frame, influence, response, loads):
        seen.append(loads)
        return evaluated(frame, influence, response, loads)

    monkeypatch.setattr(estimate, "evaluated", count)
    return seen


def test_a_noisy_frame_is_climbed_to_where_scipy_ends(influence) -> None:
    noise = np.random.default_rng(0).normal(0, 3, P)
    frame = RESPONSE.level(influence @ LOADS) + noise
    found = maximum_likelihood(frame, influence, RESPONSE, LOADS + 0.05, tolerance=1e-12)
    best = least_squares(lambda at: (RESPONSE.level(influence @ at) - frame) / 3, LOADS)
    np.testing.assert_allclose(found.loads, best.x, atol=1e-5)
    assert found.misfit.loss == pytest.approx(2 * best.cost, rel=1e-9)


def test_a_frame_without_noise_is_climbed_as_fast_as_gauss_and_newton_do(
    influence, counted
) -> None:
    frame = RESPONSE.level(influence @ LOADS)
    found = maximum_likelihood(frame, influence, RESPONSE, LOADS + 0.03)
    errors = [np.linalg.norm(loads - LOADS) for loads in counted]
    # the square of the error is lost in each step, but for the damping
    assert len(errors) <= 4
    assert errors[1] < 0.2 * errors[0]
    assert errors[2] < 0.02 * errors[0]
    np.testing.assert_allclose(found.loads, LOADS, atol=1e-4)


def test_a_climb_that_begins_at_the_top_is_none(influence, counted) -> None:
    frame = RESPONSE.level(influence @ LOADS)
    maximum_likelihood(frame, influence, RESPONSE, LOADS)
    assert len(counted) == 1


def test_a_load_that_leaves_no_trace_stays_where_it_was(influence) -> None:
    influence[:, 2] = 0
    frame = RESPONSE.level(influence @ LOADS)
    found = maximum_likelihood(frame, influence, RESPONSE, LOADS + 0.03).loads
    assert found[2] == pytest.approx(LOADS[2] + 0.03)
    np.testing.assert_allclose(np.delete(found, 2), np.delete(LOADS, 2), atol=1e-3)


def test_steps_are_shortened_until_they_lead_up(influence, counted) -> None:
    """In the dark the levels are flat, and the plain step leads far beyond the top."""
    frame = RESPONSE.level(influence @ (0.1 * LOADS))
    found = maximum_likelihood(frame, influence, RESPONSE, 0.02 * LOADS)
    losses = [np.square((RESPONSE.level(influence @ at) - frame) / 3).sum() for at in counted]
    assert losses[1] > losses[0]
    assert found.misfit.loss == pytest.approx(min(losses))
    np.testing.assert_allclose(found.loads, 0.1 * LOADS, atol=1e-3)


def test_phases_of_unknown_pixels_are_left_out_and_too_few_are_refused(influence) -> None:
    phase = influence @ LOADS
    phase[100:300] = np.nan
    np.testing.assert_allclose(estimate.least_squares(phase, influence), LOADS, atol=1e-9)
    np.testing.assert_allclose(
        estimate.least_squares(phase, influence[:, :4].reshape(P, 2, 2)).ravel(),
        np.linalg.lstsq(influence[np.isfinite(phase), :4], phase[np.isfinite(phase)])[0],
        atol=1e-9,
    )
    phase[4:] = np.nan
    with pytest.raises(InputError, match="4 known phases"):
        estimate.least_squares(phase, influence)
