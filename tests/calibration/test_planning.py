"""Planned presses: predictions against simulated calibrations, and plans against other loads."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from benches import shots
from scipy.stats import chi2 as chi_square
from simulation import LASTING, REPEATS, SCATTER, Simulation, scattered, shaken

import fringeforce as ff
from fringeforce.calibration.bench_expectation import DOUBT
from fringeforce.calibration.bench_loads import BenchLoads, loads_on_tactels
from fringeforce.calibration.calibrate import PARAMETERS
from fringeforce.calibration.design_entries import POSITIONS, STRAIN_OPTIC, units
from fringeforce.calibration.design_jacobian import design_jacobian
from fringeforce.calibration.planning.candidates import candidates, fringes_per_pixel, typical_loads
from fringeforce.calibration.planning.knowledge import knowledge
from fringeforce.calibration.planning.plan import next_presses, planning_problem
from fringeforce.calibration.planning.selection import CandidateExperiments
from fringeforce.estimation.frame_exposure import expose
from fringeforce.estimation.linearised_frame import linearise
from fringeforce.models.imaging import Imaging
from fringeforce.reading.strip_reader import StripFrameReader

pytestmark = pytest.mark.slow

N, BUDGET, RUNS, PAIRS = 11, 8, 5, 3
TWO = PARAMETERS[:2]
POISSON = "transducer.photoelastic.poissons_ratio"
LIGHT = np.full(256, 200.0), np.full(256, 20.0)
WAVES = "635 nm", "525 nm", "470 nm"


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
    paths = (STRAIN_OPTIC, POISSON, POSITIONS)
    return ff.calibrate(small, frames, loads, paths, aside=0)


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


def test_calibrations_scatter_as_was_predicted_without_a_frame(small) -> None:
    rng, parameters, truth = np.random.default_rng(2), [STRAIN_OPTIC], np.array([0.05, 0.0, 1.0])
    dim = small.replace(**{"camera.amplitude": 100.0})  # uneven light does not clip
    loads = typical_loads(ff.characterize(dim), ff.Limits(force=1.0), 20)[-5:]
    predicted = ff.assess_presses(dim, loads, parameters).covariance[-1]
    drawn = ff.characterize(dim.replace(**SCATTER, **LASTING))
    total = 0.0
    for _ in range(RUNS):
        frames = drawn.as_built(rng).expose(scattered(loads, rng), rng=rng)
        model = ff.calibrate(dim, frames, loads, parameters, aside=0)
        assert model.calibration is not None
        error = model.calibration.values - truth
        total += error @ np.linalg.solve(predicted, error)
    low, high = chi_square.ppf([1e-4, 1 - 1e-4], RUNS * 3)
    assert low < total < high


@pytest.mark.parametrize("kind", ["colours", "quadrature"])
def test_calibrations_of_several_channels_scatter_as_was_predicted(small, kind) -> None:
    colours = [
        {"wavelength": wave, "amplitude": grey}
        for wave, grey in zip(WAVES, (100, 80, 110), strict=True)
    ]
    lights = colours if kind == "colours" else [{"bias": 0}, {"bias": 90}]
    shares = {"polariscope.crosstalk": "10 +/- 5 %"} if kind == "colours" else {}
    dim = small.replace(**{"camera.amplitude": 100.0, "polariscope.channels": lights, **shares})
    rng, parameters = np.random.default_rng(2), [STRAIN_OPTIC]
    loads = typical_loads(ff.characterize(dim), ff.Limits(force=2.0), 20)[-5:]
    plan = ff.assess_presses(dim, loads, parameters)
    drawn = ff.characterize(dim.replace(**SCATTER, **LASTING))
    total, before = 0.0, plan.std[0]
    for _ in range(RUNS):
        built = drawn.as_built(rng)
        frames = built.expose(scattered(loads, rng), rng=rng)
        model = ff.calibrate(dim, frames, loads, parameters, aside=0)
        assert model.calibration is not None
        assert model.calibration.names == plan.names
        mixed = built.model.sensor.polariscope.crosstalk
        true = [mixed[c][d] for c in range(3) for d in range(3) if c != d] if mixed else []
        error = model.calibration.values - [0.05, 0.0, 1.0, *true]
        total += error @ np.linalg.solve(plan.covariance[-1], error)
    low, high = chi_square.ppf([1e-4, 1 - 1e-4], RUNS * len(plan.names))
    assert low < total < high
    assert (plan.std[-1] < 0.7 * before).all()  # so that the comparison is of what frames tell


def test_the_error_added_to_readings_is_as_predicted(plan, planned_errors) -> None:
    error = planned_errors.std() / np.sqrt(REPEATS)
    assert abs(planned_errors.mean() - added_share(plan) ** 2) < 4 * error
    assert error < 0.2 * planned_errors.mean()  # so that the comparison says something


def test_the_error_added_to_readings_of_several_channels_is_as_predicted(small) -> None:
    lights = [
        {"wavelength": wave, "amplitude": grey, "noise": noise}
        for wave, grey, noise in zip(WAVES, (200, 160, 220), (3, 5, 9), strict=True)
    ]
    shares = {"polariscope.crosstalk": "10 +/- 5 %", "camera.amplitude": 200.0}
    drawn = small.replace(**{"camera.offset": 12.0, "polariscope.channels": lights, **shares})
    model = ff.characterize(drawn)
    typical = typical_loads(model, ff.Limits(), 6)
    plan = ff.plan_presses(drawn, BUDGET, typical=typical)
    errors = Simulation(model, typical).added(plan.loads)
    error = errors.std() / np.sqrt(REPEATS)
    assert abs(errors.mean() - added_share(plan) ** 2) < 4 * error
    assert error < 0.2 * errors.mean()


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


def listed(small: ff.Sensor, forces: np.ndarray) -> BenchLoads:
    """Loads on tactels, whose errors are stated as plans expect them if nobody states any."""
    loads = loads_on_tactels(forces, small.tactels.positions[:, None])
    sizes = np.linalg.norm(loads.forces, axis=-1)
    whole = np.hypot(sizes, 0.05 * np.nanmax(sizes))
    unsure = whole[..., None] * [DOUBT["normal"], DOUBT["tangential"]]
    return replace(
        loads,
        force_std=np.where(loads.present[..., None], unsure, np.nan),
        place_std=np.where(loads.present, DOUBT["place"], np.nan),
        width_std=np.where(loads.present, DOUBT["width"], np.nan),
    )


@pytest.mark.parametrize("name", ["skin", "pad-skin"])
def test_presses_on_a_skin_do_not_slip(name: str) -> None:
    """None of those from which plans are chosen."""
    skin = ff.load_sensor(name).replace(**{"skin.friction": 0.4})
    if skin.dimensions == 2:
        skin = skin.replace(**{"camera.pixels": [48, 48]})
    problem = planning_problem(skin, TWO[:1], ff.Limits(), None, pairs=0)
    normal, *shear = np.moveaxis(problem.known.candidates(problem.limits), -1, 0)
    assert (np.linalg.norm(shear, axis=0) <= 0.4 * normal * (1 + 1e-9)).all()
    assert normal.max() > 0


def test_a_calibrated_skin_is_pressed_two_thicknesses_of_its_cover_apart() -> None:
    model = ff.characterize(ff.load_sensor("skin").replace(**{"camera.pixels": 256}))
    pressed = np.flatnonzero(candidates(model, ff.Limits()).any(axis=(0, 2)))
    apart = np.diff(model.sensor.tactels.positions[pressed])
    assert apart == pytest.approx(2 * model.sensor.transducer.compliant.thickness)
    ends = model.sensor.tactels.positions[pressed[[0, -1]]]
    assert np.abs(ends).min() > model.sensor.skin.extent / 2 - apart[0]


def test_derivatives_by_the_cover_of_a_skin_are_those_of_differences() -> None:
    """Its line loads are a fifth of the cover's thickness apart: others for another thickness."""
    thickness = "transducer.compliant.thickness"
    skin = ff.load_sensor("skin").replace(**{"camera.pixels": 256})
    found = design_jacobian(skin, (thickness,), np.zeros(1))
    x, step, drawn = np.linspace(-5e-3, 5e-3, 41), 0.02, skin.transducer.compliant.thickness
    spaced = skin.replace(**{"skin.resolution": skin.tactels.pitch})
    ahead, behind = (
        ff.characterize(spaced.replace(**{thickness: drawn * np.exp(way * step)})).influence(x)
        for way in (1, -1)
    )
    wanted = (ahead - behind).reshape(len(x), -1) / (2 * step)
    off = found.at(x)[1] - wanted
    assert np.abs(off).max() < 0.02 * np.abs(wanted).max()


def test_a_calibration_is_the_prior_of_the_next(small, small_model) -> None:
    """Calibrations of all frames err as was predicted after the first ones."""
    more = typical_loads(small_model, ff.Limits(force=1.0), 10)
    before, after = more[:6], more[6:]
    bench, rng, squares = shaken(small), np.random.default_rng(3), []
    clear = small.transducer.photoelastic
    truth = np.array([clear.strain_optic_coefficient, small.transducer.compliant.youngs_modulus])
    for _ in range(PAIRS):
        frames = bench.expose(scattered(more, rng), rng=rng)
        model = ff.calibrate(small, frames[:6], listed(small, before), TWO, aside=0)
        both = ff.calibrate(small, frames, listed(small, more), TWO, aside=0)
        predicted = ff.assess_presses(model, after)
        assert model.calibration is not None
        assert both.calibration is not None
        np.testing.assert_allclose(predicted.std[0], model.calibration.std, rtol=1e-6)
        assert (predicted.std[-1] < predicted.std[0]).all()
        # what is uncertain of a design is the logarithm of its values
        grown = both.calibration.values / model.calibration.values
        grown[len(TWO) :] = 1.0
        error = (both.calibration.values - [*truth, 0.0, 1.0]) / grown
        squares.append(error @ np.linalg.solve(predicted.covariance[-1], error))
    low, high = chi_square.ppf([1e-4, 1 - 1e-4], PAIRS * (len(truth) + 2))
    assert low < sum(squares) < high


def test_modes_move_values_as_they_move_the_matrix(moved) -> None:
    known, paths = knowledge(moved), (STRAIN_OPTIC, POISSON, POSITIONS)
    jacobian = design_jacobian(moved.sensor, paths, np.zeros(2 + N))
    seen = moved.imaging.usable
    x, drawn = moved.pixel_positions[seen], moved.sensor.pixel_positions[seen]
    slope = jacobian.matrix(np.zeros(2 + N), x, slope=True)
    unit = units(moved.sensor, paths, np.zeros(2 + N))[:, None, None]
    changes = [*jacobian.at(x)[1:] / unit, slope, slope * drawn[:, None]]
    modes = moved.imaging.influence_modes[:, seen].reshape(len(known.root.T), len(x), -1)
    off = np.tensordot(known.root.T, changes, 1) - modes
    assert np.abs(off).max() < 2e-3 * np.abs(modes).max()
    said = ff.assess_presses(moved, np.ones((1, N, 2)), typical=np.ones((1, N, 2)))
    np.testing.assert_allclose(said.std[0], moved.calibration.std, rtol=1e-6)
    np.testing.assert_allclose(said.values, moved.calibration.values, rtol=1e-12)
    assert said.names == moved.calibration.names


def test_the_error_before_the_next_press_is_what_readings_state(timid, moved, typical) -> None:
    for model in (timid[0], moved):
        reader, used = StripFrameReader(model), model.imaging.usable
        frame, noise, added = reader.uncertain.frame, 0.0, 0.0
        for load in typical.reshape(len(typical), -1):
            unknowns = np.append(load, np.zeros(frame.at.size - len(load)))
            level = np.where(used, expose(frame, unknowns)[0], np.nan)
            about = linearise(frame, reader.prior_near(load), level, unknowns)
            noise += np.trace(np.linalg.inv(about.hessian + about.cone)[: 2 * N, : 2 * N])
            added += np.trace(reader.calibration_covariance(load, used))
        # of the estimate alone: imagined designs, over which plans are averaged, differ from it
        problem = planning_problem(model, None, ff.Limits(), typical, pairs=0)
        planned = problem.plan(typical, problem.experiments(typical), [0])
        assert planned.ratio[0] == pytest.approx(np.sqrt(1 + added / noise), rel=1e-3)


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
    assert said.count("press on tactel ") + said.count("push on tactel ") == 3
    modes = [f"{kind}_modes" for kind in ("influence", "amplitude", "offset", "phase", "lens")]
    calibration = model.calibration
    sure = replace(
        model,
        imaging=replace(model.imaging, **{m: getattr(model.imaging, m) / 100 for m in modes}),
        calibration=replace(calibration, modes=calibration.modes / 100),
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
        given: dict[str, Any] = {"presses": 2, "parameters": [STRAIN_OPTIC], **arguments}
        given["limits"] = ff.Limits(**given.get("limits", {}))
        ff.plan_presses(small, **given)

    with pytest.raises(ff.FringeforceError) as caught:
        planned()
    assert words in str(caught.value)


def test_other_parameters_than_those_of_the_calibration_are_named(timid) -> None:
    with pytest.raises(ff.FringeforceError, match="was calibrated in"):
        ff.plan_presses(timid[0], 2, [STRAIN_OPTIC])
