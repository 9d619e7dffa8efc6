"""Readers, models and readings travel between threads and processes and stay the same."""

import copy
import os
import pickle
import signal
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.reading.diagnosis import Diagnosis


@pytest.fixture(scope="module")
def frames(model: ff.SensorModel) -> np.ndarray:
    """Sixteen frames of a load that grows slowly."""
    shares = np.linspace(1.0, 1.1, 16)[:, None, None]
    return model.expose(shares * ff.polar(1.0, 10, n=11), rng=0)


def test_sensors_are_equal_whatever_was_computed_from_them(sensor: ff.Sensor) -> None:
    other = ff.load_sensor("saad")
    assert len(other.pixel_positions) == len(sensor.pixel_positions)
    assert sensor == other
    assert hash(sensor) == hash(other)
    assert pickle.loads(pickle.dumps(sensor)) == sensor
    assert sensor != sensor.replace(**{"camera.noise": 3})


def test_what_was_pickled_reads_the_same(model: ff.SensorModel, frames: np.ndarray) -> None:
    reader = ff.Reader(model)
    for frame in frames[:4]:
        reader.read(frame)
    copies: list[Any] = [pickle.loads(pickle.dumps(one)) for one in (model, reader)]
    expected = reader.read(frames[4])
    found = copies[1].read(frames[4])
    assert found.tracked
    np.testing.assert_array_equal(found.forces, expected.forces)
    np.testing.assert_array_equal(found.std, expected.std)
    alone = ff.Reader(copies[0]).read(frames[4])
    np.testing.assert_array_equal(alone.forces, ff.Reader(model).read(frames[4]).forces)


@pytest.mark.parametrize("kind", ["tactels", "skin", "relaxing", "unexplained", "bad"])
def test_a_pickled_reading_holds_its_numbers_and_nothing_else(
    model: ff.SensorModel, frames: np.ndarray, kind: str
) -> None:
    frame, time = frames[0], None
    if kind == "skin":
        model = ff.characterize(ff.load_sensor("skin").replace(**{"camera.pixels": 512}))
        frame = model.expose([ff.Press(x=1e-3, normal=0.7, radius=5e-3)], rng=0)
    elif kind == "relaxing":
        relaxing = model.sensor.replace(**{"transducer.relaxation": [(0.06, 0.4)]})
        model, time = ff.characterize(relaxing), 0.0
    elif kind == "unexplained":
        frame = np.roll(frame, 12)  # 0.3 mm beside the sensor
    elif kind == "bad":
        frame = np.zeros_like(frame)
    good = ff.Reader(model).read(frame, time=time)
    assert len(good.findings) == (kind == "unexplained")
    written = pickle.dumps(good)
    found = pickle.loads(written)
    for name in ("forces", "std", "covariance", "phase", "chi2", "alternatives"):
        np.testing.assert_array_equal(getattr(found, name), getattr(good, name), err_msg=name)
    assert (found.status, found.advice, str(found)) == (good.status, good.advice, str(good))
    assert found.findings == good.findings
    assert (good.status is ff.Status.MODEL_MISMATCH) == (kind == "unexplained")
    assert len(written) < 2 * (good.covariance.nbytes + good.phase.nbytes) + 20_000


def test_copies_of_a_refused_reading_wait_for_its_findings(
    model: ff.SensorModel, frames: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    reader, asked = ff.Reader(model), []
    found = Diagnosis.findings
    monkeypatch.setattr(
        Diagnosis, "findings", lambda *args: (asked.append("once"), found(*args))[1]
    )
    moved = reader.read(np.roll(frames[0], 12))  # 0.3 mm beside the sensor
    copies = copy.copy(moved), copy.deepcopy(moved), copy.deepcopy(copy.deepcopy(moved))
    written = pickle.loads(pickle.dumps(moved))
    assert not asked
    (said,) = written.findings
    assert "had not been asked for" in said
    assert said in written.advice
    good = moved.findings
    assert good != written.findings
    for one in copies:
        assert one.findings == good
        np.testing.assert_array_equal(one.forces, moved.forces)
    assert len(asked) == 4
    assert pickle.loads(pickle.dumps(moved)).findings == good
    assert not np.shares_memory(copies[1].covariance, moved.covariance)


def test_threads_on_one_reader_find_what_one_thread_does(
    model: ff.SensorModel, frames: np.ndarray
) -> None:
    reader = ff.Reader(model)
    expected = [reader.search(frame).forces for frame in frames]
    with ThreadPoolExecutor(4) as pool:
        searched = list(pool.map(reader.search, frames))
        followed = list(pool.map(reader.read, np.repeat(frames, 8, axis=0)))
    np.testing.assert_array_equal([one.forces for one in searched], expected)
    assert all(one.status is ff.Status.OK for one in followed)
    off = [
        np.abs(one.forces - truth) / one.std
        for one, truth in zip(followed, np.repeat(expected, 8, axis=0), strict=True)
    ]
    assert np.max(off) < 5


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_fork_reads_on(model: ff.SensorModel, frames: np.ndarray) -> None:
    reader = ff.Reader(model)
    expected = reader.search(frames[0]).forces
    if (child := os.fork()) == 0:
        try:
            os._exit(int(not np.array_equal(reader.search(frames[0]).forces, expected)))
        finally:
            os._exit(2)
    assert os.waitpid(child, 0)[1] == 0


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_fork_does_not_wait_for_a_thread_that_it_has_not(
    model: ff.SensorModel, frames: np.ndarray
) -> None:
    reader = ff.Reader(model)
    expected = reader.read(frames[0]).forces
    holding, done = threading.Event(), threading.Event()

    def hold() -> None:
        with reader._turn:
            holding.set()
            done.wait()

    thread = threading.Thread(target=hold)
    thread.start()
    holding.wait()
    if (child := os.fork()) == 0:
        signal.alarm(30)  # ends the process if it waits
        try:
            os._exit(int(not np.array_equal(reader.read(frames[0]).forces, expected)))
        finally:
            os._exit(2)
    status = os.waitpid(child, 0)[1]
    done.set()
    thread.join()
    assert status == 0
