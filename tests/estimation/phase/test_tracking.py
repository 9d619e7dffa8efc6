"""The search serves any line of fringes that a linear model explains."""

import numpy as np
import pytest

from fringeforce.estimation.phase.folding import Fringes, block_edges, phase_pace
from fringeforce.estimation.phase.tracking import explanations, load_scale


def test_the_pace_of_an_even_phase_is_its_step() -> None:
    rng = np.random.default_rng(0)
    for step in (0.05, 0.3, 1.0, 2.0):
        light = np.sin(step * np.arange(4000) / 2) ** 2 + rng.normal(0, 0.01, 4000)
        assert np.median(phase_pace(light, 1e-4)) == pytest.approx(step, rel=0.06)


def test_blocks_cover_the_frame_and_follow_the_pace() -> None:
    pace = np.concatenate([np.full(100, 0.01), np.full(100, 0.3), np.full(56, 3.0)])
    edges = block_edges(pace, extent=0.4)
    assert edges[0] == 0
    assert edges[-1] == len(pace)
    sizes = np.diff(edges)
    assert (sizes >= 1).all()
    assert sizes[0] == 8
    assert (sizes[edges[:-1] > 100] == 1).all()


def test_the_scale_of_the_loads_comes_from_the_frame() -> None:
    rng = np.random.default_rng(1)
    x = np.linspace(-1, 1, 3000)[:, None]
    influence = np.exp(-(((x - np.linspace(-0.8, 0.8, 9)) / 0.2) ** 2))
    for size in (5.0, 40.0):
        loads = rng.normal(0, size, 9)
        light = np.sin(influence @ loads / 2) ** 2
        found = load_scale(phase_pace(light, 1e-12), influence, np.ones(2999, dtype=bool))
        assert 0.4 * size < found < 2.5 * size


@pytest.mark.parametrize("gap", [0, 150])
@pytest.mark.parametrize("seed", range(5))
def test_loads_of_a_foreign_linear_model_are_found_up_to_their_sign(seed: int, gap: int) -> None:
    """Sines instead of a strip, with a gap or none: the search knows nothing of sensors."""
    rng = np.random.default_rng(seed)
    x = np.linspace(0, 1, 2000)
    influence = np.sin(np.pi * np.outer(x, np.arange(1, 9)))
    loads = rng.normal(0, 8, 8)
    light = np.sin(influence @ loads / 2) ** 2 + rng.normal(0, 0.01, len(x))
    seen = np.abs(np.arange(len(x)) - 700) >= gap / 2
    light[~seen] = 0.5
    best = next(explanations([Fringes(light, 1e-4, influence, seen=seen)]))[0]
    nearest = min((best - loads), (best + loads), key=lambda e: np.abs(e).max())
    assert np.abs(influence @ nearest).max() < 0.5
