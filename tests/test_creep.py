"""Strips whose layers relax: what earlier loads add, and readings without it."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import exp1
from typer.testing import CliRunner

import fringeforce as ff
from fringeforce.base.errors import DesignError, InputError
from fringeforce.cli import app
from fringeforce.io.tables import save_forces
from fringeforce.models.creep import Creep

TERMS = [["6 %", "0.4 s"], ["4 %", "15 s"]]
TASK = [0.0, 2.0, 3.0, 33.0, 36.0, 37.0, 70.0]
"""Times at which a touch rests, presses, slides, leaves, and has left [s]."""


def sensor(terms: object = TERMS, **more: object) -> ff.Sensor:
    light = {"camera.noise_model": "gaussian", "camera.noise": 1.0, "camera.pixels": 1024}
    return ff.load_sensor("saad").replace(**{"transducer.relaxation": terms, **light, **more})


def task(times: np.ndarray) -> np.ndarray:
    """A touch of three tactels: pressed, held, slid, released."""
    forces = np.zeros((len(times), 11, 2))
    shape = np.exp(-np.square((np.arange(11) - 5) / 1.5))
    forces[..., 0] = np.interp(times, TASK, [0, 0, 1, 1, 1, 0, 0])[:, None] * shape
    forces[..., 1] = np.interp(times, TASK, [0, 0, 0.1, 0.1, 0.3, 0, 0])[:, None] * shape
    return forces


def test_lags_are_those_of_a_generalised_maxwell_body() -> None:
    """Its internal stresses q, dq_k/dt = de/dt - q_k/tau_k, under a stress of ramps."""
    terms = sensor().transducer.relaxation
    share = np.array([term.share for term in terms])
    time = np.array([term.time for term in terms])
    times, loads = np.array([0.0, 0.3, 2.0, 2.5, 40.0, 41.0, 60.0]), np.array([0, 1, 1, 2, 2, 0, 0])
    found = [0.0]
    state = np.zeros(3)
    for k in range(1, len(times)):
        rate = (loads[k] - loads[k - 1]) / (times[k] - times[k - 1])

        def body(_: float, now: np.ndarray, rate: float = rate) -> np.ndarray:
            strain = rate + (share / time) @ now[1:]
            return np.array([strain, *(strain - now[1:] / time)])

        state = solve_ivp(body, times[k - 1 : k + 1], state, rtol=1e-10, atol=1e-12).y[:, -1]
        found.append(state[0])
    own = loads + Creep.of(sensor().transducer).added(times, loads.astype(float))
    np.testing.assert_allclose(own, found, atol=1e-7)


def test_a_lasting_load_ends_at_the_relaxed_modulus() -> None:
    creep = Creep.of(sensor().transducer)
    assert creep.amounts.sum() == pytest.approx(1 / 0.9 - 1)
    assert not len(Creep.of(sensor(()).transducer).amounts)
    stress = {
        "transducer.photoelastic.strain_optic_coefficient": None,
        "transducer.photoelastic.stress_optic_coefficient": 70e-12,
    }
    assert not len(Creep.of(sensor(**stress).transducer).amounts)


@pytest.mark.parametrize("apart", [10.0, 30.0])
def test_few_terms_miss_of_even_creep_what_their_ripple_says(apart: float) -> None:
    """Against the exponential integral, which terms of all times sum to."""
    count, time = 5, np.geomspace(1.0, apart, 400)  # from one of the middle terms to the next
    times = np.power(apart, np.arange(count) - 2.0, dtype=np.float64)
    shares = np.full(count, 1e-6)  # so few that rates are the reciprocals of times
    creep = Creep.retarding(shares, times)
    steps = (creep.amounts * -np.expm1(-np.outer(time, creep.rates))).sum(axis=1)
    ends = np.log(apart) / 2
    first, last = times[0] * np.exp(-ends), times[-1] * np.exp(ends)
    density = shares[0] / np.log(apart)
    even = density * (np.log(last / first) + exp1(time / first) - exp1(time / last))
    missed = np.sqrt(np.mean(np.square(steps - even))) / shares.sum()
    assert creep.ripple == pytest.approx(missed, rel=0.05)


def test_a_task_is_read_without_its_creep() -> None:
    times = np.arange(0.0, TASK[-1], 0.2)
    forces, model = task(times), ff.characterize(sensor())
    frames = model.expose(forces, rng=0, times=times)
    plain = ff.Reader(ff.characterize(sensor(()))).read_batch(frames)
    reader = ff.Reader(model)
    batch = reader.read_batch(frames, times=times)
    held, left = (times > 20) & (times < 33), (times > 37.5) & (times < 50)
    total, true = (values[..., 0].sum(axis=1) for values in (batch.forces, forces))
    before = plain.forces[..., 0].sum(axis=1)
    assert np.abs(before - true)[held].min() > 0.2
    assert abs((total - true)[held].mean()) < 0.01  # sums of eleven forces scatter by 0.02 N
    assert not any(status is ff.Status.OK for status in batch.status[left])
    assert abs(total[left].mean()) < 0.3 * before[left].mean()
    assert batch.std is not None
    inside = np.abs(batch.forces - forces)[held] < 1.96 * batch.std[held]
    assert 0.92 < inside.mean() < 0.98
    streamed = list(reader.stream(frames[:40], times=times[:40]))
    for row, reading in enumerate(streamed):
        near = 3 * batch.std[row] + 1e-9
        assert (np.abs(reading.forces - batch.forces[row]) < near).all()


def test_deviations_allow_for_terms_that_are_not_known() -> None:
    """Sensors drawn from a fifth of each share, read with the drawing."""
    terms = [
        {"share": "0.06 +/- 20 %", "time": "0.4 s"},
        {"share": "0.04 +/- 20 %", "time": "15 s"},
    ]
    times = np.arange(0.0, 33.0, 1.0)
    drawn, forces = ff.characterize(sensor(terms)), task(times)
    squares = []
    for seed in range(12):
        frames = drawn.as_built(rng=seed).expose(forces, rng=seed, times=times)
        batch = ff.Reader(drawn).read_batch(frames, times=times)
        assert batch.covariance is not None
        middle = forces[-1, :, 0] / np.linalg.norm(forces[-1, :, 0])
        error = (batch.forces[-1] - forces[-1])[:, 0] @ middle
        way = np.zeros((11, 2))
        way[:, 0] = middle
        squares.append(error**2 / (way.ravel() @ batch.covariance[-1] @ way.ravel()))
        assert way.ravel() @ batch.covariance[-1] @ way.ravel() > 1e-6
    # twelve squares of unit normal numbers sum to 2.2 .. 33 in 99.8 of 100 cases (chi-square)
    assert 2.2 < np.sum(squares) < 33


def test_loads_before_the_first_frame_are_allowed_for() -> None:
    times = np.arange(0.0, 70.0, 0.5)
    forces, model = task(times), ff.characterize(sensor())
    late = times >= 40
    frames = model.expose(forces, rng=0, times=times)[late]
    one, other = (ff.Reader(model, history=size) for size in (0.0, 1.0))
    found = [reader.read(frames[0], time=0.0).covariance.diagonal()[10] for reader in (one, other)]
    assert found[1] - found[0] == pytest.approx(0.111**2, rel=0.02)
    later = other.read_batch(frames, times=times[late])
    assert not any(status is ff.Status.OK for status in later.status)


def test_ten_unloaded_minutes_with_a_slow_drift_leave_readings_as_they_are() -> None:
    """What drifts is followed as the residual that it is; nothing is filtered by frequency."""
    times = np.arange(0.0, 760.0, 2.0)
    press = np.interp(times, [0, 4, 8, 68, 72, 690, 694, 760], [0, 0, 1, 1, 0, 0, 1, 1])
    shape = np.exp(-np.square((np.arange(11) - 5) / 1.5))
    forces = np.zeros((len(times), 11, 2))
    forces[..., 0] = press[:, None] * shape
    model = ff.characterize(sensor(**{"polariscope.residual": "0 +/- 0.1 rad"}))
    wave = 0.1 * np.cos(np.pi * (model.pixel_positions / 0.025 + 0.5))
    drift = np.multiply.outer(times / times[-1], wave)
    phase = model.lit_phase(model.phase(forces), times, None) + drift
    batch = ff.Reader(model).read_batch(model.delivered(phase, rng=0), times=times)
    idle, again = (times > 76) & (times < 690), times > 700
    assert not any(status is ff.Status.OK for status in np.array(batch.status)[idle])
    assert all(status is ff.Status.OK for status in np.array(batch.status)[again])
    off = np.abs(batch.forces - forces)[again] / batch.std[again]
    assert np.mean(off < 1.96) > 0.92
    assert batch.std[again].max() < 0.2


def test_times_are_asked_for_and_checked() -> None:
    model = ff.characterize(sensor())
    frame, reader = model.expose(task(np.array([10.0]))[0], rng=0), ff.Reader(model)
    with pytest.raises(InputError, match="time of each frame"):
        reader.read(frame)
    with pytest.raises(InputError, match="one each"):
        reader.read_batch(np.stack([frame, frame]), times=[0.0])
    reader.read(frame, time=1.0)
    with pytest.raises(InputError, match="must not descend"):
        reader.read(frame, time=0.5)
    with pytest.raises(InputError, match="not with shape"):
        model.expose(task(np.array([10.0]))[0], times=[0.0])
    with pytest.raises(InputError, match="history"):
        ff.Reader(model, history=-1.0)


@pytest.mark.parametrize(
    ("terms", "text"),
    [
        ([["60 %", "1 s"], ["40 %", "2 s"]], "sum to 100%"),
        ([["6 %", "1 mm"]], "quantity in seconds"),
        ([["0 %", "1 s"]], "share"),
        ([["6 %"]], "relaxation"),
    ],
)
def test_terms_that_cannot_be_are_refused(terms: object, text: str) -> None:
    with pytest.raises(DesignError, match=text):
        sensor(terms)


def test_a_design_with_relaxation_is_written_and_read_back(tmp_path: Path) -> None:
    design = sensor([{"share": "0.06 +/- 20 %", "time": "0.4 s"}])
    (tmp_path / "soft.toml").write_text(design.to_toml())
    again = ff.load_sensor(tmp_path / "soft.toml")
    assert again == design
    assert again.tolerances["transducer.relaxation.0.share"] == pytest.approx(0.012)


@pytest.mark.parametrize("terms", [[], [[0.08, 3.0]], [[0.06, 0.4], [0.04, 15.0]]])
def test_terms_are_found_from_a_load_that_is_held(terms: list[list[float]]) -> None:
    times = np.arange(0.0, 66.0, 0.1)
    loads = np.zeros((len(times), 11, 2))
    held = np.interp(times, [0, 2, 2.2, 62, 62.2, 66], [0, 0, 1.5, 1.5, 0, 0])
    loads[..., 0] = held[:, None] * np.exp(-np.square((np.arange(11) - 5) / 1.5))
    frames = ff.characterize(sensor(terms)).expose(loads, rng=1, times=times)
    found = ff.find_relaxation(ff.characterize(sensor(())), frames, loads, times).sensor
    assert len(found.transducer.relaxation) == len(terms)
    for number, ((share, time), term) in enumerate(
        zip(terms, found.transducer.relaxation, strict=True)
    ):
        stds = [found.tolerances[f"transducer.relaxation.{number}.{k}"] for k in ("share", "time")]
        assert abs(term.share - share) < 4 * stds[0] < share
        assert abs(term.time - time) < 4 * stds[1] < time


def test_the_command_finds_terms_and_readings_use_them(tmp_path: Path) -> None:
    times = np.arange(0.0, 30.0, 0.25)
    loads = np.zeros((len(times), 11, 2))
    loads[4:100, 4:7, 0] = 1.0
    save_forces(tmp_path / "hold.csv", loads)
    model = ff.characterize(sensor([["8 %", "3 s"]]))
    np.save(tmp_path / "hold.npy", model.expose(loads, rng=0, times=times))
    ff.characterize(sensor(())).save(tmp_path / "drawn.h5")
    names = [str(tmp_path / name) for name in ("drawn.h5", "hold.npy", "hold.csv", "soft.h5")]
    ended = CliRunner().invoke(app, ["creep", *names[:3], "-o", names[3], "--fps", "4"])
    assert ended.exit_code == 0, ended.output
    assert "1 term of relaxation from 120 frames" in ended.output
    out = str(tmp_path / "forces.csv")
    without = CliRunner().invoke(app, ["read", names[3], names[1], "-o", out])
    assert "--fps" in without.output + str(without.exception)
    read = CliRunner().invoke(app, ["read", names[3], names[1], "-o", out, "--fps", "4"])
    assert read.exit_code == 0, read.output


def test_terms_are_found_from_a_log_that_is_late(tmp_path: Path) -> None:
    """Forces at other instants than the frames, a quarter of a second late; by command too."""
    times, log = np.arange(0.0, 40.0, 0.1), np.arange(-1.0, 42.0, 0.037)
    corners, totals = [2.0, 2.4, 30.0, 30.3, 33.0, 33.2, 36.0], [0, 1.5, 1.5, 0, 0, 0.8, 0.8]
    loads = np.zeros((len(times), 11, 2))
    loads[:, 5, 0] = np.interp(times, corners, totals)
    frames = ff.characterize(sensor([["8 %", "3 s"]])).expose(loads, rng=2, times=times)
    drawn = ff.characterize(sensor(()))
    rows = zip(log + 0.25, np.interp(log, corners, totals), strict=True)
    table = "time_s,x_mm,fz_N\n" + "".join(f"{t:.4f},0,{-force:.6f}\n" for t, force in rows)
    (tmp_path / "log.csv").write_text(table)
    np.save(tmp_path / "hold.npy", frames)
    drawn.save(tmp_path / "drawn.h5")
    names = [str(tmp_path / name) for name in ("drawn.h5", "hold.npy", "log.csv", "soft.h5")]
    ended = CliRunner().invoke(app, ["creep", *names[:3], "-o", names[3], "--fps", "10"])
    assert ended.exit_code == 0, ended.output
    found = ff.load_model(names[3]).sensor
    (term,) = found.transducer.relaxation
    stds = [found.tolerances[f"transducer.relaxation.0.{k}"] for k in ("share", "time")]
    assert abs(term.share - 0.08) < 4 * stds[0] < 0.04
    assert abs(term.time - 3.0) < 4 * stds[1] < 1.5


def test_recordings_that_tell_no_terms_are_refused() -> None:
    model, times = ff.characterize(sensor(())), np.arange(30.0)
    silent = model.expose(np.zeros((30, 11, 2)), rng=0)
    with pytest.raises(InputError, match="0 of 30 frames"):
        ff.find_relaxation(model, silent, np.zeros((30, 11, 2)), times)
    with pytest.raises(InputError, match="29 frames do not fit loads of 30"):
        ff.find_relaxation(model, silent[:29], np.zeros((30, 11, 2)), times[:-1])
