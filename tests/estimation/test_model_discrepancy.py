"""Errors of shape: noise alone is not mistaken for them, and what there is of them is found."""

import numpy as np
from scipy.stats import kstest

from fringeforce.estimation.model_discrepancy import SMOOTH, model_discrepancy

PIXELS, RUNS = 1024, 400
X = np.linspace(0, 1, PIXELS)
INFLUENCE = np.exp(-(((X[:, None] - np.linspace(0.1, 0.9, 6)) / 0.12) ** 2))
LOADS = np.array([4.0, -3.0, 5.0, 2.0, -4.0, 3.0])
SLOPE = 20 * np.sin(INFLUENCE @ LOADS)
TANGENT = SLOPE[:, None] * INFLUENCE
SPREAD = np.linalg.inv(TANGENT.T @ TANGENT)


def left(values: np.ndarray) -> np.ndarray:
    """What a linear fit of the loads leaves."""
    return values - TANGENT @ (SPREAD @ (TANGENT.T @ values))


def wrong_columns(rng: np.random.Generator, size: float) -> np.ndarray:
    """Smooth relative errors, independent from column to column, times each column's part."""
    distance = np.subtract.outer(X[::8], X[::8])
    kernel = np.exp(-0.5 * (distance / SMOOTH) ** 2) + 1e-9 * np.eye(len(distance))
    smooth = np.linalg.cholesky(kernel) @ rng.normal(size=(len(distance), 6))
    errors = np.stack([np.interp(X, X[::8], column) for column in smooth.T], axis=1)
    return SLOPE * ((errors * INFLUENCE) @ (size * LOADS))


def test_the_chance_of_pure_noise_is_evenly_distributed() -> None:
    rng = np.random.default_rng(0)
    chances = [
        model_discrepancy(left(rng.normal(size=PIXELS)), SLOPE, INFLUENCE, LOADS, SPREAD).chance
        for _ in range(RUNS)
    ]
    assert kstest(chances, "uniform").pvalue > 1e-3


def test_the_size_of_errors_is_found_and_their_chance_vanishes() -> None:
    rng, true, found = np.random.default_rng(1), 0.05, []
    for _ in range(RUNS):
        off = wrong_columns(rng, true) + rng.normal(size=PIXELS)
        found.append(model_discrepancy(left(off), SLOPE, INFLUENCE, LOADS, SPREAD))
    squares = np.array([one.size**2 for one in found])
    assert abs(squares.mean() - true**2) < 4 * squares.std() / np.sqrt(RUNS) + 0.1 * true**2
    assert np.median([one.chance for one in found]) < 1e-3


def test_loads_err_as_the_bias_says() -> None:
    rng = np.random.default_rng(2)
    errors = [SPREAD @ (TANGENT.T @ wrong_columns(rng, 1.0)) for _ in range(RUNS)]
    bias = model_discrepancy(np.zeros(PIXELS), SLOPE, INFLUENCE, LOADS, SPREAD).bias
    scatter = np.sqrt(np.mean(np.square(errors), axis=0))
    # a deviation from 400 draws is known to 4 %
    np.testing.assert_allclose(scatter, np.sqrt(np.diag(bias)), rtol=0.15)


def test_errors_that_are_known_already_are_not_found_again() -> None:
    rng = np.random.default_rng(3)
    waves = np.stack([np.cos(np.pi * k * X) for k in (3, 5)], axis=1)
    sums = waves.reshape(-1, 16, 2).sum(axis=1) / 4
    chances = []
    for _ in range(RUNS):
        off = rng.normal(size=PIXELS) + waves @ rng.normal(size=2)
        chances.append(model_discrepancy(left(off), SLOPE, INFLUENCE, LOADS, SPREAD, sums).chance)
    assert kstest(chances, "uniform").statistic < 0.12


def test_no_loads_show_no_errors() -> None:
    silent = model_discrepancy(np.ones(PIXELS), SLOPE, INFLUENCE, np.zeros(6), SPREAD)
    assert (silent.chance, silent.size) == (1.0, 0.0)
