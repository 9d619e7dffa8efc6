"""The compiled loops: slopes, gradients and inverses against NumPy and finite differences."""

import numpy as np
import pytest

from fringeforce.estimation.evaluation import REPORT, compare, load_frame
from fringeforce.estimation.following import covariance_at
from fringeforce.estimation.gauss_newton import Place, follow
from fringeforce.estimation.likelihood import Response, misfit
from fringeforce.estimation.strip import Strip
from fringeforce.estimation.vector_loops import add_gram, expose, factorise, invert, solve

P, M, SIZE = 700, 10, 256


@pytest.fixture
def problem() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    x = np.linspace(0, 1, P)[:, None]
    influence = 4 * np.exp(-(((x - np.linspace(0, 1, M)) / 0.12) ** 2))
    loads = np.linspace(1, 2, M)
    rng = np.random.default_rng(0)
    response = Response(240.0, 6.0, 9.0)
    return influence, loads, np.rint(response.level(influence @ loads) + rng.normal(0, 3, P))


def test_the_vectorised_sine_is_numpys() -> None:
    phase = np.linspace(-300, 300, 40 * SIZE).astype(np.float32).reshape(-1, SIZE)
    one, none = np.ones(SIZE, np.float32), np.zeros(SIZE, np.float32)
    level, slope = np.empty((2, SIZE), np.float32)
    for row in phase:
        expose(row, one, none, one, level, slope)
        exact = row.astype(float)
        np.testing.assert_allclose(level, np.sin(exact / 2) ** 2, atol=1e-6)
        np.testing.assert_allclose(slope, np.sin(exact) / 2, atol=1e-6)


@pytest.mark.parametrize(("floor", "ceiling"), [(-np.inf, np.inf), (0.0, 200.0)])
def test_the_gradient_is_the_slope_of_the_likelihood(problem, floor, ceiling) -> None:
    influence, loads, frame = problem
    frame = np.clip(frame, floor, ceiling)
    response = Response(240.0, 6.0, 9.0, floor, ceiling)
    strip = Strip.of(influence, response, np.ones(P, bool))
    place = Place.at(strip, loads)
    load_frame(strip.arrays, frame, place.work)
    compare(strip.arrays, place.slope, place.level, place.work)
    gradient = place.work.gradient

    def loss(at: np.ndarray) -> float:
        return misfit(frame, response.level(influence @ at), response).loss

    step = 1e-4 * np.eye(M)
    slopes = [(loss(loads + s) - loss(loads - s)) / 2e-4 / 2 for s in step]
    scale = np.abs(slopes).max()
    np.testing.assert_allclose(gradient[:M], slopes, atol=1e-4 * scale)
    assert (gradient[M:] == 0).all()


@pytest.mark.slow
def test_one_frame_is_climbed_to_where_the_gradient_vanishes(problem) -> None:
    influence, loads, frame = problem
    response = Response(240.0, 6.0, 9.0)
    used = np.ones(P, bool)
    used[100:140] = False
    strip = Strip.of(influence, response, used)
    place = Place.at(strip, loads + 0.02)
    found, report = np.empty(M), np.zeros(1, REPORT)[0]
    follow(strip.arrays, place, np.where(used, frame, 0), found, report)
    left = misfit(frame[used], response.level(influence[used] @ found), response)
    slope = response.slope(influence[used] @ found) / 3
    gradient = influence[used].T @ (slope * left.slope)
    covariance = covariance_at(strip, found)
    assert gradient @ covariance @ gradient < 1e-2
    assert report["squares"] == pytest.approx(left.loss, rel=1e-3)
    assert report["outliers"] == 0
    silent = misfit(frame[used], np.full(used.sum(), 6.0), response).loss
    assert report["gain"] == pytest.approx(silent - left.loss, rel=1e-4)
    information = (influence[used] * slope[:, None]).T @ (influence[used] * slope[:, None])
    np.testing.assert_allclose(covariance, np.linalg.inv(information), rtol=1e-3, atol=1e-9)


def changes(influence, response, loads, way) -> tuple[np.ndarray, np.ndarray]:
    """Changes of the levels on a way of the loads, of first and second order, by differences."""
    step = 1e-3 / np.abs(influence @ way).max()
    ahead, here, back = (response.level(influence @ (loads + k * step * way)) for k in (1, 0, -1))
    sigma = np.sqrt(response.variance)
    return (ahead - back) / (2 * step * sigma), (ahead - 2 * here + back) / (2 * step**2 * sigma)


def test_the_weakest_direction_is_one_deviation_long_and_as_bent_as_the_levels(problem) -> None:
    influence, loads, _ = problem
    response = Response(240.0, 6.0, 9.0)
    place = Place.at(Strip.of(influence, response, np.ones(P, bool)), loads)
    way = place.least_informed[:-1]
    first, second = changes(influence, response, loads, way)
    assert first @ first == pytest.approx(1, rel=0.01)
    tangent = influence * (response.slope(influence @ loads) / 3)[:, None]
    least_informed = np.linalg.eigh(tangent.T @ tangent)[1][:, 0]
    assert abs(least_informed @ way) > 0.99 * np.linalg.norm(way)
    # over one row of pixels in eight, which stand for all
    assert place.least_informed[-1] == pytest.approx(
        np.sqrt(second @ second) / (first @ first), rel=0.1
    )


def test_the_way_from_one_frame_to_the_next_is_as_bent_as_the_levels(problem) -> None:
    influence, loads, _ = problem
    response = Response(240.0, 6.0, 9.0)
    way = 0.01 * np.random.default_rng(3).normal(size=M)
    strip = Strip.of(influence, response, np.ones(P, bool))
    place, found, report = Place.at(strip, loads), np.empty(M), np.zeros(1, REPORT)[0]
    follow(strip.arrays, place, response.level(influence @ (loads + way)), found, report)
    first, second = changes(influence, response, loads + way, way)
    assert report["bent"] == pytest.approx(np.sqrt(second @ second / (first @ first)), rel=0.15)


def test_small_dense_algebra_is_numpys() -> None:
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(12, SIZE)).astype(np.float32)
    weight, total = rng.random(SIZE).astype(np.float32), np.zeros((12, 12))
    add_gram(rows, weight, 0, np.empty_like(rows), total)
    exact = (rows * weight).astype(float) @ rows.T
    np.testing.assert_allclose(np.tril(total), np.tril(exact), rtol=1e-4, atol=1e-3)
    exact = np.tril(total) + np.tril(total, -1).T
    factorise(total, 12, 0.0)
    np.testing.assert_allclose(np.tril(total), np.linalg.cholesky(exact), rtol=1e-10)
    inverse, right, solution = np.empty((12, 12)), rng.normal(size=12), np.empty(12)
    invert(total, inverse)
    np.testing.assert_allclose(inverse, np.linalg.inv(exact), rtol=1e-8, atol=1e-12)
    solve(total, 12, right, solution)
    np.testing.assert_allclose(solution, np.linalg.solve(exact, right), rtol=1e-8)
