"""Resolution, convergence and sensitivity against what is known otherwise."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

import fringeforce as ff
from fringeforce.studies.convergence import (
    convergence_study,
    mesh_errors,
    reference_influence,
    relative_error,
)
from fringeforce.studies.execution import Inline
from fringeforce.studies.loads import load_maps
from fringeforce.studies.performance import coarse_model, performance
from fringeforce.studies.range import range_study
from fringeforce.studies.resolution import resolution, resolution_study
from fringeforce.studies.sensitivity import local_sensitivity, variance_indices
from fringeforce.studies.study_result import StudyResult
from reading.exact_frames import Bench, drawing

pytestmark = pytest.mark.slow


def test_deviations_are_those_of_many_readings(model: ff.SensorModel) -> None:
    load = ff.polar(1.0, 10, n=11)
    found = resolution(model, load[None])
    reader, rng = ff.Reader(model), np.random.default_rng(0)
    forces = np.array([reader.read(model.expose(load, rng=rng)).forces for _ in range(150)])
    ratio = np.sqrt(((forces - load) ** 2).mean() / (found.std[0] ** 2).mean())
    assert ratio == pytest.approx(1, abs=0.1)
    correlation = np.abs(np.corrcoef(forces.reshape(150, -1).T))
    assert np.abs(correlation - found.crosstalk).max() < 0.3
    # "What one frame can tell" in docs/theory/errata.md: about 0.015 N and 0.023 N
    assert found.bound.mean(axis=1)[0] == pytest.approx([0.0147, 0.0234], rel=0.03)
    assert found.condition == pytest.approx(120, rel=0.03)


def colours(crosstalk: str, amplitudes: Sequence[str | float]) -> ff.Sensor:
    """The strip with roller edges under three lights."""
    waves = "635 nm", "525 nm", "470 nm"
    lights = [
        {"wavelength": wave, "amplitude": grey}
        for wave, grey in zip(waves, amplitudes, strict=True)
    ]
    return drawing(**{"polariscope.channels": lights, "polariscope.crosstalk": crosstalk})


@pytest.mark.parametrize(
    ("shares", "std", "light"), [(0.05, 0.02, 0.02), (0.15, 0.0, 0.0), (0.1, 0.04, 0.02)]
)
def test_deviations_with_cross_talk_are_those_of_readings_of_exact_frames(
    shares: float, std: float, light: float
) -> None:
    bright, frames = np.array([200.0, 140.0, 90.0]), 120
    stated = colours(
        f"{100 * shares:g} +/- {100 * std:g} %" if std else f"{100 * shares:g} %",
        [f"{grey:g} +/- {100 * light:g} %" if light else grey for grey in bright],
    )
    model, load = ff.characterize(stated), ff.polar(0.8, 10, n=11)
    found = resolution(model, load[None])
    reader, rng = ff.Reader(model), np.random.default_rng(0)
    bench = Bench(stated, stated.tactels.positions, np.zeros(11))
    influence = bench.influence()
    bench.influence = lambda: influence  # type: ignore[method-assign]  # the same of all frames
    readings = []
    for _ in range(frames):
        others = np.abs(shares + std * rng.standard_normal((3, 3))) * (1 - np.eye(3))
        bench.shares = others + np.diag(1 - others.sum(axis=1))
        dark = np.full(3, stated.camera.offset)
        bench.light = bright * (1 + light * rng.standard_normal(3)), dark
        readings.append(reader.search(bench.frames(load[None], rng)[0]))
    good = [one for one in readings if one.ok]
    assert len(good) > 0.95 * frames
    said = np.mean([np.square(one.std) for one in good], axis=0)
    assert np.sqrt(said / np.square(found.std[0])) == pytest.approx(1.0, abs=0.05)
    squares = np.square([one.forces - load for one in good])
    assert np.sqrt(squares.mean() / np.square(found.std).mean()) == pytest.approx(1, abs=0.1)
    # two sides of two bounds: of loads alone, and with what is uncertain beside them
    assert (found.bound <= 1.02 * found.std).all()
    assert (found.bound > 0.9 * found.std).all()


def test_cross_talk_and_weak_lights_cost_what_sweeps_say() -> None:
    """Light of other channels blurs fringes of one, and a weak one shows less of them."""
    equal = [200.0, 200.0, 200.0]
    seed, worst = np.random.SeedSequence(0), []
    for sensor in (
        colours("0 %", equal),
        colours("20 %", equal),
        colours("20 +/- 5 %", equal),
        colours("20 %", [200.0, 80.0, 80.0]),
    ):
        worst.append(performance(coarse_model(sensor), 1.0, seed).mean_uncertainty)
    none, shared, unknown, weak = worst
    assert none < shared < unknown
    assert shared < weak


def test_the_answer_about_resolution_agrees_with_its_table(
    model: ff.SensorModel, tmp_path: Path
) -> None:
    answer = resolution_study(model)
    answer.save(tmp_path)
    with (tmp_path / "resolution.csv").open(encoding="utf-8") as file:
        table = list(csv.reader(file))
    worst = max(float(row[3]) for row in table[1:]), max(float(row[6]) for row in table[1:])
    assert f"the worst is {max(worst):.3g} mN" in answer.text


def test_high_order_converges_where_linear_elements_crawl(roller_model: ff.SensorModel) -> None:
    families = {label: (n, errors) for label, n, errors in mesh_errors(roller_model.sensor)}
    linear, ours = families.values()
    assert ours[1][-1] < 1e-5 < 1e-3 < linear[1][-1]
    assert ours[0][-1] < linear[0][-1]
    rate = -np.polyfit(np.log(linear[0]), np.log(linear[1]), 1)[0]
    # singular corners and point loads hold linear elements below the rate of 1 of smooth fields
    assert 0.4 < rate < 1.1


def test_free_edges_converge_to_finer_elements(study_path: Path) -> None:
    answer = convergence_study(ff.load_sensor(study_path.parent / "small.toml"))
    errors = [float(row[2]) for row in answer.rows[3:]]
    assert errors == sorted(errors, reverse=True)
    assert errors[5] < 1e-4


@pytest.mark.parametrize("edges", ["free", "roller"])
def test_the_elements_of_sweeps_are_within_a_thousandth(sensor: ff.Sensor, edges: str) -> None:
    one = sensor.replace(**{"transducer.edges": edges})
    coarse, exact = coarse_model(one), reference_influence(one)
    assert relative_error(coarse.influence(one.pixel_positions), exact) < 1e-3
    fine = ff.characterize(one)
    seed = np.random.SeedSequence(0)
    found, better = (performance(m, 1.0, seed).worst_uncertainty for m in (coarse, fine))
    assert found == pytest.approx(better, rel=1e-3)


def likeliest(model: ff.SensorModel, psi: np.ndarray, frame: np.ndarray, near: np.ndarray):
    """Loads that explain a frame best, by SciPy, shape (2 n,)."""
    response = model.response
    return least_squares(
        lambda at: response.level(psi @ at) - frame,
        near.ravel(),
        jac=lambda at: np.asarray(response.slope(psi @ at))[:, None] * psi,
        method="lm",
    ).x


def test_slopes_predict_what_the_wrong_drawing_reads(sensor: ff.Sensor) -> None:
    paths = ("transducer.compliant.thickness", "transducer.photoelastic.strain_optic_coefficient")
    model, found = local_sensitivity(sensor, paths)
    psi = model.pixel_influence.reshape(len(model.pixel_influence), -1)
    load = ff.polar(1.0, 10, n=11)
    for path, predicted in zip(paths, found.forces, strict=True):
        value = {paths[0]: 0.5e-3, paths[1]: 0.05}[path]
        ends = []
        for sign in (1, -1):
            other = ff.characterize(sensor.replace(**{path: value * (1 + sign * 0.002)}))
            ends.append(likeliest(model, psi, model.response.level(other.phase(load)), load))
        moved = (ends[0] - ends[1]).reshape(-1, 2) / 0.004
        assert np.abs(moved - predicted).max() < 0.03 * np.abs(predicted).max()
    # the phase is proportional to the strain-optic coefficient, and so is what is read
    assert found.forces[1] == pytest.approx(load, rel=1e-4)


def test_sobols_indices_are_those_of_ishigamis_function() -> None:
    """Ishigami and Homma, 1990, whose variances are closed forms of a and b."""
    a, b = 7.0, 0.1
    variance = a**2 / 8 + b * np.pi**4 / 5 + b**2 * np.pi**8 / 18 + 0.5
    first = np.array([0.5 * (1 + b * np.pi**4 / 5) ** 2, a**2 / 8, 0]) / variance
    total = first + np.array([1, 0, 1]) * 8 * b**2 * np.pi**8 / 225 / variance

    def ishigami(points: np.ndarray) -> np.ndarray:
        x, y, z = points.T
        return np.stack([np.sin(x) + a * np.sin(y) ** 2 + b * z**4 * np.sin(x), 3 * y], axis=1)

    ends = np.full(3, np.pi)
    found_first, found_total = variance_indices(ishigami, -ends, ends, 2048)
    assert found_first[0] == pytest.approx(first, abs=0.02)
    assert found_total[0] == pytest.approx(total, abs=0.02)
    assert found_first[1] == pytest.approx([0, 1, 0], abs=0.02)


def test_loads_are_admissible_and_the_same_for_the_same_seed() -> None:
    first, again = (load_maps(np.random.SeedSequence(5), 7, 2.0) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    normal, tangential = first[..., 0], first[..., 1]
    assert (normal >= 0).all()
    assert normal.max() <= 2.0
    assert (np.abs(tangential) <= np.tan(np.radians(20)) * normal + 1e-12).all()


def test_the_answer_about_range_says_that_case_1_has_the_larger_one(study_path: Path) -> None:
    small = ff.load_sensor(study_path.parent / "small.toml")
    answer = range_study(small, Inline(), frames=4)
    assert "Case 1 has the larger range" in answer.text
    assert answer.rows[0][1:3] == ("any load", "any load")
    assert answer.rows[0][3:] == ("0 N", "0 N")


def test_titles_of_a_table_are_broken_where_its_numbers_are_short() -> None:
    header = "tactel", "normal Cramer-Rao, median [mN]", "verdict"
    rows = ("1", "7.28", "a cell of many words"), ("11", "6.93", "OK")
    found = StudyResult("resolution", header, rows, "Plain words.", lambda ax: None)
    assert found.lines() == [
        "        normal",
        "        Cramer-Rao,",
        "tactel  median [mN]  verdict",
        "1       7.28         a cell of many words",
        "11      6.93         OK",
        "",
        "Plain words.",
    ]
