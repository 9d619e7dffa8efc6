"""What the compiled loops report of residuals is what NumPy and SciPy say of them."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.special import log_ndtr

from fringeforce.estimation import evaluation
from fringeforce.estimation.bounds import covariance, systematic_covariance, systematic_errors
from fringeforce.estimation.evaluation import (
    REPORT,
    compare,
    describe,
    load_frame,
    silence,
    workspace_for,
)
from fringeforce.estimation.gauss_newton import Place
from fringeforce.estimation.layout import GROUP
from fringeforce.estimation.likelihood import Response, misfit
from fringeforce.estimation.strip import Strip

P = 700


@pytest.fixture
def influence() -> np.ndarray:
    x = np.linspace(0, 1, P)[:, None]
    return 4 * np.exp(-(((x - np.linspace(0, 1, 5)) / 0.2) ** 2))


@pytest.mark.parametrize("x", [3.0, 0.0, -1.0, -8.0, -29.9, -30.1, -35.0, -300.0])
def test_the_tail_of_the_normal_distribution_is_scipys(x: float) -> None:
    # beyond -30 two terms of the asymptotic series are left, the next being 2.5 / x^4
    assert evaluation._log_normal_tail(x) == pytest.approx(log_ndtr(x), rel=1e-7, abs=1e-12)


def test_squares_groups_and_outliers_are_counted_over_the_pixels_in_use(influence) -> None:
    used = np.ones(P, bool)
    used[32:48], used[100:104] = False, False
    strip = Strip.of(influence, Response(240.0, 6.0, 9.0), used)
    residuals = np.random.default_rng(0).normal(size=P)
    residuals[[10, 300, 301]] = 5.5, -6.0, 4.9
    residuals[~used] = 0
    report = np.zeros(1, REPORT)[0]
    own = workspace_for(strip.arrays)
    own.left[:] = strip.layout.lay(residuals)
    describe(strip.arrays, own, report)
    assert report["squares"] == pytest.approx(residuals @ residuals, rel=1e-5)
    assert report["outliers"] == 2
    starts = np.arange(0, P, GROUP)
    sums, counts = np.add.reduceat(residuals, starts), np.add.reduceat(used.astype(int), starts)
    live = counts > 0
    assert report["sums"] == pytest.approx((sums[live] ** 2 / counts[live]).sum(), rel=1e-5)
    assert strip.groups == live.sum()
    assert strip.pixels == used.sum()


@pytest.mark.parametrize(("floor", "ceiling"), [(-np.inf, np.inf), (20.0, np.inf), (0.0, 90.0)])
def test_silence_has_the_loss_of_no_loads(influence, floor: float, ceiling: float) -> None:
    bias = np.linspace(0.2, 1.4, P)
    response = Response(240.0, 6.0, 9.0, floor, ceiling, bias)
    rng = np.random.default_rng(1)
    frame = np.clip(np.rint(response.level(np.zeros(P)) + rng.normal(0, 3, P)), floor, ceiling)
    strip = Strip.of(influence, response, np.ones(P, bool))
    exact = misfit(frame, response.level(np.zeros(P)), response)
    own, pick = workspace_for(strip.arrays), strip.layout.pick
    load_frame(strip.arrays, frame, own)
    found, left, root = silence(strip.arrays, own), own.left, own.root
    assert found == pytest.approx(exact.loss, rel=1e-4)
    np.testing.assert_allclose(pick(left), exact.slope, atol=2e-3)
    np.testing.assert_allclose(pick(root) ** 2, np.maximum(exact.weight, 0), atol=2e-3)
    assert np.count_nonzero(left) == np.count_nonzero(pick(left))


def test_what_a_clipped_frame_hid_is_seen_in_the_next(influence) -> None:
    response = Response(240.0, 10.0, 9.0, 0.0, 200.0)
    strip = Strip.of(influence, response, np.ones(P, bool))
    place = Place.at(strip, np.array([0.2, 0.5, 0.3, 0.4, 0.1]))
    bright = np.clip(response.level(influence @ np.full(5, 0.5)), 0, 200)
    for frame, hidden in ((bright, (bright == 200).sum()), (np.minimum(bright, 150), 0)):
        load_frame(strip.arrays, frame, place.work)
        compare(strip.arrays, place.slope, place.level, place.work)
        assert place.work.hidden[0] == hidden
        assert np.count_nonzero(place.work.root != 1) == hidden
    assert (bright == 200).any()


def test_a_frame_that_comes_again_is_not_new(influence) -> None:
    strip = Strip.of(influence, Response(240.0, 10.0, 9.0), np.ones(P, bool))
    own, frame = workspace_for(strip.arrays), np.full(P, 7, np.uint8)
    other = frame.copy()
    other[-1] = 8
    told = []
    for shown in (frame, frame, other, other, frame):
        load_frame(strip.arrays, shown, own)
        told.append(bool(own.new[0]))
        np.testing.assert_array_equal(strip.layout.pick(own.grey), shown)
    assert told == [True, False, True, False, True]


def test_the_bias_of_a_channel_is_part_of_the_phase(influence) -> None:
    response = Response(200.0, 10.0, 4.0, bias=np.pi / 2)
    strip = Strip.of(influence, response, np.ones(P, bool))
    loads = np.linspace(0.2, 1, 5)
    place = Place.at(strip, loads)
    phase = influence @ loads
    pick = strip.layout.pick
    np.testing.assert_allclose(pick(place.phase), phase + np.pi / 2, atol=1e-5)
    np.testing.assert_allclose(pick(place.level), response.level(phase), atol=1e-2)
    np.testing.assert_allclose(pick(place.slope), response.slope(phase) / 2, atol=1e-3)


def test_wrong_levels_move_loads_as_first_order_says(influence) -> None:
    response, loads = Response(200.0, 20.0, 9.0), np.array([1.0, 0.6, 1.3, 0.9, 0.7])
    phase = influence @ loads
    wrong = 0.02 * np.stack([np.ones(P), np.cos(np.linspace(0, 9, P))])
    spread = covariance(phase, influence, response)
    pulls = wrong @ (response.slope(phase)[:, None] * influence)
    expected = systematic_errors(pulls, spread, 9.0)
    for shift, move in zip(wrong, expected, strict=True):
        frame = response.level(phase) + shift
        found = least_squares(
            lambda at, frame=frame: (response.level(influence @ at) - frame) / 3, loads, xtol=1e-14
        ).x
        np.testing.assert_allclose(found - loads, move, atol=0.05 * np.abs(move).max())
    both = systematic_covariance(pulls, spread, 9.0)
    np.testing.assert_allclose(both, sum(np.outer(move, move) for move in expected))
