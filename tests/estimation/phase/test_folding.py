"""Folded phases are what blocks of pixels allow, with the variance that they scatter by."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fringeforce.estimation.phase.folding import (
    MODEL_ERROR,
    Fringes,
    block_edges,
    folded_phase,
    interleaved,
    phase_pace,
)

EDGES = np.arange(0, 4001, 8)
SIGMA = 0.02


def even(phase: float, bias: float = 0.0, seed: int = 0) -> Fringes:
    """500 blocks of pixels that all have the same phase."""
    light = np.full(4000, np.sin((phase + bias) / 2) ** 2)
    noise = np.random.default_rng(seed).normal(0, SIGMA, 4000)
    return Fringes(light + noise, SIGMA**2, np.tile([[1.0, 2.0]], (4000, 1)), bias)


@pytest.mark.parametrize("phase", [0.8, 1.5, 2.4])
def test_the_fold_scatters_about_the_phase_as_its_variance_says(phase: float) -> None:
    found = folded_phase(even(phase), EDGES)
    assert not found.single.any()
    assert found.fold.mean() == pytest.approx(phase, abs=5e-3)
    noise = found.variance.mean() - MODEL_ERROR**2
    assert found.fold.var() == pytest.approx(noise, rel=0.25)
    np.testing.assert_allclose(found.influence, [[1.0, 2.0]] * 500)


def test_blocks_tell_what_their_seen_pixels_saw_and_are_left_out_where_none_did() -> None:
    line = even(1.5)
    seen = np.ones(4000, dtype=bool)
    seen[100:300] = False
    line.intensity[~seen] = 0.9
    found = folded_phase(replace(line, seen=seen), EDGES)
    assert np.isinf(found.variance).sum() == 24  # 200 pixels but for two halves of a block
    rest = interleaved([found])
    assert len(rest.fold) == 500 - 24
    assert np.abs(rest.fold - 1.5).max() < 5 * np.sqrt(rest.variance.max())
    halves = found.variance[[12, 37]] - MODEL_ERROR**2
    np.testing.assert_allclose(halves, 2 * (found.variance[11] - MODEL_ERROR**2), rtol=0.1)
    np.testing.assert_allclose(found.influence[[12, 37]], [[1.0, 2.0]] * 2)


@pytest.mark.parametrize(("phase", "middle"), [(0.0, 0.0), (np.pi, np.pi)])
def test_at_a_turning_point_one_phase_stands_for_both(phase: float, middle: float) -> None:
    line = even(phase)
    found = folded_phase(line, EDGES)
    means = line.intensity.reshape(-1, 8).mean(axis=1)
    assert found.single[np.abs(means - np.sin(phase / 2) ** 2) < 1e-3].all()
    assert (found.fold[found.single] == middle).all()
    # what was read instead of the middle stays within the stated variance
    apart = np.arccos(np.clip(1 - 2 * means, -1, 1)) - middle
    assert (found.variance > apart**2)[found.single].all()


@pytest.mark.parametrize("turns", [-3, -1, 0, 1, 2])
@pytest.mark.parametrize("rest", [0.0, 0.4, -0.4])
def test_a_bias_of_half_turns_swaps_dark_and_bright_and_no_more(turns: int, rest: float) -> None:
    phase, bias = 1.3, np.pi * turns + rest
    found = folded_phase(even(phase, bias), EDGES)
    np.testing.assert_allclose(found.bias, rest, atol=1e-12)
    assert found.fold.mean() == pytest.approx(phase + rest, abs=0.01)


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


def test_the_phase_can_be_seen_to_run_between_neighbours_that_are_both_seen() -> None:
    line = replace(even(1.0), seen=np.arange(4000) % 5 != 3)
    np.testing.assert_array_equal(line.steps, [k % 5 not in (2, 3) for k in range(3999)])
    assert even(1.0).steps.all()


@pytest.mark.parametrize("pace", [0.15, 0.5, 1.2])
def test_the_pace_is_that_of_a_phase_that_runs_evenly(pace: float) -> None:
    light = np.sin(pace * np.arange(4000) / 2) ** 2
    noisy = light + np.random.default_rng(0).normal(0, SIGMA, 4000)
    found = phase_pace(noisy, SIGMA**2)
    assert found.shape == (4000,)
    assert np.median(found) == pytest.approx(pace, rel=0.02)


def test_channels_alternate_block_by_block() -> None:
    one, two = (folded_phase(even(p, seed=k), EDGES) for k, p in enumerate((0.8, 2.0)))
    both = interleaved([one, two])
    np.testing.assert_array_equal(both.fold[::2], one.fold)
    np.testing.assert_array_equal(both.fold[1::2], two.fold)
    np.testing.assert_array_equal(both.influence[1::2], two.influence)
    np.testing.assert_array_equal(both.variance[::2], one.variance)
