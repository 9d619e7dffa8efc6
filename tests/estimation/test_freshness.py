"""How long a matrix is used again: deviations from it hold on motions that were not tried."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.estimation import freshness
from fringeforce.estimation.likelihood import Response


def deviations(influence: np.ndarray, response: Response, loads: np.ndarray) -> np.ndarray:
    slope = response.slope(influence @ loads) / np.sqrt(response.variance)
    return np.sqrt(np.diag(np.linalg.inv((influence.T * slope**2) @ influence)))


def error(influence: np.ndarray, response: Response, bend: float) -> float:
    """Relative error of deviations after motions of a bend, by differences of the levels."""
    rng, errors = np.random.default_rng(5), []
    for _ in range(20):
        loads = ff.polar(rng.uniform(0.2, 1, 11), rng.uniform(-15, 15, 11)).ravel()
        loads *= rng.uniform(2, 20) / np.abs(influence @ loads).max()
        way = loads * rng.uniform(-1, 1, len(loads))
        step = 1e-4
        ahead, here, back = (
            response.level(influence @ (loads + k * step * way)) for k in (1, 0, -1)
        )
        first, second = (ahead - back) / (2 * step), (ahead - 2 * here + back) / (2 * step**2)
        length = bend / np.sqrt((second @ second) / (first @ first))
        after = deviations(influence, response, loads + length * way)
        errors.append(after / deviations(influence, response, loads) - 1)
    return float(np.sqrt(np.mean(np.square(errors))))


@pytest.mark.parametrize("tolerated", [0.05, 0.01])
def test_deviations_hold_on_other_motions_up_to_the_bend_that_is_allowed(
    sensor: ff.Sensor, monkeypatch: pytest.MonkeyPatch, tolerated: float
) -> None:
    model = ff.characterize(sensor)
    monkeypatch.setattr(freshness, "TOLERATED", tolerated)
    bend = freshness.freshness(model.frame_influence, model.response)
    assert error(model.frame_influence, model.response, bend) < 1.5 * tolerated
    if tolerated < 0.05:
        assert bend < freshness.FRESHEST


def test_a_load_that_leaves_no_trace_does_not_count() -> None:
    x = np.linspace(0, 1, 300)[:, None]
    influence = 5 * np.exp(-(((x - np.linspace(0.1, 0.9, 4)) / 0.15) ** 2))
    response = Response(240.0, 6.0, 9.0)
    more = np.insert(influence, 2, 0.0, axis=1)
    assert freshness.freshness(more, response) == freshness.freshness(influence, response)
