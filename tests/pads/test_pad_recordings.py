"""Recordings, dead pixels and blurred lenses."""

import numpy as np
import pytest
from scipy import stats

import fringeforce as ff
from fringeforce.models.pad import PadModel
from fringeforce.reading.reading import Status

Array = np.ndarray


@pytest.fixture(scope="module")
def reader(model: PadModel) -> ff.Reader:
    return ff.Reader(model)


@pytest.fixture(scope="module")
def forces(model: PadModel) -> Array:
    forces = np.zeros((model.sensor.tactels.total, 3))
    forces[[6, 13]] = [[3, 0.5, 0], [2, 0, -0.6]]
    return forces


def test_a_recording_is_read_as_its_frames_are(
    model: PadModel, reader: ff.Reader, forces: Array
) -> None:
    frames = model.expose([forces * (1 + 0.02 * k) for k in range(4)], rng=0).astype(float)
    frames[2] = np.nan
    done: list[int] = []
    batch = reader.read_batch(frames, covariance=True, progress=done.append)
    readings = list(ff.Reader(model).stream(frames))
    assert len(batch) == sum(done) == 4
    assert batch.covariance is not None
    assert [status.name for status in batch.status] == ["OK", "OK", "BAD_FRAME", "OK"]
    # a bad frame is as if it had not come
    assert batch.tracked.tolist() == [False, True, False, True]
    for k, reading in enumerate(readings):
        np.testing.assert_array_equal(batch.forces[k], reading.forces)
        np.testing.assert_array_equal(batch.std[k], reading.std)
        np.testing.assert_array_equal(batch.covariance[k], reading.covariance)
        assert batch.chi2[k] == pytest.approx(reading.chi2, nan_ok=True)
    assert reader.read_batch(frames[:1], covariance=False).covariance is None
    with pytest.raises(ff.FringeforceError, match="frames, 80, 96"):
        reader.read_batch(frames[0])


def test_dead_pixels_are_left_out(model: PadModel, reader: ff.Reader, forces: Array) -> None:
    rng = np.random.default_rng(1)
    mask = rng.random(model.frame_shape) < 0.03
    mask[:30, 70:] = True
    frame = model.expose(forces, rng)
    frame[mask] = rng.integers(0, 250, mask.sum())
    assert reader.search(frame).status is not Status.OK
    reading = reader.search(frame, mask=mask)
    assert reading.status is Status.OK
    assert reading.chi2 == pytest.approx(1, abs=0.1)
    assert (np.abs(reading.forces - forces) < 5 * reading.std).all()
    # fewer pixels say less
    whole = reader.search(model.expose(forces, 2))
    assert (reading.std > 0.99 * whole.std).all()
    assert reading.std.max() > 1.1 * whole.std.max()
    live = ff.Reader(model)
    searched, followed = (live.read(frame, mask) for _ in range(2))
    np.testing.assert_array_equal(searched.forces, reading.forces)
    assert followed.tracked
    assert (np.abs(followed.forces - forces) < 5 * followed.std).all()


def test_masks_that_do_not_fit_are_refused(model: PadModel, reader: ff.Reader) -> None:
    frame = np.zeros(model.frame_shape)
    for mask in (np.zeros((3, 3)), np.ones(model.frame_shape)):
        with pytest.raises(ff.FringeforceError, match="mask"):
            reader.search(frame, mask=mask)


@pytest.mark.parametrize("blur", ["130 um", "260 um"])
def test_errors_behind_a_blurred_lens_are_those_that_the_covariance_states(
    model: PadModel, forces: Array, blur: str
) -> None:
    blurred = PadModel(model.sensor.replace(camera={"blur": blur}), model.influence)
    reader, distances = ff.Reader(blurred), []
    for seed in range(6):
        reading = reader.search(blurred.expose(forces, seed), start=forces)
        assert reading.status is Status.OK
        apart = (reading.forces - forces).ravel()
        distances.append(apart @ np.linalg.solve(reading.covariance, apart))
    low, high = stats.chi2.ppf([1e-4, 1 - 1e-4], 6 * forces.size)
    assert low < np.sum(distances) < high
