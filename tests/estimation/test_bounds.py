"""Covariances are what scatter shows, and information is the curvature of the likelihood."""

import numpy as np
import pytest
from scipy.optimize import minimize

import fringeforce as ff
from fringeforce.estimation.bounds import cramer_rao_bound, fisher_information
from fringeforce.estimation.estimate import least_squares
from fringeforce.estimation.likelihood import Response, misfit
from fringeforce.models.imaging import camera_response
from fringeforce.reading.strip_reader import StripFrameReader

RESPONSE = Response(amplitude=200.0, offset=20.0, variance=9.0)


def small_problem(pixels: int = 400) -> tuple[np.ndarray, np.ndarray]:
    x = np.linspace(-1, 1, pixels)[:, None]
    influence = np.exp(-(((x - np.array([-0.5, 0.0, 0.5])) / 0.4) ** 2)) * 6
    return influence, np.array([1.0, 1.7, -0.8])


def likeliest(frame: np.ndarray, start: np.ndarray, influence, response: Response) -> np.ndarray:
    """Loads of the highest likelihood, near a start."""

    def half(loads: np.ndarray) -> tuple[float, np.ndarray]:
        phase = influence @ loads
        left = misfit(frame, response.level(phase), response)
        slope = response.slope(phase) / np.sqrt(response.variance)
        return left.loss / 2, influence.T @ (slope * left.slope)

    return np.asarray(minimize(half, start, jac=True, tol=1e-6).x)


def test_information_is_the_curvature_of_the_expected_loss() -> None:
    influence, loads = small_problem()
    frame = RESPONSE.level(influence @ loads)

    def loss(shift: np.ndarray) -> float:
        return misfit(frame, RESPONSE.level(influence @ (loads + shift)), RESPONSE).loss / 2

    unit, h = np.eye(3), 1e-4
    numeric = [
        [
            (loss(h * (a + b)) - loss(h * (a - b)) - loss(h * (b - a)) + loss(-h * (a + b)))
            / (4 * h * h)
            for b in unit
        ]
        for a in unit
    ]
    exact = fisher_information(influence @ loads, influence, RESPONSE)
    np.testing.assert_allclose(numeric, exact, rtol=1e-4)


def test_estimates_scatter_as_the_bound_says() -> None:
    influence, loads = small_problem()
    rng = np.random.default_rng(0)
    level = RESPONSE.level(influence @ loads)
    found = []
    for _ in range(400):
        frame = level + rng.normal(0, 3, len(level))
        found.append(likeliest(frame, loads + 0.05, influence, RESPONSE))
    spread = np.linalg.inv(fisher_information(influence @ loads, influence, RESPONSE))
    np.testing.assert_allclose(np.cov(np.array(found).T), spread, atol=0.25 * spread.max())
    assert np.abs(np.mean(found, axis=0) - loads).max() < 4 * np.sqrt(spread.max() / 400)
    bound = cramer_rao_bound(influence @ loads, influence, RESPONSE)
    np.testing.assert_allclose(bound, np.sqrt(np.diag(spread)))


def test_at_silence_the_bound_is_infinite() -> None:
    influence, _ = small_problem()
    assert np.isinf(cramer_rao_bound(np.zeros(len(influence)), influence, RESPONSE)).all()


def test_slopes_are_those_of_the_levels_with_cross_talk() -> None:
    influence, loads = small_problem(60)
    stacked = np.concatenate([influence, 1.2 * influence, 1.4 * influence])
    shares = np.array([[0.9, 0.1, 0.0], [0.05, 0.85, 0.1], [0.1, 0.2, 0.7]])
    amplitude = np.repeat([200.0, 150.0, 90.0], 60)
    mixed = Response(amplitude, 20.0, 9.0, bias=np.repeat([0.0, 0.4, 0.0], 60), shares=shares)
    step = 1e-6
    numeric = [
        (mixed.level(stacked @ (loads + h)) - mixed.level(stacked @ (loads - h))) / (2 * step)
        for h in step * np.eye(3)
    ]
    np.testing.assert_allclose(mixed.jacobian(stacked @ loads, stacked).T, numeric, atol=1e-4)


def test_least_squares_returns_the_forces_behind_a_phase(model: ff.SensorModel) -> None:
    forces = ff.polar(np.linspace(0, 2, 11), 15.0)
    phase = model.phase(forces)
    phase[5:50] = np.nan
    np.testing.assert_allclose(least_squares(phase, model.pixel_influence), forces, atol=1e-10)
    with pytest.raises(ff.FringeforceError, match="22 loads"):
        least_squares(phase[:10], model.pixel_influence[:10])


@pytest.mark.parametrize("edge", [(0.0, np.inf), (-np.inf, 255.0)])
def test_clipped_pixels_bias_nothing(edge: tuple[float, float]) -> None:
    """A gain that drives a fifth of the frame past the converter leaves the estimate unbiased."""
    influence, loads = small_problem(1000)
    offset = -30.0 if edge[0] == 0 else 90.0
    clipping = Response(200.0, offset, 9.0, *edge)
    rng, found = np.random.default_rng(1), []
    for _ in range(60):
        noisy = clipping.level(influence @ loads) + rng.normal(0, 3, len(influence))
        frame = np.clip(noisy, 0, 255)
        found.append(likeliest(frame, loads + 0.02, influence, clipping))
    error = np.abs(np.mean(found, axis=0) - loads)
    assert (error < 4 * np.std(found, axis=0) / np.sqrt(60) + 1e-4).all()


def test_the_response_is_that_of_the_camera(model: ff.SensorModel) -> None:
    response = camera_response(model.sensor.camera)
    assert response.variance == pytest.approx(25 / 3 + 1 / 12)
    assert (response.floor, response.ceiling) == (-np.inf, np.inf)
    gaussian = model.sensor.replace(**{"camera.noise_model": "gaussian"}).camera
    assert camera_response(gaussian).floor == 0


def test_limits_of_a_dry_contact_hold_and_are_reported(model: ff.SensorModel) -> None:
    forces = ff.polar([0, 1, 0, 2, 0, 0, 1, 1, 0, 0, 1], 30)
    frame = model.expose(forces, rng=3)
    free, limited = (
        StripFrameReader(model).read(frame),
        StripFrameReader(model, friction=0.3).read(frame),
    )
    assert free.forces[0].min() < 0
    assert not free.limited.any()
    assert limited.forces[0].min() >= -1e-12
    assert (np.abs(limited.forces[1]) <= 0.3 * limited.forces[0] + 1e-9).all()
    assert limited.limited[[1, 3, 6]].all()
