"""Waves that one frame hides in its noise are found on the mean, and noise alone is not."""

import numpy as np
import pytest
from scipy.stats import chi2

from fringeforce.estimation.residual_monitor import (
    MOST,
    REMEMBERED,
    TREND,
    begin_trend,
    persists,
)

GROUPS = 128
LIMIT = chi2.isf(1e-7, GROUPS)


def fresh() -> tuple[np.ndarray, np.void]:
    state = np.zeros(1, TREND)[0]
    begin_trend(state, confirmed=False)
    return np.full(GROUPS, 7, np.float32), state  # whatever was there is forgotten


def test_noise_on_the_mean_is_as_small_as_it_says() -> None:
    rng, (trend, state) = np.random.default_rng(0), fresh()
    frames = rng.normal(size=(20_000, GROUPS)).astype(np.float32)
    squares = []
    for sums in frames:
        assert not persists(sums, GROUPS, LIMIT, trend, state)
        squares.append(float(trend @ trend) / state["variance"])
    assert squares[0] == pytest.approx(frames[0] @ frames[0], rel=1e-5)
    assert np.mean(squares) == pytest.approx(GROUPS, rel=0.03)
    late = np.array(squares[:: 4 * REMEMBERED])  # far enough apart to be independent
    assert np.mean(late < chi2.ppf(0.9, GROUPS)) == pytest.approx(0.9, abs=0.08)
    assert state["variance"] == pytest.approx(1 / (2 * REMEMBERED - 1))


def test_a_wave_far_below_one_frames_noise_is_found_and_then_allowed_for() -> None:
    rng, (trend, state) = np.random.default_rng(1), fresh()
    wave = 0.3 * np.sin(np.arange(GROUPS) / 5)
    assert wave @ wave < (LIMIT - GROUPS) / 10
    counts = []
    for _ in range(6):
        for _ in range(20 * REMEMBERED):
            sums = (wave + rng.normal(size=GROUPS)).astype(np.float32)
            if persists(sums, GROUPS, LIMIT, trend, state):
                break
        counts.append(state["count"])
        if not state["alarmed"]:
            break
        begin_trend(state, confirmed=True)
    assert counts[0] < 4 * REMEMBERED
    assert counts[-1] == 20 * REMEMBERED


@pytest.mark.parametrize(("confirmed", "alarmed", "expected"), [(1, 1, 4), (1, 0, 2), (0, 1, 1)])
def test_only_a_doubt_that_a_search_confirmed_is_allowed_for(confirmed, alarmed, expected) -> None:
    state = np.zeros(1, TREND)[0]
    state["lenience"], state["alarmed"] = 2, alarmed
    begin_trend(state, bool(confirmed))
    assert state["lenience"] == expected
    assert state["count"] == state["variance"] == state["alarmed"] == 0


@pytest.mark.parametrize(("before", "after"), [(MOST, MOST), (0, 1)])
def test_the_limit_is_neither_none_nor_without_end(before: float, after: float) -> None:
    state = np.array([(0.0, 0.0, before, True)], TREND)[0]
    begin_trend(state, confirmed=True)
    assert state["lenience"] == after
