"""Frames of a camera whose converter cuts the bright fringes off."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.base.errors import DesignError
from fringeforce.reading.strip_reader import StripFrameReader


@pytest.mark.parametrize("amplitude", [280.0, 340.0])
def test_an_overexposed_strip_is_read(amplitude: float) -> None:
    light = {"camera.amplitude": amplitude, "camera.noise": 3.0, "camera.noise_model": "gaussian"}
    design = ff.load_sensor("saad").replace(**{**light, "camera.clipped": True})
    model, rng = ff.characterize(design), np.random.default_rng(1)
    reader, squares = ff.Reader(model), []
    for number in range(12):
        forces = rng.uniform(0.1, 1.2, (11, 1)) * [1.0, 0.3]
        frame = model.expose(forces, rng=number)
        assert np.mean(frame == 255) > 0.05
        reading = reader.search(frame)
        assert reading.status is ff.Status.OK
        error = (reading.forces - forces).ravel()
        squares.append(error @ np.linalg.solve(reading.covariance, error))
    # sums of 264 unit squares lie in 198 .. 343 in 99.9 of 100 cases (chi-square)
    assert 198 < np.sum(squares) < 343


def test_overexposed_frames_are_followed_without_a_search(monkeypatch) -> None:
    light = {"camera.amplitude": 280.0, "camera.noise": 3.0, "camera.clipped": True}
    model = ff.characterize(ff.load_sensor("saad").replace(**light))
    reader, rng, alone = ff.Reader(model), np.random.default_rng(2), list[int]()
    searched = StripFrameReader.followed

    def counted(*arguments, **words):
        alone.append(1)
        return searched(*arguments, **words)

    monkeypatch.setattr(StripFrameReader, "followed", counted)
    forces = rng.uniform(0.3, 1.2, (11, 1)) * [1.0, 0.3]
    moving = forces * (1 + 1e-4 * np.arange(60))[:, None, None]
    frames = model.expose(moving, rng)
    assert np.mean(frames == 255) > 0.03
    batch = reader.read_on(frames)
    assert (batch.status == ff.Status.OK).all()
    assert len(alone) < 6
    assert np.mean(np.abs(batch.forces - moving) < 2 * batch.std) > 0.9


def test_a_design_must_say_that_its_camera_is_overexposed() -> None:
    with pytest.raises(DesignError, match="clipped = true"):
        ff.load_sensor("saad").replace(**{"camera.amplitude": 280.0})
