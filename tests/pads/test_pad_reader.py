"""Readings of single frames and of sequences, against the loads behind them."""

import numpy as np
import pytest
from scipy import stats

import fringeforce as ff
from fringeforce.contacts.resultant import touch
from fringeforce.models.pad import PadModel
from fringeforce.reading.reading import Status

Array = np.ndarray


@pytest.fixture(scope="module")
def reader(model: PadModel) -> ff.Reader:
    return ff.Reader(model)


def pressed(n: int, **tactels: list[float]) -> Array:
    forces = np.zeros((n, 3))
    for name, force in tactels.items():
        forces[int(name[1:])] = force
    return forces


@pytest.fixture(scope="module")
def forces(model: PadModel) -> Array:
    """Two contacts, with half a fringe more than a quarter wave between them."""
    return pressed(model.sensor.tactels.total, t1=[2, 0.5, 0], t14=[3, 0, -1], t15=[1, 0.2, 0.3])


def test_a_frame_is_read_within_its_own_deviations(
    model: PadModel, reader: ff.Reader, forces: Array
) -> None:
    assert np.hypot(*model.retardance(forces)).max() > np.pi / 2
    for seed in range(3):
        reading = reader.search(model.expose(forces, seed))
        assert reading.status is Status.OK
        assert reading.chi2 == pytest.approx(1, abs=0.1)
        assert (np.abs(reading.forces - forces) < 5 * reading.std).all()


def test_errors_are_those_that_the_covariance_states(
    model: PadModel, reader: ff.Reader, forces: Array
) -> None:
    start = reader.search(model.expose(forces, 0))
    distances = []
    for seed in range(1, 13):
        reading = reader.search(model.expose(forces, seed), start=start.forces)
        apart = (reading.forces - forces).ravel()
        distances.append(apart @ np.linalg.solve(reading.covariance, apart))
    # a sum of squares of 60 standard normal numbers each, from 12 frames
    low, high = stats.chi2.ppf([1e-4, 1 - 1e-4], 12 * forces.size)
    assert low < np.sum(distances) < high


def test_a_frame_that_follows_is_read_from_the_last(
    model: PadModel, reader: ff.Reader, forces: Array
) -> None:
    steps = [forces * (1 + 0.03 * k) for k in range(4)]
    frames = [model.expose(step, k) for k, step in enumerate(steps)]
    readings = list(ff.Reader(model).stream(frames))
    assert [reading.tracked for reading in readings] == [False, True, True, True]
    for reading, step in zip(readings, steps, strict=True):
        assert reading.status is Status.OK
        assert (np.abs(reading.forces - step) < 5 * reading.std).all()


def test_strong_contacts_that_follow_are_read_as_well_as_the_covariance_states() -> None:
    model = ff.characterize(ff.load_sensor("pad"))
    reader, rng = ff.Reader(model), np.random.default_rng(1)
    distances, frames = [], 12
    for frame in range(frames + 1):
        push = 8 + 0.3 * frame
        forces = np.zeros((model.sensor.tactels.total, 3))
        forces[60], forces[63] = [push, 0.2 * push, 0], [push / 2, 0, 0.1 * push]
        reading = reader.read(model.expose(forces, rng))
        assert reading.status is Status.OK
        apart = (reading.forces - forces).ravel()
        distances.append(apart @ np.linalg.solve(reading.covariance, apart))
    assert reading.tracked
    low, high = stats.chi2(frames * forces.size).ppf([1e-4, 1 - 1e-4])
    assert low < np.sum(distances[1:]) < high


def test_another_contact_than_the_last_is_searched(
    model: PadModel, reader: ff.Reader, forces: Array
) -> None:
    elsewhere = pressed(len(forces), t8=[3, -0.5, 0.5])
    readings = list(ff.Reader(model).stream([model.expose(forces, 0), model.expose(elsewhere, 1)]))
    assert readings[1].status is Status.OK
    assert (np.abs(readings[1].forces - elsewhere) < 5 * readings[1].std).all()


def test_verdicts_on_what_is_no_load(model: PadModel, reader: ff.Reader, forces: Array) -> None:
    nothing = np.zeros_like(forces)
    assert reader.search(model.expose(nothing, 0)).status is Status.NO_CONTACT
    frame = model.expose(forces, 0)
    assert reader.search(frame[:, ::-1]).status is Status.MODEL_MISMATCH
    assert reader.search(np.random.default_rng(0).integers(0, 250, frame.shape)).status in (
        Status.MODEL_MISMATCH,
        Status.FRINGES_TOO_DENSE,
    )
    bright = np.clip(2.0 * frame, 0, 255)
    assert reader.search(bright).status is Status.SATURATED
    for bad in (
        frame[:-1],
        np.full(frame.shape, np.nan),
        np.full(frame.shape, 7),
        300.0 + frame,
        "x",
    ):
        reading = reader.search(bad)
        assert reading.status is Status.BAD_FRAME
        assert reading.detail


def test_a_dark_field_alone_needs_a_start(model: PadModel, forces: Array) -> None:
    dark = PadModel(model.sensor.replace(**{"camera.kind": "ordinary"}), model.influence)
    frame = dark.expose(forces, 0)
    with pytest.raises(ff.FringeforceError, match="polarisation camera"):
        ff.Reader(dark).search(frame)
    reading = ff.Reader(dark).search(frame, start=forces * 1.02)
    assert reading.status is Status.OK
    assert (np.abs(reading.forces - forces) < 6 * reading.std).all()


def test_two_analysers_before_an_ordinary_camera_read_as_well(
    model: PadModel, forces: Array
) -> None:
    channels = [{"arrangement": "analyser", "angle": angle} for angle in (0.0, 45.0)]
    pad = model.sensor.replace(**{"camera.kind": "ordinary", "polariscope.channels": channels})
    two = PadModel(pad, model.influence)
    frame = two.expose(forces, 0)
    assert frame.shape == (2, 80, 96)
    reading = ff.Reader(two).search(frame)
    assert reading.status is Status.OK
    assert (np.abs(reading.forces - forces) < 5 * reading.std).all()


def test_patches_sum_up_what_each_contact_does(
    model: PadModel, reader: ff.Reader, forces: Array
) -> None:
    pad, reading = model.sensor, reader.search(model.expose(forces, 0))
    found = touch(pad, reading)
    assert not np.any(found.silent & (np.abs(forces).sum(axis=1) > 0))
    assert [patch.tactels.tolist() for patch in found.patches] == [[14, 15], [1]]
    strong = found.patches[0]
    true = forces[[14, 15]]
    apart = strong.force - true.sum(axis=0)
    assert apart @ np.linalg.solve(strong.force_covariance, apart) < 30
    centre = true[:, 0] @ pad.tactels.places[[14, 15]] / true[:, 0].sum()
    apart = strong.centre - centre
    assert (np.abs(apart) < 5 * np.sqrt(np.diag(strong.centre_covariance)) + 1e-12).all()
    ratio = np.hypot(*true.sum(axis=0)[1:]) / true[:, 0].sum()
    assert abs(strong.slip_ratio - ratio) < 5 * strong.slip_ratio_std
    lever = np.column_stack([pad.tactels.places, np.zeros(len(forces))])
    moment = np.cross(lever, forces[:, [1, 2, 0]] * [1, 1, -1]).sum(axis=0)
    apart = np.abs(found.total.moment - moment)
    assert (apart < 5 * np.sqrt(np.diag(found.total.moment_covariance))).all()
    # knowing where nothing touches makes the sum more certain
    assert found.total.force_covariance[0, 0] < reading.covariance[::3, ::3].sum()


def test_magnitude_and_angle_are_those_of_many_drawn_forces() -> None:
    rng = np.random.default_rng(3)
    forces = np.array([[2.0, 0.6, -0.3], [1.0, 0.0, 0.8], [0.5, -0.4, 0.1]])
    root = 0.01 * rng.normal(size=(9, 9))
    reading = ff.Reading.of(
        forces, 1.0, Status.OK, covariance=root @ root.T, phase=np.empty((2, 0, 0))
    )
    drawn = forces + (rng.normal(size=(100_000, 9)) @ root.T).reshape(-1, 3, 3)
    size = np.linalg.norm(drawn, axis=2)
    angle = np.degrees(np.arccos(drawn[..., 0] / size))
    for value, std, sample in (
        (reading.magnitude, reading.magnitude_std, size),
        (reading.angle, reading.angle_std, angle),
    ):
        np.testing.assert_allclose(value, sample.mean(axis=0), rtol=0.01)
        np.testing.assert_allclose(std, sample.std(axis=0), rtol=0.03)


def test_what_belongs_to_strips_is_refused(model: PadModel) -> None:
    with pytest.raises(ff.FringeforceError, match="strips"):
        ff.Reader(model, friction=0.5)
