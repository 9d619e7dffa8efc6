"""Damped least squares: to SciPy's optimum, in few evaluations."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import least_squares, rosen

from fringeforce.base.errors import InputError
from fringeforce.estimation import estimate
from fringeforce.estimation.levenberg_marquardt import Curvature, Expansion, Stop, minimise
from fringeforce.estimation.likelihood import Response, misfit

P = 700
LOADS = np.array([1.0, 0.6, 1.3, 0.9, 0.7])
RESPONSE = Response(200.0, 20.0, 9.0)
Array = np.ndarray
Solver = Callable[[Array, Array, Response, Array], Array]


@pytest.fixture
def influence() -> Array:
    x = np.linspace(0, 1, P)[:, None]
    return 4 * np.exp(-(((x - np.linspace(0, 1, 5)) / 0.2) ** 2))


def expansion(frame: Array, influence: Array, response: Response, seen: list[Array]):
    """What expands the loss of a frame, and keeps where it was evaluated."""

    def loss(loads: Array) -> float:
        seen.append(loads)
        return misfit(frame, response.level(influence @ loads), response).loss

    def expand(loads: Array) -> Expansion[Array]:
        phase = influence @ loads
        left = misfit(frame, response.level(phase), response)
        tangent = (response.slope(phase) / np.sqrt(response.variance))[:, None] * influence
        return Expansion(
            left.loss,
            tangent.T @ left.slope,
            lambda: Curvature((tangent.T * left.weight) @ tangent + 1e-12 * np.eye(len(loads))),
            lambda step: (loads + step, loss(loads + step)),
        )

    return expand


def generic(frame: Array, influence: Array, response: Response, start: Array) -> Array:
    return minimise(start, expansion(frame, influence, response, []), 60, Stop(near=1e-9)).place


def undamped(frame: Array, influence: Array, response: Response, start: Array) -> Array:
    """As pads are climbed: damped where a step fails, with a curvature that serves for long."""
    expand, stop = expansion(frame, influence, response, []), Stop(1e-9, 1e-9)
    return minimise(start, expand, 60, stop, damping=0.0, reuse=True).place


SOLVERS = [generic, undamped]


@pytest.mark.parametrize("solve", SOLVERS, ids=["generic", "undamped"])
@pytest.mark.parametrize(
    ("truth", "start"),
    [(LOADS, LOADS + 0.05), (LOADS, LOADS - 0.1), (0.3 * LOADS, 0.1 * LOADS)],
    ids=["near", "farther", "flat"],
)
def test_a_noisy_frame_is_climbed_to_where_scipy_ends(
    influence: Array, truth: Array, start: Array, solve: Solver
) -> None:
    frame = RESPONSE.level(influence @ truth) + np.random.default_rng(0).normal(0, 3, P)
    best = least_squares(
        lambda at: (RESPONSE.level(influence @ at) - frame) / 3, start, xtol=1e-12, ftol=1e-12
    )
    np.testing.assert_allclose(solve(frame, influence, RESPONSE, start), best.x, atol=1e-5)


@pytest.mark.parametrize("solve", SOLVERS, ids=["generic", "undamped"])
def test_a_load_that_leaves_no_trace_stays_where_it_was(influence: Array, solve: Solver) -> None:
    influence[:, 2] = 0
    found = solve(RESPONSE.level(influence @ LOADS), influence, RESPONSE, LOADS + 0.03)
    assert found[2] == pytest.approx(LOADS[2] + 0.03)
    np.testing.assert_allclose(np.delete(found, 2), np.delete(LOADS, 2), atol=1e-5)


def test_a_frame_without_noise_is_climbed_as_fast_as_gauss_and_newton_do(influence) -> None:
    frame, seen = RESPONSE.level(influence @ LOADS), list[Array]()
    minimise(LOADS + 0.03, expansion(frame, influence, RESPONSE, seen), 9, Stop(1e-4))
    errors = [np.linalg.norm(loads - LOADS) for loads in [LOADS + 0.03, *seen]]
    # the square of the error is lost in each step, but for the damping
    assert len(seen) <= 4
    assert errors[1] < 0.2 * errors[0]
    assert errors[2] < 0.02 * errors[0]
    assert errors[-1] < 1e-4


def test_a_climb_that_begins_at_the_top_is_none(influence) -> None:
    frame, seen = RESPONSE.level(influence @ LOADS), list[Array]()
    minimise(LOADS, expansion(frame, influence, RESPONSE, seen), 9, Stop(1e-4))
    assert not seen


def test_steps_are_shortened_until_they_lead_up(influence) -> None:
    """In the dark the levels are flat, and the plain step leads far beyond the top."""
    frame, seen = RESPONSE.level(influence @ (0.1 * LOADS)), list[Array]()
    expand = expansion(frame, influence, RESPONSE, seen)
    found = minimise(0.02 * LOADS, expand, 40, Stop(1e-4)).place
    losses = [np.square((RESPONSE.level(influence @ at) - frame) / 3).sum() for at in seen]
    first = np.square((RESPONSE.level(influence @ (0.02 * LOADS)) - frame) / 3).sum()
    assert losses[0] > first
    assert expand(found).loss == pytest.approx(min(losses))
    np.testing.assert_allclose(found, 0.1 * LOADS, atol=1e-3)


def test_a_climb_that_ends_for_want_of_steps_says_so(influence) -> None:
    frame, start = RESPONSE.level(influence @ LOADS), LOADS + 0.03
    expand = expansion(frame, influence, RESPONSE, [])
    for stop in (Stop(1e-4), Stop(near=1e-4)):
        assert not minimise(start, expand, 1, stop).converged
        assert minimise(start, expand, 60, stop).converged


def test_no_step_of_a_curved_valley_loses_and_its_end_is_found() -> None:
    """Rosenbrock's valley, from where More, Garbow and Hillstrom start (ACM TOMS 7, 17, 1981)."""
    losses = list[float]()

    def expand(at: Array) -> Expansion[Array]:
        left = np.array([10 * (at[1] - at[0] ** 2), 1 - at[0]])
        slope = np.array([[-20 * at[0], 10.0], [-1.0, 0.0]])
        losses.append(rosen(at))
        return Expansion(
            rosen(at),
            slope.T @ left,
            lambda: Curvature(slope.T @ slope),
            lambda step: (at + step, rosen(at + step)),
        )

    found = minimise(np.array([-1.2, 1.0]), expand, 200, Stop(1e-14)).place
    np.testing.assert_allclose(found, 1.0, atol=1e-6)
    assert all(after <= before for before, after in pairwise(losses))


@pytest.mark.parametrize("damping", [0.0, 1e-3, 10.0])
def test_a_step_solves_the_stated_equation(damping: float) -> None:
    rng = np.random.default_rng(5)
    half, gradient = rng.normal(size=(9, 6)) * 10.0 ** np.arange(6), rng.normal(size=6)
    matrix = half.T @ half
    step, promised = Curvature(matrix).step(gradient, damping)
    expected = np.linalg.solve(matrix + damping * np.diag(np.diag(matrix)), -gradient)
    np.testing.assert_allclose(step, expected, rtol=1e-6)
    assert promised == pytest.approx(-expected @ gradient, rel=1e-6)


def test_unknowns_that_a_curvature_does_not_hold_step_by_themselves() -> None:
    rng = np.random.default_rng(6)
    half, gradient, held = rng.normal(size=(9, 4)), rng.normal(size=6), np.arange(6) % 3 > 0
    whole = np.eye(6)
    whole[np.ix_(held, held)] = half.T @ half
    few = Curvature(half.T @ half, held)
    np.testing.assert_array_equal(few.holds(np.arange(6)), held)
    for damping in (0.0, 1e-3):
        step, promised = few.step(gradient, damping)
        expected, gain = Curvature(whole).step(gradient, damping)
        np.testing.assert_allclose(step, expected)
        assert promised == pytest.approx(gain)
    own = np.array([2, 5])
    np.testing.assert_array_equal(
        few.information[np.ix_(few.at(own), few.at(own))], whole[np.ix_(own, own)]
    )


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
