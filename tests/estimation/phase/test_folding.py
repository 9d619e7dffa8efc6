"""How fast the phase runs, and blocks that are as long as that allows."""

from itertools import pairwise

import numpy as np
import pytest

from fringeforce.estimation.phase.folding import block_edges, phase_pace, shown_noise

SIGMA = 0.02


@pytest.mark.parametrize("seed", range(4))
def test_no_block_spans_more_phase_than_allowed_nor_more_pixels(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pace = np.exp(np.cumsum(rng.normal(0, 0.2, 700)) - 2)
    edges = block_edges(pace, extent=0.5, largest=6)
    assert edges[0] == 0
    assert edges[-1] == 700
    sizes = np.diff(edges)
    assert sizes.min() >= 1
    assert sizes.max() <= 6
    for first, last in pairwise(edges):
        assert last - first == 1 or (last - first) * pace[first:last].max() <= 0.5


@pytest.mark.parametrize("pace", [0.15, 0.5, 1.2])
def test_the_pace_is_that_of_a_phase_that_runs_evenly(pace: float) -> None:
    light = np.sin(pace * np.arange(4000) / 2) ** 2
    noisy = light + np.random.default_rng(0).normal(0, SIGMA, 4000)
    found = phase_pace(noisy, SIGMA**2, np.ones(4000, dtype=bool))
    assert found.shape == (4000,)
    assert np.median(found) == pytest.approx(pace, rel=0.02)


@pytest.mark.parametrize("pace", [0.02, 0.15, 1.2])
def test_noise_that_is_stated_too_large_leaves_the_pace(pace: float) -> None:
    light = np.sin(pace * np.arange(4000) / 2) ** 2
    noisy = light + np.random.default_rng(1).normal(0, SIGMA / 5, 4000)
    assert np.median(phase_pace(noisy, SIGMA**2, np.ones(4000, dtype=bool))) == pytest.approx(
        pace, rel=0.1
    )


def test_gaps_that_are_bridged_do_not_make_noise_small() -> None:
    rng, seen = np.random.default_rng(2), np.arange(4000) < 1000
    light = np.where(seen, rng.normal(0, SIGMA, 4000), 0.0)
    assert shown_noise(light, SIGMA**2, seen) == SIGMA**2
    assert shown_noise(light, SIGMA**2, ~seen) < 1e-9
    assert shown_noise(light, 4 * SIGMA**2, seen) == pytest.approx(SIGMA**2, rel=0.4)
