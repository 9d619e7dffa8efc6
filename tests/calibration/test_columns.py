"""Corrected columns of the influence matrix against benches whose matrix no design expresses."""

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.stats import chi2 as chi_square

import fringeforce as ff
from fringeforce.calibration import fitted_model
from fringeforce.calibration.bench_loads import loads_on_tactels
from fringeforce.calibration.design_entries import STRAIN_OPTIC
from fringeforce.calibration.strip_search import StripSearch
from fringeforce.estimation.bounds import cramer_rao_bound
from fringeforce.reading.strip_reader import StripFrameReader

pytestmark = pytest.mark.slow

N, PIXELS = 5, 1024
FACTOR = 1.05


@pytest.fixture(scope="module")
def small(sensor: ff.Sensor) -> ff.Sensor:
    """Five tactels and half the pixels, for the sake of speed."""
    return sensor.replace(**{"tactels.count": N, "tactels.pitch": 2e-3, "camera.pixels": PIXELS})


@pytest.fixture(scope="module")
def made(small: ff.Sensor) -> ff.SensorModel:
    """The sensor on the bench, as far as its design goes."""
    return ff.characterize(small.replace(**{STRAIN_OPTIC: FACTOR * 0.05}))


def distorted(made: ff.SensorModel, rng: np.random.Generator) -> ff.SensorModel:
    """With every column multiplied by a smooth random function of its own, 3 % of its size."""
    x = made.x / made.sensor.transducer.length
    waves = rng.normal(size=(4, *made.psi.shape[1:])) * 0.03 / np.sqrt(2)
    bends = np.array([np.cos(7 * x), np.sin(7 * x), np.cos(16 * x), np.sin(16 * x)])
    return replace(made, psi=made.psi * (1 + np.einsum("kx,knc->xnc", bends, waves)))


def known_loads(rng: np.random.Generator, count: int) -> np.ndarray:
    size = rng.uniform(0, 2.5, (count, N)) * (rng.random((count, N)) < 0.7)
    size[:, 2] += 0.1 * (size == 0).all(axis=1)
    angle = np.radians(rng.uniform(-20, 20, (count, N)))
    return np.stack([size * np.cos(angle), size * np.sin(angle)], axis=2)


def presses(rng: np.random.Generator) -> np.ndarray:
    single = np.eye(2 * N).reshape(2 * N, N, 2) * [3.0, 1.5]
    return np.concatenate([single, 0.6 * single, known_loads(rng, 12)])


@dataclass(frozen=True)
class HeldOut:
    ratio: float
    coverage: float
    statuses: Counter


def held_out(model: ff.SensorModel, true: ff.SensorModel, rng, count: int) -> HeldOut:
    known, reader = StripFrameReader(true), ff.Reader(model)
    off, std, bound = [], [], []
    statuses: Counter = Counter()
    for load in known_loads(rng, count):
        reading = reader.search(true.expose(load, rng=rng))
        statuses[reading.status.name] += 1
        off.append(reading.forces - load)
        std.append(reading.std)
        phase = known.influence @ load.ravel()
        bound.append(cramer_rao_bound(phase, known.influence, true.response))
    ratio = np.sqrt(np.mean(np.square(off)) / np.mean(np.square(bound)))
    return HeldOut(ratio, float(np.mean(np.abs(off) < 1.96 * np.array(std))), statuses)


@pytest.fixture(scope="module")
def true(made: ff.SensorModel) -> ff.SensorModel:
    return distorted(made, np.random.default_rng(31))


@pytest.fixture(scope="module")
def bench(true: ff.SensorModel) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(32)
    forces = presses(rng)
    return true.expose(forces, rng=rng), forces


@pytest.fixture(scope="module")
def corrected(small: ff.Sensor, bench) -> ff.SensorModel:
    return ff.calibrate(small, bench[0], bench[1], [STRAIN_OPTIC], columns=True)


def psi_error(model: ff.SensorModel, true: ff.SensorModel) -> float:
    x = np.linspace(-0.012, 0.012, 801)
    truth = true.influence(x)
    return float(np.sqrt(((model.influence(x) - truth) ** 2).mean() / (truth**2).mean()))


def test_errors_that_no_design_value_expresses_are_corrected(
    small, true, bench, corrected, cause_not_asked
) -> None:
    plain = ff.calibrate(small, bench[0], bench[1], [STRAIN_OPTIC])
    poor = held_out(plain, true, np.random.default_rng(33), 12)
    good = held_out(corrected, true, np.random.default_rng(33), 100)
    assert poor.ratio > 2
    assert poor.coverage < 0.9
    # frames too faint for anybody are no fault of the columns
    best = held_out(true, true, np.random.default_rng(33), 100)
    assert good.statuses["OK"] >= best.statuses["OK"] - 1
    assert good.ratio < 1.3
    assert 0.93 <= good.coverage <= 0.97
    assert psi_error(corrected, true) < psi_error(plain, true) / 4
    assert any("no design value explains" in text for text in corrected.calibration.findings)


def test_nothing_is_corrected_where_nothing_is_wrong(small, made) -> None:
    rng = np.random.default_rng(34)
    forces = presses(rng)
    frames = made.expose(forces, rng=rng)
    plain, model = (
        ff.calibrate(small, frames, forces, [STRAIN_OPTIC], columns=columns)
        for columns in (False, True)
    )
    assert psi_error(model, plain) < 1e-3
    one, other = (held_out(m, made, np.random.default_rng(35), 40) for m in (plain, model))
    # corrections within noise move forces by 0.3 to 0.5 of their deviations in most frames, and
    # half a deviation adds a quarter to the variance
    assert other.ratio**2 < 1.25 * one.ratio**2
    assert other.statuses == one.statuses


def test_a_column_s_deviations_are_those_of_its_errors(small, made) -> None:
    """Errors at a few places of all columns, each over its own stated deviation."""
    rng, total, freedom = np.random.default_rng(36), 0.0, 0
    for _ in range(3):
        true = distorted(made, rng)
        forces = presses(rng)
        model = ff.calibrate(
            small, true.expose(forces, rng=rng), forces, [STRAIN_OPTIC], columns=True
        )
        x = np.searchsorted(model.pixel_positions, [-4e-3, -1.3e-3, 0.9e-3, 3.5e-3])
        assert model.imaging is not None
        modes = model.imaging.influence_modes[:, x].reshape(-1, len(x) * 2 * N)
        off = (model.pixel_influence[x] - true.influence(model.pixel_positions[x])).ravel()
        clear = (modes**2).sum(axis=0) > 0
        total += float((off[clear] ** 2 / (modes[:, clear] ** 2).sum(axis=0)).sum())
        freedom += int(clear.sum())
    assert total / freedom == pytest.approx(1, abs=0.5)


def test_readings_with_corrected_columns_scatter_as_they_state(true, corrected) -> None:
    rng, total = np.random.default_rng(37), 0.0
    loads, reader = known_loads(rng, 30), ff.Reader(corrected)
    for load in loads:
        reading = reader.search(true.expose(load, rng=rng))
        off = (reading.forces - load).ravel()
        total += float(off @ np.linalg.solve(reading.covariance, off))
    low, high = chi_square.ppf([1e-4, 1 - 1e-4], len(loads) * 2 * N)
    assert low < total < high


def test_corrected_columns_survive_their_file(corrected, true, tmp_path) -> None:
    corrected.save(tmp_path / "m.h5")
    back = ff.load_model(tmp_path / "m.h5")
    np.testing.assert_array_equal(back.psi, corrected.psi)
    frame = true.expose(ff.polar(1.0, 10, n=N), rng=0)
    np.testing.assert_array_equal(
        ff.Reader(back).search(frame).covariance, ff.Reader(corrected).search(frame).covariance
    )


def test_few_modes_state_what_all_of_them_would(small, bench, corrected, monkeypatch) -> None:
    """Also for a load that the calibration has not seen."""
    monkeypatch.setattr(fitted_model, "LEFT_OUT", 0.0)
    every = ff.calibrate(small, bench[0], bench[1], [STRAIN_OPTIC], columns=True)
    assert every.imaging is not None
    assert len(corrected.imaging.influence_modes) < 0.8 * len(every.imaging.influence_modes)
    load, used = ff.polar(1.5, 5, n=N).ravel(), np.ones(PIXELS, dtype=bool)
    kept, whole = (
        np.diag(StripFrameReader(m).calibration_covariance(load, used)) for m in (corrected, every)
    )
    known = StripFrameReader(corrected)
    bound = cramer_rao_bound(known.influence @ load, known.influence, corrected.response)
    noise = np.square(bound).ravel()
    assert (noise + kept > 0.95 * (noise + whole)).all()


def test_the_gradient_with_columns_is_that_of_the_loss(small, made) -> None:
    """Errors of columns among the unknowns; contacts are where they are."""
    rng = np.random.default_rng(38)
    forces = known_loads(rng, 8)
    loads = loads_on_tactels(forces, small.tactels.positions[:, None])
    frames = made.expose(forces, rng=rng).astype(float)
    search = StripSearch(small, frames, loads, (STRAIN_OPTIC,), {})
    search.free_columns()
    posterior, state = search.posterior(np.ones(len(frames)), 1.0), search.state
    expected = 1 / np.sqrt(posterior.expected.precision)
    shared = 0.1 * rng.standard_normal(len(expected)) * np.minimum(expected, 1.0)
    state = replace(state, shared=shared)
    gradient = posterior.expected.precision * shared
    for one in posterior.terms(state, posterior.models(shared)):
        gradient[one.which] += one.gradient

    def loss(step: np.ndarray) -> float:
        there = replace(state, shared=shared + step)
        return posterior.loss(there, posterior.models(there.shared))[0] / 2

    for number in rng.choice(len(shared), 40, replace=False):
        step = np.zeros(len(shared))
        step[number] = 1e-6  # pixels that clip make kinks farther away
        difference = (loss(step) - loss(-step)) / 2e-6
        assert gradient[number] == pytest.approx(difference, rel=1e-3, abs=1e-3)
