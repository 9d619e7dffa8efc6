"""Checks of a model on loads by position and by time."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import fringeforce as ff
from fringeforce.calibration.bench_loads import BenchLoads, presses_as_loads
from fringeforce.calibration.load_log import load_log
from fringeforce.calibration.verification import verify
from fringeforce.cli import app
from fringeforce.io.bench_loads import save_bench_loads

pytestmark = pytest.mark.slow

WIDTH = 0.8e-3
PITCH = 1e-3
NAMES = "m.h5", "f.npy", "l.csv"


@pytest.fixture(scope="module")
def model() -> ff.SensorModel:
    return ff.characterize(ff.load_sensor("skin"))


@pytest.fixture(scope="module")
def bench(model) -> tuple[np.ndarray, BenchLoads]:
    """Frames of presses anywhere, and what an exact load cell and a careful hand write down."""
    rng = np.random.default_rng(3)
    x, normal = rng.uniform(-4e-3, 4e-3, 6), rng.uniform(0.8, 2.0, 6)
    presses = [
        [ff.Press(x=a, normal=n, tangential=0.2 * n, width=WIDTH)]
        for a, n in zip(x, normal, strict=True)
    ]
    return model.expose([*presses, []], rng), presses_as_loads([*presses, []])


def test_a_good_model_passes_on_loads_by_position(model, bench) -> None:
    found = verify(model, *bench)
    assert found.passed
    assert found.coverage > 0.8
    assert found.error < 0.03
    assert found.places is not None
    assert found.places[0] < 0.05e-3


def test_frames_without_load_are_read_and_not_compared(model, bench) -> None:
    frames, loads = bench
    found, alone = verify(model, frames, loads), verify(model, frames[:-1], loads.rows(range(6)))
    assert found.statuses == alone.statuses + Counter(["NO_CONTACT"])
    assert (found.error, found.coverage) == (alone.error, alone.coverage)
    pressed = np.concatenate([frames[:-1], frames[:1]])  # where nothing is written down
    assert verify(model, pressed, loads).wrong == (6,)


def test_presses_beside_the_tactels_of_a_strip_are_named(tmp_path) -> None:
    model = ff.characterize(ff.load_sensor("saad"))
    presses = [[ff.Press(x=x, normal=1.0, width=WIDTH)] for x in (-3.4e-3, -0.5e-3, 1.6e-3, 3.5e-3)]
    frames, loads = model.expose(presses, 0), presses_as_loads(presses)
    assert verify(model, frames, loads).beside
    near = replace(loads, places=np.round(loads.places, 3) + 0.1e-3)
    assert not verify(model, frames, near).beside
    model.save(tmp_path / "m.h5")
    np.save(tmp_path / "f.npy", frames)
    save_bench_loads(tmp_path / "l.csv", loads)
    run = CliRunner().invoke(app, ["check", *(str(tmp_path / n) for n in NAMES)])
    assert run.exit_code == 1
    assert "calibrate a design with a skin" in run.output


def test_loads_one_pitch_beside_their_places_fail(model, bench) -> None:
    frames, loads = bench
    found = verify(model, frames, replace(loads, places=loads.places + PITCH))
    assert found.wrong == (0, 1, 2, 3, 4, 5)
    assert not found.passed


def test_forces_of_another_scale_fail(model, bench) -> None:
    frames, loads = bench
    assert not verify(model, frames, replace(loads, forces=1.2 * loads.forces)).passed


def test_a_log_is_aligned_with_the_frames(model) -> None:
    times, rng, delay = np.arange(0.0, 1.6, 0.1), np.random.default_rng(5), 0.13

    def force(t: np.ndarray) -> np.ndarray:
        return 1.5 * np.sin(np.pi * np.clip((t - 0.3) / 1.0, 0, 1)) ** 2

    presses = [[ff.Press(x=1e-3, normal=n, width=WIDTH)] if n > 1e-3 else [] for n in force(times)]
    frames = model.expose(presses, rng)
    clock = np.arange(-1.0, 3.0, 0.01)
    forces = np.stack([force(clock), np.zeros_like(clock)], axis=1)
    log = load_log(clock + delay, np.full(len(clock), 1e-3), forces)
    found = verify(model, frames, log, times=times)
    # what is weaker tells less of the clocks than of the reader
    firm = set(np.flatnonzero(force(times) > 0.5).tolist())
    assert not firm & set(found.wrong)
    late = load_log(clock + delay, np.full(len(clock), 1e-3), 1.2 * forces)
    assert firm & set(verify(model, frames, late, times=times).wrong)


def test_the_command_takes_loads_by_position(model, bench, tmp_path) -> None:
    frames, loads = bench
    model.save(tmp_path / "m.h5")
    np.save(tmp_path / "f.npy", frames)
    for name, shift, status in (("right", 0.0, 0), ("wrong", PITCH, 1)):
        save_bench_loads(tmp_path / f"{name}.csv", replace(loads, places=loads.places + shift))
        arguments = [str(tmp_path / part) for part in ("m.h5", "f.npy", f"{name}.csv")]
        run = CliRunner().invoke(app, ["check", *arguments])
        assert run.exit_code == status, run.output
        assert "centre of pressure" in run.output
