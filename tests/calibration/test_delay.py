"""Delays of logs against frames, without a model of the sensor."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.calibration.delay import coarse_delay
from fringeforce.calibration.load_log import LoadLog, load_log

RATE, FRAMES, DELAY = 50.0, 400, 0.35
REST = 1.5
"""Times the log begins before the frames, and ends after them [s]."""


@pytest.fixture(scope="module")
def model() -> ff.SensorModel:
    return ff.characterize(ff.load_sensor("skin").replace(**{"camera.pixels": 512}))


def pressing(t: np.ndarray) -> tuple[np.ndarray, ...]:
    """Presses of 1.6 s at random places: up in 0.24 s, held, down again."""
    number, phase = np.divmod(t - t.min(), 1.6)
    rng = np.random.default_rng(0)
    places, sizes = rng.uniform(-5e-3, 5e-3, 50), rng.uniform(0.5, 3.0, 50)
    ramp = np.clip(np.minimum(phase - 0.3, 1.3 - phase) / 0.24, 0, 1)
    normal = sizes[number.astype(int)] * ramp
    return places[number.astype(int)], normal, 0.2 * normal * np.sin(7 * t)


def once(t: np.ndarray) -> tuple[np.ndarray, ...]:
    """One press, put on and taken off at a stroke between two frames."""
    normal = np.where((t > 2.013) & (t < 5.508), 2.0, 0.0)
    return np.full(t.shape, 1e-3), normal, 0.1 * normal


def moving(t: np.ndarray) -> tuple[np.ndarray, ...]:
    """An indenter that slides back and forth and never leaves."""
    return 4e-3 * np.sin(1.3 * t + 0.5), 1.5 + 0.8 * np.sin(2.1 * t), 0.3 * np.cos(3.1 * t)


def bench(model: ff.SensorModel, path, delay: float) -> tuple[LoadLog, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    times = np.arange(FRAMES) / RATE
    moments = np.arange(-REST, FRAMES / RATE + REST, 0.01)
    x, normal, tangential = path(np.concatenate([moments, times]))
    presses = [
        [ff.Press(x=a, normal=n, tangential=t, width=0.4e-3)] if n > 1e-3 else []
        for a, n, t in zip(x, normal, np.clip(tangential, -normal / 2, normal / 2), strict=True)
    ]
    frames = model.expose(presses[len(moments) :], rng=rng)
    forces = np.stack([normal, tangential], axis=1)[: len(moments)]
    noisy = forces + rng.normal(0, 0.02, forces.shape)
    return load_log(moments + delay, x[: len(moments)], noisy), times, frames


@pytest.mark.slow
@pytest.mark.parametrize("path", [pressing, once, moving])
@pytest.mark.parametrize("delay", [DELAY, -1.2])
def test_a_delay_is_found_within_half_a_frame(model: ff.SensorModel, path, delay: float) -> None:
    log, times, frames = bench(model, path, delay)
    assert abs(coarse_delay(log, times, frames) - delay) <= 0.5 / RATE


@pytest.mark.parametrize("ramp", [0.02, 0.5])
@pytest.mark.parametrize("delay", [0.36, -0.6])
def test_a_single_press_is_not_taken_for_its_release(ramp: float, delay: float) -> None:
    """Grey levels that go with the force: the right delay is the one of which most is seen."""
    t = np.arange(0, 4, 1 / RATE)
    force = np.interp(t, [1, 1 + ramp, 2.5, 2.5 + ramp], [0, 1, 1, 0])
    log = load_log(t + delay, np.zeros(len(t)), np.stack([force, 0 * force], axis=1))
    frames = force[:, None] * [10.0, 80.0, 30.0]
    assert coarse_delay(log, t, frames) == pytest.approx(delay, abs=0.5 / RATE)


@pytest.mark.slow
def test_long_recordings_and_images_are_no_harder(model: ff.SensorModel) -> None:
    log, times, frames = bench(model, pressing, DELAY)
    gap = FRAMES / RATE + REST
    twice = np.concatenate([times, times + gap])
    moments = np.concatenate([log.times, log.times + gap])
    first = np.unique(moments, return_index=True)[1]
    both = load_log(
        moments[first],
        np.tile(log.places[:, 0], 2)[first],
        np.tile(log.forces[:, 0], (2, 1))[first],
    )
    images = np.tile(frames, (2, 1)).reshape(-1, 16, 32)
    assert abs(coarse_delay(both, twice, images) - DELAY) <= 0.5 / RATE


def test_what_says_nothing_of_time_is_refused() -> None:
    times, still = np.arange(5) / RATE, np.zeros((5, 3))
    frames = np.arange(15.0).reshape(5, 3)
    flat = load_log([0, 1], [0, 0], np.ones((2, 2)))
    with pytest.raises(ff.FringeforceError, match="Nothing changes"):
        coarse_delay(flat, times, frames)
    rising = load_log([0, 1], [0, 0], [(0, 0), (1, 0)])
    with pytest.raises(ff.FringeforceError, match="Nothing changes"):
        coarse_delay(rising, times, still)
    with pytest.raises(ff.FringeforceError, match="4 times do not fit 5 frames"):
        coarse_delay(rising, times[1:], frames)
    with pytest.raises(ff.FringeforceError, match="one clock"):
        coarse_delay(rising, times + 1.7e9, frames)
