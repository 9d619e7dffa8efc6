"""Limits are the linear programs that they claim to be."""

import itertools

import numpy as np
import pytest
from scipy.optimize import linprog

import fringeforce as ff
from fringeforce.studies.limits import (
    PAPER_START,
    SIGN_BY_CONTACT,
    border_influence,
    densest_fringes,
    edge_limit,
    largest_phase,
    nyquist_limit,
    strain_limit,
)
from fringeforce.studies.loads import FRICTION, scattered_load, uniform_load
from fringeforce.studies.monte_carlo import paper_judge, reader_judge, reading_limit, share_right
from fringeforce.studies.range import steepest_angle


def corners(n: int, friction: float) -> np.ndarray:
    """Every corner of the set of admissible loads up to 1 N, shape (3^n, n, 2)."""
    single = [(0.0, 0.0), (1.0, friction), (1.0, -friction)]
    return np.array(list(itertools.product(single, repeat=n)))


@pytest.mark.parametrize("interval", [PAPER_START, SIGN_BY_CONTACT, (-2.0, 0.5)])
@pytest.mark.parametrize("friction", [0.05, FRICTION])
def test_the_edge_limit_is_that_of_all_corners(
    interval: tuple[float, float], friction: float
) -> None:
    rng = np.random.default_rng(1)
    finite = 0
    for _ in range(5):
        border = rng.normal(-0.5, 0.3, (2, 4, 2))
        phases = np.einsum("bnc,knc->kb", border, corners(4, friction))
        below = interval[0] / min(phases.min(), -1e-300)
        above = interval[1] / phases.max() if phases.max() > 1e-12 else np.inf
        found = edge_limit(border, interval=interval, friction=friction)
        assert found == pytest.approx(min(below, above), rel=1e-6, abs=1e-12)
        finite += bool(0 < found < np.inf)
    assert finite or interval[1] == 0


def test_uniform_loads_are_the_same_program_on_summed_columns() -> None:
    border = np.random.default_rng(2).normal(-0.5, 0.3, (2, 4, 2))
    sums = border.sum(axis=1)
    steepest = np.abs(sums[:, 1]) * FRICTION
    closed = np.pi / max((steepest - sums[:, 0]).max(), (sums[:, 0] + steepest).max())
    assert edge_limit(border, uniform=True, interval=SIGN_BY_CONTACT) == pytest.approx(closed)


def test_the_worst_distribution_is_never_better_than_a_uniform_one(
    roller_model: ff.SensorModel,
) -> None:
    border = border_influence(roller_model)
    both = [edge_limit(border, uniform, SIGN_BY_CONTACT) for uniform in (True, False)]
    assert 0 < both[1] <= both[0] * (1 + 1e-9) < np.inf


def test_free_edges_allow_any_load_and_roller_edges_do_not(
    model: ff.SensorModel, roller_model: ff.SensorModel
) -> None:
    assert edge_limit(border_influence(model)) == np.inf
    # -0.7021 N + 3.5103 T < 0 at the left border for equal forces on all tactels, by the Fourier
    # series of "Reference values" in docs/theory/errata.md: arctan(0.7021 / 3.5103) = 11.31 degrees
    assert edge_limit(border_influence(roller_model)) == 0
    assert steepest_angle(roller_model) == pytest.approx(11.31, abs=0.02)
    flat = edge_limit(border_influence(roller_model), uniform=True, friction=0.1)
    assert flat == pytest.approx(np.pi / (0.7021 + 3.5103 * 0.1), rel=1e-3)


def test_the_largest_phase_is_that_of_a_linear_program() -> None:
    rows = np.random.default_rng(3).normal(size=(6, 3, 2))
    unit, none = np.eye(3), np.zeros((3, 3))
    limits = np.block([[-FRICTION * unit, unit], [-FRICTION * unit, -unit], [unit, none]])
    right = np.concatenate([np.zeros(6), np.ones(3)])
    bounds = [(0, None)] * 3 + [(None, None)] * 3
    for row, found in zip(rows, largest_phase(rows), strict=True):
        best = max(
            -linprog(sign * row.T.ravel(), A_ub=limits, b_ub=right, bounds=bounds).fun
            for sign in (1, -1)
        )
        assert found == pytest.approx(best)


def test_no_random_load_packs_fringes_closer_than_the_densest(model: ff.SensorModel) -> None:
    rng = np.random.default_rng(4)
    limit = nyquist_limit(model)
    loads = np.array([scattered_load(rng, 11, limit) for _ in range(200)])
    fringes = np.abs(np.diff(model.phase(loads), axis=1)).max() / (2 * np.pi)
    assert 0.2 < fringes <= 0.5 * (1 + 1e-9)
    assert densest_fringes(model, uniform=True) < densest_fringes(model)


def test_strain_ends_at_a_tenth_of_the_softer_modulus(model: ff.SensorModel) -> None:
    assert strain_limit(model) == pytest.approx(0.1 * 11e6 * 1e-3 * 2e-3)
    soft = ff.SensorModel(
        model.sensor.replace(**{"transducer.photoelastic.youngs_modulus": "5 MPa"}),
        model.breaks,
        model.psi,
    )
    assert strain_limit(soft) == pytest.approx(0.1 * 5e6 * 1e-3 * 2e-3)


def test_a_known_limit_is_found_to_a_tenth_and_never_passed() -> None:
    found = reading_limit(lambda rng, load: load <= 7.3, 0.2, 100.0, count=10)
    assert 7.3 / 1.1 <= found <= 7.3
    assert reading_limit(lambda rng, load: load <= 7.3, 0.2, 5.0, count=10) == 5.0
    assert reading_limit(lambda rng, load: False, 0.2, 5.0, count=10) == 0


def test_two_wrong_readings_in_a_hundred_are_too_many() -> None:
    def judge(share: float):
        return lambda rng, load: load < 1 or rng.random() > share

    assert reading_limit(judge(0.5), 0.5, 4.0, count=100) < 1
    assert reading_limit(judge(0.0), 0.5, 4.0, count=100) == 4.0


def test_roller_edges_stop_the_papers_algorithm_and_not_the_reader(
    model: ff.SensorModel, roller_model: ff.SensorModel
) -> None:
    free, roller = (
        share_right(paper_judge(m, uniform_load), 4.0, 8) for m in (model, roller_model)
    )
    assert free == 1 > roller
    assert share_right(reader_judge(roller_model, uniform_load), 4.0, 8) == 1
