"""Planned presses: predictions against simulated calibrations, and plans against other loads."""

from dataclasses import replace

import numpy as np
import pytest
from benches import shots
from scipy.stats import chi2 as chi_square
from simulation import REPEATS, Simulation

import fringeforce as ff
from fringeforce.calibration.calibrate import PARAMETERS
from fringeforce.calibration.design_entries import POSITIONS, STRAIN_OPTIC
from fringeforce.calibration.design_jacobian import design_jacobian
from fringeforce.calibration.frame_fit import (
    CalibrationFit,
    levenberg_marquardt,
    light_basis,
    start,
)
from fringeforce.calibration.measurements import Measurements
from fringeforce.calibration.planning.candidates import candidates, fringes_per_pixel, typical_loads
from fringeforce.calibration.planning.knowledge import knowledge
from fringeforce.calibration.planning.plan import next_presses, planning_problem
from fringeforce.calibration.planning.selection import CandidateExperiments
from fringeforce.calibration.result import built
from fringeforce.estimation.bounds import covariance
from fringeforce.estimation.frame_illumination import frame_illumination
from fringeforce.models.imaging import Imaging
from fringeforce.reading.strip_reader import StripFrameReader

pytestmark = pytest.mark.slow

N, BUDGET = 11, 8
TWO = PARAMETERS[:2]
LIGHT = np.full(256, 200.0), np.full(256, 20.0)


@pytest.fixture(scope="module")
def small(sensor: ff.Sensor) -> ff.Sensor:
    return sensor.replace(**{"camera.pixels": 256})


@pytest.fixture(scope="module")
def small_model(small: ff.Sensor) -> ff.SensorModel:
    return ff.characterize(small)


@pytest.fixture(scope="module")
def few(small: ff.Sensor) -> ff.SensorModel:
    """A sensor of few tactels, to which there are few loads."""
    return ff.characterize(small.replace(**{"tactels.count": 4}))


@pytest.fixture(scope="module")
def typical(small_model: ff.SensorModel) -> np.ndarray:
    return typical_loads(small_model, ff.Limits(), 6)


@pytest.fixture(scope="module")
def plan(small: ff.Sensor, typical: np.ndarray) -> ff.Plan:
    return ff.plan_presses(small, BUDGET, typical=typical)


@pytest.fixture(scope="module")
def timid(small: ff.Sensor, small_model: ff.SensorModel) -> tuple[ff.SensorModel, np.ndarray]:
    """A sensor that was calibrated with too little, and what it was calibrated with."""
    forces = np.zeros((6, N, 2))
    forces[np.arange(6), np.arange(6), 0] = 1.0
    return ff.calibrate(small, small_model.expose(forces, rng=1), forces, TWO), forces


@pytest.fixture(scope="module")
def moved(small, small_model):
    """A fit of the tactels' places and of Poisson's ratio under a drifting lamp."""
    rng = np.random.default_rng(4)
    loads = typical_loads(small_model, ff.Limits(force=1.5), 12)
    lit = replace(small_model, imaging=Imaging.known(small.pixel_positions, *LIGHT))
    frames = shots(lit, loads, rng, gains=0.02 * rng.standard_normal(12)).astype(float)
    paths = (STRAIN_OPTIC, "transducer.photoelastic.poissons_ratio", POSITIONS)
    jacobian = design_jacobian(small, paths, np.zeros(2 + N))
    bench = Measurements(
        small, frames, loads.reshape(12, -1), light_basis(256, 10), drift=(0.02, 0.0)
    )
    sound = np.ones(256, dtype=bool)
    fit = levenberg_marquardt(bench, start(bench, 2 + N), jacobian, sound)
    return built(CalibrationFit(bench, fit, sound, np.ones(12, dtype=bool)), paths, 12), jacobian


def even_singles() -> np.ndarray:
    """As many single presses, 3 N normally and 1.5 N tangentially, spread evenly."""
    unit = np.eye(2 * N).reshape(2 * N, N, 2) * [3.0, 1.5]
    return unit[np.linspace(0, 2 * N - 1, BUDGET).round().astype(int)]


def random_singles(model: ff.SensorModel) -> np.ndarray:
    pool = candidates(model, ff.Limits())
    return pool[np.random.default_rng(5).integers(0, len(pool), BUDGET)]


def added_share(plan: ff.Plan) -> float:
    """Error that the calibration adds to readings, over that of noise."""
    return float(np.sqrt(plan.ratio[-1] ** 2 - 1))


@pytest.fixture(scope="module")
def simulation(small_model: ff.SensorModel, typical: np.ndarray) -> Simulation:
    return Simulation(small_model, typical)


@pytest.fixture(scope="module")
def planned_errors(simulation: Simulation, plan: ff.Plan) -> np.ndarray:
    return simulation.added(plan.loads)


def test_calibrations_scatter_as_was_predicted_without_a_frame(small, small_model) -> None:
    rng, parameters, truth = np.random.default_rng(2), [STRAIN_OPTIC], np.array([0.05, 0.0, 1.0])
    loads = typical_loads(small_model, ff.Limits(force=1.0), 20)[-5:]
    predicted = ff.assess_presses(small, loads, parameters).covariance[-1]
    total = 0.0
    for _ in range(8):
        model = ff.calibrate(small, small_model.expose(loads, rng=rng), loads, parameters)
        assert model.calibration is not None
        error = model.calibration.values - truth
        total += error @ np.linalg.solve(predicted, error)
    low, high = chi_square.ppf([1e-4, 1 - 1e-4], 24)
    assert low < total < high


def test_the_error_added_to_readings_is_as_predicted(plan, planned_errors) -> None:
    error = planned_errors.std() / np.sqrt(REPEATS)
    assert abs(planned_errors.mean() - added_share(plan) ** 2) < 4 * error
    assert error < 0.2 * planned_errors.mean()  # so that the comparison says something


@pytest.mark.parametrize("kind", ["random", "even"])
def test_planned_presses_beat_as_many_others(
    kind, small, small_model, typical, plan, simulation, planned_errors
) -> None:
    loads = even_singles() if kind == "even" else random_singles(small_model)
    other = ff.assess_presses(small, loads, typical=typical)
    assert added_share(plan) < added_share(other)
    errors = simulation.added(loads)
    margin = np.hypot(errors.std(), planned_errors.std()) / np.sqrt(REPEATS)
    assert errors.mean() - planned_errors.mean() > 3 * margin


def test_every_press_helps_and_a_larger_budget_is_never_worse(small, typical, plan) -> None:
    assert (np.diff(plan.ratio) < 0).all()
    assert (np.diff(plan.std, axis=0) < 0).all()
    smaller = ff.plan_presses(small, BUDGET // 2, typical=typical)
    assert plan.ratio[-1] < smaller.ratio[-1] <= plan.ratio[BUDGET // 2] * (1 + 1e-9)
    assert plan.ratio[plan.enough] <= 1.01 * plan.ratio[-1] < plan.ratio[plan.enough - 1]


def test_exchange_finds_the_best_of_nearly_all_small_plans_and_no_worse_neighbour() -> None:
    pairs, found = [[i, j] for i in range(7) for j in range(i, 7)], 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        slopes = rng.standard_normal((2, 7, 3, 3))
        root = rng.standard_normal((2, 3, 3))
        stakes = CandidateExperiments(slopes @ slopes.swapaxes(2, 3), root @ root.swapaxes(1, 2))
        chosen = stakes.chosen(2)
        reached = stakes.variances(chosen)[-1]
        # no exchange of one press is better, and in 95 of 100 draws no exchange of both
        near = [pair for pair in pairs if set(pair) & set(chosen)]
        assert reached == pytest.approx(min(stakes.variances(p)[-1] for p in near), rel=1e-5)
        best = min(stakes.variances(pair)[-1] for pair in pairs)
        found += reached == pytest.approx(best, rel=1e-5)
    assert found >= 14


@pytest.mark.parametrize(
    "limits",
    [
        ff.Limits(force=1.3),
        ff.Limits(force=2.0, friction=0.4, together=2),
        ff.Limits(force=2.0, friction=0.0),
        ff.Limits(force=8.0, fringe_density=0.1),
    ],
)
def test_no_press_is_beyond_the_limits(few, limits) -> None:
    loads = ff.plan_presses(few.sensor, 3, [STRAIN_OPTIC], limits).loads
    assert np.hypot(*loads.sum(axis=1).T).max() <= limits.force * (1 + 1e-9)
    assert (np.abs(loads).max(axis=2) > 0).sum(axis=1).max() <= limits.together
    assert fringes_per_pixel(few, loads).max() <= limits.fringe_density
    assert (loads[..., 0] >= 0).all()
    if limits.friction is not None:
        assert (np.abs(loads[..., 1]) <= limits.friction * loads[..., 0] + 1e-12).all()


def test_a_calibration_is_the_prior_of_the_next(timid, small, small_model) -> None:
    model, before = timid
    more = typical_loads(small_model, ff.Limits(force=1.0), 4)
    predicted = ff.assess_presses(model, more)
    np.testing.assert_allclose(predicted.std[0], model.calibration.std, rtol=1e-6)
    forces = np.concatenate([before, more])
    both = ff.calibrate(small, small_model.expose(forces, rng=3), forces, TWO)
    assert both.calibration is not None
    # plans take loads as written and the residual as drawn: what they leave out costs some
    share = predicted.std[-1] / both.calibration.std
    assert ((share > 0.6) & (share < 1.05)).all()


def test_a_calibration_gives_back_its_derivatives_and_deviations(moved) -> None:
    model, jacobian = moved
    known, x = knowledge(model), model.pixel_positions[model.imaging.usable]
    np.testing.assert_allclose(known.jacobian.at(x)[1:], jacobian.at(x)[1:], rtol=0, atol=1e-8)
    slope = (model.influence(x + 1e-7) - model.influence(x - 1e-7)).reshape(len(x), -1) / 2e-7
    off = known.jacobian.matrix(np.zeros(2 + N), x, slope=True) - slope
    assert np.abs(off).max() < 0.01 * np.abs(slope).max()
    said = ff.assess_presses(model, np.ones((1, N, 2)), typical=np.ones((1, N, 2)))
    np.testing.assert_allclose(said.std[0], model.calibration.std, rtol=1e-6)
    np.testing.assert_allclose(said.values, model.calibration.values, rtol=1e-12)
    assert said.names == model.calibration.names


def test_the_error_before_the_next_press_is_what_readings_state(timid, moved, typical) -> None:
    for model in (timid[0], moved[0]):
        reader, used = StripFrameReader(model), model.imaging.usable
        influence, response = reader.influence[used], model.response.at(used)
        noise = added = 0.0
        for load in typical.reshape(len(typical), -1):
            phase = influence @ load
            spread = covariance(phase, influence, response)
            drift = model.imaging.drift
            if any(drift):
                level = response.level(phase)
                own = frame_illumination(level, load, influence, response, spread, drift)
                spread = spread + own.covariance
            noise += np.trace(spread)
            added += np.trace(reader.calibration_covariance(load, used))
        # of the estimate alone: imagined designs, over which plans are averaged, differ from it
        problem = planning_problem(model, None, ff.Limits(), typical, pairs=0)
        planned = problem.plan(typical, problem.experiments(typical), [0])
        # readings hold what is left of the residual too, of which plans know nothing
        assert planned.ratio[0] == pytest.approx(np.sqrt(1 + added / noise), rel=0.02)


def test_what_was_pressed_changes_what_to_press_next(small, small_model, typical) -> None:
    best = ff.plan_presses(small, 3, TWO, typical=typical).loads
    pressed = np.repeat(best, 4, axis=0)
    known = ff.calibrate(small, small_model.expose(pressed, rng=1), pressed, TWO)
    then = ff.plan_presses(known, 3, TWO, typical=typical)
    assert {load.tobytes() for load in best} != {load.tobytes() for load in then.loads}
    again = ff.assess_presses(known, best, typical=typical)
    assert then.ratio[-1] < again.ratio[-1]


def test_a_calibration_says_what_to_press_next_or_that_it_is_enough(timid, small_model) -> None:
    model, forces = timid
    said = next_presses(model, forces)
    assert said.count(" N normal") + said.count(" N tangential") == 3
    imaging = model.imaging
    sure = replace(
        model,
        imaging=replace(
            imaging,
            influence_modes=imaging.influence_modes / 100,
            amplitude_modes=imaging.amplitude_modes / 100,
            offset_modes=imaging.offset_modes / 100,
        ),
        calibration=replace(model.calibration, covariance=model.calibration.covariance / 1e4),
    )
    assert "more loads gain less than" in next_presses(sure, forces)
    for impossible in (0.0 * forces, 400.0 * forces):
        assert "No load is proposed" in next_presses(model, impossible)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"presses": 0}, "presses = 0"),
        ({"presses": 2.5}, "presses = 2.5"),
        ({"parameters": ["transducer.length"]}, "transducer.length"),
        ({"limits": {"force": -1.0}}, "-1 N"),
        ({"limits": {"force": np.nan}}, "nan N"),
        ({"limits": {"friction": -0.1}}, "friction = -0.1"),
        ({"limits": {"fringe_density": 0.7}}, "0.7"),
        ({"limits": {"together": 3}}, "3 tactels"),
        ({"limits": {"force": 400.0}}, "more than 0.2 fringes"),
        ({"typical": np.ones((11, 2))}, "(11, 2)"),
        ({"typical": np.full((1, 11, 2), np.inf)}, "finite"),
    ],
)
def test_what_cannot_be_planned_is_named(small, arguments, words) -> None:
    def planned() -> None:
        given = {"presses": 2, "parameters": [STRAIN_OPTIC], **arguments}
        given["limits"] = ff.Limits(**given.get("limits", {}))
        ff.plan_presses(small, **given)

    with pytest.raises(ff.FringeforceError) as caught:
        planned()
    assert words in str(caught.value)


def test_other_parameters_than_those_of_the_calibration_are_named(timid) -> None:
    with pytest.raises(ff.FringeforceError, match="was calibrated in"):
        ff.plan_presses(timid[0], 2, [STRAIN_OPTIC])
