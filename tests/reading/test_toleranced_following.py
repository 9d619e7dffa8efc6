"""Followed frames of a strip with tolerances: honest, the same one by one, and never lost."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm

import fringeforce as ff
from uncertain_strip import TOLERANCES, slow_motion

Array = NDArray[np.float64]
TOUCHES, FRAMES = 12, 60


@pytest.fixture(scope="module")
def uncertain(sensor: ff.Sensor) -> ff.SensorModel:
    return ff.characterize(sensor.replace(**TOLERANCES))


@pytest.fixture(scope="module")
def touches(uncertain: ff.SensorModel) -> list[tuple[Array, ff.Batch]]:
    """Forces and readings of several touches on sensors of their own."""
    found, reader = [], ff.Reader(uncertain)
    for seed in range(TOUCHES):
        forces, frames = slow_motion(uncertain, FRAMES, seed)
        reader.reset()
        found.append((forces, reader.read_on(frames, covariance=True)))
    return found


def test_slow_motion_is_followed(touches) -> None:
    tracked = np.array([batch.tracked for _, batch in touches])
    assert not tracked[:, 0].any()
    assert tracked[:, 1:].mean() > 0.9


def test_deviations_of_followed_frames_are_honest(touches) -> None:
    inside, squares = [], []
    for forces, batch in touches:
        followed = batch.tracked & (batch.status == ff.Status.OK)
        off = (batch.forces - forces)[followed]
        inside.append(np.mean(np.abs(off) < norm.ppf(0.975) * batch.std[followed]))
        assert batch.covariance is not None
        solved = np.linalg.solve(batch.covariance[followed], off.reshape(len(off), -1, 1))
        squares.append(np.mean((off.reshape(len(off), 1, -1) @ solved) / off[0].size))
    # errors of what lasts are shared by the frames of a touch: only touches count
    assert np.mean(inside) > 0.95 - 3 * np.std(inside) / np.sqrt(TOUCHES) - 0.03
    assert np.mean(squares) < 1 + 3 * np.std(squares) / np.sqrt(TOUCHES)
    assert np.mean(squares) > 0.5


def test_frames_one_by_one_read_as_all_at_once(uncertain, touches) -> None:
    _, frames = slow_motion(uncertain, FRAMES, 0)
    batch, reader = touches[0][1], ff.Reader(uncertain)
    for i, frame in enumerate(frames[:20]):
        reading = reader.read(frame)
        assert reading.tracked == batch.tracked[i]
        assert reading.status == batch.status[i]
        np.testing.assert_allclose(reading.forces, batch.forces[i], atol=1e-6)
        np.testing.assert_allclose(reading.std, batch.std[i], rtol=1e-6)
        assert reading.probability > 0.999


def test_errors_of_scale_grow_with_loads_that_follow(sensor: ff.Sensor) -> None:
    soft = {"transducer.photoelastic.youngs_modulus": "110 MPa +/- 5 %"}
    model = ff.characterize(sensor.replace(**soft))
    reader, rng = ff.Reader(model), np.random.default_rng(4)
    forces = rng.uniform(0.5, 1.5, (11, 1)) * [1.0, 0.2]
    slow = 1 + 1e-3 * np.arange(20)[:, None, None]
    batch = reader.read_on(model.expose(slow * forces, rng), covariance=True)
    assert batch.covariance is not None
    assert batch.tracked[1:].all()
    before, after = (forces.ravel() @ c @ forces.ravel() for c in batch.covariance[[1, -1]])
    # nothing but the modulus matters for the size of all forces together: 5 %, less what is told
    assert after / before == pytest.approx((slow[-1] / slow[1]).item() ** 2, rel=3e-3)


def test_a_jump_is_searched_and_followed_from_there(uncertain) -> None:
    (_, first), (forces, second) = (slow_motion(uncertain, 4, seed) for seed in (0, 1))
    batch = ff.Reader(uncertain).read_on(np.concatenate([first, second]))
    assert batch.tracked.tolist() == [False, True, True, True, False, True, True, True]
    off = np.abs(batch.forces[4:] - forces)
    assert (off < 6 * batch.std[4:]).all()


def test_a_released_sensor_is_no_contact(uncertain) -> None:
    _, frames = slow_motion(uncertain, 3, 2)
    nothing = uncertain.expose(np.zeros((2, 11, 2)), rng=1)
    batch = ff.Reader(uncertain).read_on(np.concatenate([frames, nothing]))
    assert [status.name for status in batch.status[3:]] == ["NO_CONTACT", "NO_CONTACT"]
    assert batch.tracked[3:].tolist() == [False, True]


def test_masked_pixels_do_not_count(uncertain) -> None:
    _, frames = slow_motion(uncertain, 4, 3)
    mask = np.zeros(uncertain.frame_shape, bool)
    mask[300:330] = True
    spoilt = frames.copy()
    spoilt[:, 300:330] = 17
    reader = ff.Reader(uncertain)
    batch = reader.read_on(spoilt, mask=mask)
    assert batch.tracked[1:].all()
    reader.reset()
    again = reader.read_on(frames, mask=mask)
    np.testing.assert_allclose(batch.forces, again.forces, atol=1e-6)
