"""The simulated camera shows its script, and counts what nobody collects."""

import time

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.acquisition.cameras.camera import Settings
from fringeforce.acquisition.cameras.simulator import SimulatedCamera
from fringeforce.contacts.fingertip import PERIODS, fingertip_forces


def test_lines_are_those_that_the_model_exposes(model: ff.SensorModel) -> None:
    camera = SimulatedCamera(model, Settings(line_rate=500, block=16), period=0.2, rng=3)
    with camera:
        block = next(iter(camera))
    times = np.arange(100) / 500
    # the script is given in its own time: 0.2 s of the touch
    shown = model.expose(fingertip_forces(times, model.sensor.tactels.positions), rng=3)
    np.testing.assert_array_equal(block.lines, shown[:16])
    np.testing.assert_allclose(np.diff(block.timestamps), 1 / 500, atol=1e-6)


def test_a_late_reader_finds_every_lost_line_counted(model: ff.SensorModel) -> None:
    settings = Settings(line_rate=4000, block=10)
    camera = SimulatedCamera(model, settings, period=0.1, memory=0.02)
    read = dropped = 0
    with camera:
        for block in camera:
            dropped += block.dropped
            assert block.first == read + dropped
            read += len(block.lines)
            if read == 50:
                time.sleep(0.2)
            if read >= 200:
                break
    # 0.2 s at 4,000 lines/s, less the 80 lines that the camera keeps
    assert dropped >= 0.2 * 4000 - 80 - 10


def test_a_reader_in_time_loses_nothing(model: ff.SensorModel) -> None:
    camera = SimulatedCamera(model, Settings(line_rate=2000, block=20), period=0.1, memory=5)
    with camera:
        blocks = [block for block, _ in zip(camera, range(10), strict=False)]
    assert [block.first for block in blocks] == list(range(0, 200, 20))
    assert sum(block.dropped for block in blocks) == 0


def test_slow_lines_do_not_wait_for_a_whole_block(model: ff.SensorModel) -> None:
    sizes = [
        SimulatedCamera(model, settings, period=0.1).block
        for settings in (
            Settings(line_rate=5),
            Settings(line_rate=20),
            Settings(line_rate=1000),
            Settings(line_rate=20, block=16),
        )
    ]
    assert sizes == [1, 2, 64, 16]
    with SimulatedCamera(model, Settings(line_rate=20), period=1.0) as camera:
        block = next(iter(camera))
    assert len(block.lines) == 2


def test_the_forces_behind_a_line_are_known(model: ff.SensorModel) -> None:
    camera = SimulatedCamera(model, Settings(line_rate=100), period=0.5)
    np.testing.assert_array_equal(camera.true_forces(np.array([3, 53])), camera.forces[[3, 3]])


def test_a_touch_is_smooth_and_obeys_friction(sensor: ff.Sensor) -> None:
    t = np.linspace(0, PERIODS[1], 4001)
    forces = fingertip_forces(t, sensor.tactels.positions, force=2.0, friction=0.3)
    np.testing.assert_allclose(forces[0], 0, atol=1e-12)
    np.testing.assert_allclose(forces[-1], 0, atol=1e-12)
    assert forces[..., 0].sum(axis=1).max() == pytest.approx(2.0)
    assert (np.abs(forces[..., 1]) <= 0.3 * forces[..., 0] + 1e-12).all()
    # no jump: a thousandth of the period moves no tactel by more than 2 % of the force
    assert np.abs(np.diff(forces, axis=0)).max() < 0.02
    places = (forces[..., 0] @ sensor.tactels.positions)[[1200, 2800]]
    assert places[0] < 0 < places[1]
