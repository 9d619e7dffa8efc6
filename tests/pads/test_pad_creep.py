"""Pads that relax: forces are read without the creep of earlier ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

import fringeforce as ff
from fringeforce.base.errors import DesignError, InputError
from fringeforce.cli import app

TERMS = [["6 %", "0.4 s"], ["4 %", "15 s"]]
TIMES = np.arange(0.0, 30.0, 0.25)
PUSH = 3.0 * np.interp(TIMES, [0, 1, 2, 20, 20.5, 30], [0, 0, 1, 1, 0, 0])
HELD, FREE = PUSH > 0.3, TIMES > 20.6


def pad(**values: object) -> ff.Pad:
    small = {"tactels": {"count": [5, 5]}, "camera": {"pixels": [96, 96]}}
    return ff.load_sensor("pad").replace(**small).replace(**values)


@pytest.fixture(scope="module")
def creeping() -> ff.PadModel:
    return ff.characterize(pad(**{"transducer.relaxation": TERMS}))


@pytest.fixture(scope="module")
def forces() -> NDArray[np.float64]:
    found = np.zeros((len(TIMES), 25, 3))
    found[:, 12, 0], found[:, 13, 0], found[:, 12, 1] = PUSH, PUSH / 2, PUSH / 5
    return found


@pytest.fixture(scope="module")
def frames(creeping, forces) -> NDArray[np.unsignedinteger]:
    return creeping.expose(forces, rng=0, times=TIMES)


def test_a_load_that_lasts_shows_what_the_moduli_have_lost(creeping) -> None:
    """After long, strains are those of layers softer by 1 - 0.1: the closed form of creep."""
    times, loads = np.array([0.0, 1e-9, 1e4]), np.zeros((3, 25, 3))
    loads[1:, 12, 0] = 1.0
    late = creeping.expose(loads, rng=1, times=times)[2].astype(int)
    at_once = ff.characterize(pad()).expose(loads / 0.9, rng=1)[2].astype(int)
    assert np.abs(late - at_once).max() <= 1  # of 255, where a tenth of the load changes 10
    fresh = ff.characterize(pad()).expose(loads, rng=1)[2].astype(int)
    assert np.abs(late - fresh).max() > 5


def test_forces_are_read_without_creep_and_none_is_left(creeping, forces, frames) -> None:
    batch = ff.Reader(creeping).read_batch(frames, covariance=False, times=TIMES)
    assert all(status is ff.Status.OK for status in batch.status[HELD])
    assert all(status is ff.Status.NO_CONTACT for status in batch.status[FREE])
    error = (batch.forces - forces)[HELD]
    assert (np.abs(error) < 1.96 * batch.std[HELD]).mean() > 0.92
    plain = ff.Reader(ff.characterize(pad())).read_batch(frames, covariance=False)
    off = (plain.forces - forces)[HELD][:, 12, 0]
    assert off[-10:].mean() > 0.2  # a tenth of 3 N
    assert not any(status is ff.Status.NO_CONTACT for status in plain.status[FREE])
    assert np.square(error).mean() < 0.1 * np.square(plain.forces - forces)[HELD].mean()


def test_a_recording_read_at_once_is_one_read_frame_by_frame(creeping, frames) -> None:
    some = slice(0, 20)
    ahead, singles = ff.Reader(creeping), ff.Reader(creeping)
    batch = ahead.read_on(frames[some], covariance=True, times=TIMES[some])
    assert batch.covariance is not None
    for row, one in enumerate(singles.stream(frames[some], times=TIMES[some])):
        assert batch.status[row] is one.status
        np.testing.assert_array_equal(batch.forces[row], one.forces)
        np.testing.assert_array_equal(batch.covariance[row], one.covariance)
    with pytest.raises(InputError, match="time of each frame"):
        ahead.read_on(frames[:1])


def test_uncertain_terms_are_in_the_deviations_and_in_no_unknown(forces) -> None:
    """Shares 20 % off: as_built draws them, and readings state what they do."""
    loose = [{"share": "6 % +/- 20 %", "time": "0.4 s"}, {"share": "4 % +/- 20 %", "time": "15 s"}]
    model = ff.characterize(pad(**{"transducer.relaxation": loose}))
    frames = model.expose(forces, rng=2, as_built=3, times=TIMES)
    batch = ff.Reader(model).read_batch(frames, covariance=False, times=TIMES)
    late = (TIMES > 10) & HELD
    error = np.abs(batch.forces - forces)[late]
    assert (error < 4 * batch.std[late]).all()
    # 1.2 % and, half developed, 0.8 % of 3 N
    assert 0.03 < batch.std[late][:, 12, 0].mean() < 0.07


@pytest.mark.slow
def test_terms_are_found_from_a_pad_that_is_pressed_and_held(creeping) -> None:
    times = np.arange(0.0, 60.0, 0.25)
    loads = np.zeros((len(times), 25, 3))
    loads[:, 12, 0] = 3.0 * np.interp(times, [0, 1, 2, 45, 46, 60], [0, 0, 1, 1, 0.3, 0.3])
    frames = creeping.expose(loads, rng=4, times=times)
    found = ff.find_relaxation(ff.characterize(pad()), frames, loads, times)
    terms, stds = found.sensor.transducer.relaxation, found.sensor.tolerances
    assert len(terms) == 2
    for number, (term, share) in enumerate(zip(terms, (0.06, 0.04), strict=True)):
        std = stds[f"transducer.relaxation.{number}.share"]
        assert abs(term.share - share) < 4 * std < share
    batch = ff.Reader(found).read_batch(frames, covariance=False, times=times)
    error = np.abs(batch.forces - loads)[times > 2, 12, 0]
    assert error.max() < 0.06  # a fifth of what creep adds


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"transducer.compliant.relaxation": TERMS}, "both layers of a pad alike"),
        ({"transducer.relaxation": TERMS, "transducer.strain": "finite"}, "leave .finite. out"),
    ],
)
def test_creep_that_no_model_knows_is_refused(values: dict, words: str) -> None:
    with pytest.raises(DesignError, match=words):
        pad(**values)


def test_what_creeping_frames_need_is_told(creeping) -> None:
    presses = [[ff.Press(x=0.0, y=0.0, normal=1.0, radius=5e-3)]] * 2
    with pytest.raises(InputError, match="model of the drawing"):
        creeping.as_built(0).expose(presses, times=[0.0, 1.0])
    with pytest.raises(InputError, match="list of presses for each"):
        creeping.expose(presses[0], times=[0.0])
    with pytest.raises(InputError, match="frames in a row"):
        creeping.expose(np.zeros((25, 3)), times=[0.0])


def test_commands_simulate_and_read_a_pad_that_creeps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("pad.toml").write_text(pad(**{"transducer.relaxation": TERMS}).to_toml())
    rows = [f"{k},13,{2.0 if k else 0},0,0" for k in range(12)]
    head = "frame,tactel,normal_N,tangential_x_N,tangential_y_N"
    Path("loads.csv").write_text("\n".join([head, *rows]) + "\n")
    run = CliRunner().invoke
    words = ["simulate", "pad.toml", "loads.csv", "-o", "frames.h5", "--fps", "2"]
    done = run(app, words)
    assert done.exit_code == 0, done.output
    done = run(app, ["read", "pad.toml", "frames.h5", "-o", "read.csv"])
    assert done.exit_code == 0, done.output
    table = np.genfromtxt("read.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    mine = table[(table["tactel"] == 13) & (table["frame"] > 0)]
    np.testing.assert_allclose(mine["normal_N"], 2.0, atol=0.05)
