"""Readings: right from one frame, honest in their deviations, and a verdict for everything else."""

import numpy as np
import pytest
from scipy.stats import binom

import fringeforce as ff

N = 11


def random_forces(rng: np.random.Generator, largest: float, n: int = N) -> np.ndarray:
    magnitude = rng.uniform(0, largest, n) * (rng.random(n) < 0.7)
    return ff.polar(magnitude, rng.uniform(-20, 20, n))


@pytest.mark.parametrize("largest", [1, 4, 16])
@pytest.mark.parametrize("edges", ["free", "roller"])
def test_random_loads_come_back_from_one_frame(model, roller_model, edges, largest) -> None:
    sensor = model if edges == "free" else roller_model
    rng, inside, reader = np.random.default_rng(largest), 0, ff.Reader(sensor)
    for _ in range(30):
        forces = random_forces(rng, largest)
        reading = reader.search(sensor.expose(forces, rng=rng))
        explanations = np.concatenate([reading.forces[None], reading.alternatives])
        off = np.abs(explanations - forces) / reading.std
        assert off.max(axis=(1, 2)).min() < 6
        assert reading.chi2 == pytest.approx(1.0, abs=0.2)
        inside += np.count_nonzero(off[0] < 1.96)
    low, high = binom.ppf([1e-4, 1 - 1e-4], 30 * 2 * N, 0.95)
    assert low <= inside <= high


def test_the_phase_of_a_reading_is_that_of_its_forces(model: ff.SensorModel) -> None:
    reading = ff.Reader(model).search(model.expose(ff.polar(2.0, -10, n=N), rng=0))
    np.testing.assert_allclose(reading.phase, model.phase(reading.forces), atol=1e-9)
    assert reading.std == pytest.approx(np.sqrt(np.diag(reading.covariance)).reshape(N, 2))


def test_deviations_of_magnitude_and_angle_are_those_of_scattered_forces(model) -> None:
    reading = ff.Reader(model).search(model.expose(ff.polar(2.0, -10, n=N), rng=0))
    rng = np.random.default_rng(0)
    drawn = rng.multivariate_normal(reading.forces.ravel(), reading.covariance, 4000)
    normal, tangential = drawn.reshape(-1, N, 2).transpose(2, 0, 1)
    found = np.hypot(normal, tangential).std(axis=0)
    np.testing.assert_allclose(reading.magnitude_std, found, rtol=0.08)
    found = np.degrees(np.arctan2(tangential, normal)).std(axis=0)
    np.testing.assert_allclose(reading.angle_std, found, rtol=0.08)


def test_silence_is_no_contact(model: ff.SensorModel) -> None:
    for seed in range(10):
        reading = ff.Reader(model).search(model.expose(np.zeros((N, 2)), rng=seed))
        assert reading.status is ff.Status.NO_CONTACT
        assert (np.abs(reading.forces) < 4 * reading.std).all()
        assert (reading.magnitude_std > 0).all()
        assert (reading.angle_std == 180).all()


def test_pure_shear_has_two_explanations_and_both_are_given(model: ff.SensorModel) -> None:
    forces = np.tile([0.0, 0.8], (N, 1))
    reading = ff.Reader(model).search(model.expose(forces, rng=0))
    assert reading.status is ff.Status.AMBIGUOUS
    both = np.concatenate([reading.forces[None], reading.alternatives])
    off = np.abs(both - forces).max(axis=(1, 2)) / reading.std.max()
    assert off.min() < 4


@pytest.mark.parametrize(
    ("frame", "words"),
    [
        (np.zeros(7), "(7,)"),
        (np.zeros((2, 2048)), "(2, 2048)"),
        (np.full(2048, np.nan), "2048 pixels are not a number"),
        (np.full(2048, 33), "All pixels are 33"),
        (np.linspace(-5, 100, 2048), "-5"),
        (np.linspace(0, 300, 2048), "300"),
        ("no frame", "grey levels"),
    ],
)
def test_a_broken_frame_is_a_reading_and_no_error(model, frame, words) -> None:
    reading = ff.Reader(model).search(frame)
    assert reading.status is ff.Status.BAD_FRAME
    assert words in reading.advice
    assert np.isnan(reading.forces).all()


def test_a_foreign_pattern_is_a_mismatch(model: ff.SensorModel) -> None:
    x = np.linspace(0, 1, 2048)
    frame = np.rint(127 + 100 * np.sin(40 * x + 20 * x**2))
    assert ff.Reader(model).search(frame).status is ff.Status.MODEL_MISMATCH


def test_an_overexposed_frame_is_saturated(model: ff.SensorModel) -> None:
    light = model.intensity(ff.polar(3.0, 10, n=N))
    frame = np.clip(400 * light + 5, 0, 255)
    assert ff.Reader(model).search(frame).status is ff.Status.SATURATED


@pytest.fixture(scope="module")
def coarse(model: ff.SensorModel) -> ff.SensorModel:
    return ff.characterize(model.sensor.replace(**{"camera.pixels": 256}))


@pytest.mark.parametrize("newtons", [1, 4, 14])
def test_a_camera_of_few_pixels_is_read_too(coarse: ff.SensorModel, newtons: float) -> None:
    rng = np.random.default_rng(2)
    for _ in range(4):
        forces = newtons * ff.polar(rng.uniform(0.5, 1, N), rng.uniform(-20, 20, N), n=N)
        reading = ff.Reader(coarse).search(coarse.expose(forces, rng=rng))
        assert reading.status is ff.Status.OK
        assert (np.abs(reading.forces - forces) < 6 * reading.std).all()


def test_fringes_finer_than_pixels_are_said_to_be(coarse: ff.SensorModel) -> None:
    fine = ff.characterize(coarse.sensor.replace(**{"camera.pixels": 4096}))
    # a pixel sees the mean of the light over its width
    light = fine.intensity(ff.polar(30.0, 10, n=N)).reshape(256, 16).mean(axis=1)
    noise = np.random.default_rng(0).uniform(-5, 5, 256)
    frame = np.clip(np.rint(245 * light + 5 + noise), 0, 255)
    assert ff.Reader(coarse).search(frame).status is ff.Status.FRINGES_TOO_DENSE


def test_dead_pixels_cost_nothing_but_themselves(model: ff.SensorModel) -> None:
    rng = np.random.default_rng(5)
    forces = random_forces(rng, 3.0)
    frame = model.expose(forces, rng=rng)
    where = rng.choice(2048, 20, replace=False)
    frame[where] = rng.choice([0, 255], 20)
    reading = ff.Reader(model).search(frame)
    assert reading.status is ff.Status.OK
    assert (np.abs(reading.forces - forces) < 5 * reading.std).all()


@pytest.mark.parametrize("newtons", [1, 4, 12])
@pytest.mark.parametrize("first", [420, 900, 1400])
def test_a_wide_mask_hides_no_force(model: ff.SensorModel, newtons: float, first: int) -> None:
    rng = np.random.default_rng(first)
    forces = newtons * ff.polar(rng.uniform(0.3, 1, 11), rng.uniform(-20, 20, 11), n=11)
    mask = np.zeros(2048, dtype=bool)
    mask[first : first + 150] = True
    reading = ff.Reader(model).search(model.expose(forces, rng=rng), mask)
    assert reading.status is ff.Status.OK
    assert (np.abs(reading.forces - forces) < 6 * reading.std).all()


def test_masked_pixels_are_not_looked_at(model: ff.SensorModel) -> None:
    forces = ff.polar(1.0, 10, n=N)
    frame = model.expose(forces, rng=0).astype(float)
    mask = np.zeros(2048, dtype=bool)
    mask[300:500] = True
    frame[mask] = np.nan
    reading = ff.Reader(model).search(frame, mask)
    assert reading.status is ff.Status.OK
    assert (np.abs(reading.forces - forces) < 5 * reading.std).all()
    whole = ff.Reader(model).search(model.expose(forces, rng=0))
    assert reading.std.max() > whole.std.max()
    with pytest.raises(ff.FringeforceError, match="2048"):
        ff.Reader(model).search(frame, np.ones(2048, dtype=bool))


def test_a_model_with_errors_of_shape_gives_itself_away(model: ff.SensorModel) -> None:
    wave = 1 + 0.03 * np.sin(2 * np.pi * model.x[:, None, None] / 5e-3 + np.arange(N)[:, None])
    true = ff.SensorModel(model.sensor, model.breaks, model.psi * wave, {})
    frame = true.expose(ff.polar(2.0, 10, n=N), rng=0)
    assert ff.Reader(model).search(frame).status is ff.Status.MODEL_MISMATCH


def test_a_friction_of_nothing_is_refused(model: ff.SensorModel) -> None:
    with pytest.raises(ff.FringeforceError, match="must be"):
        ff.Reader(model, friction=0.0)


def test_the_bound_of_a_frame_is_that_of_its_derivatives(model: ff.SensorModel) -> None:
    forces = ff.polar(1.0, 10, n=N)
    camera, step = model.sensor.camera, 1e-5
    moves = step * np.eye(forces.size).reshape(-1, *forces.shape)
    slopes = (model.intensity(forces + moves) - model.intensity(forces - moves)) / (2 * step)
    jacobian = camera.amplitude * slopes
    # uniform noise of a half width, and the rounding of the converter
    variance = camera.noise**2 / 3 + 1 / 12
    fisher = jacobian @ jacobian.T / variance
    expected = np.sqrt(np.diag(np.linalg.inv(fisher))).reshape(forces.shape)
    np.testing.assert_allclose(ff.Reader(model).bound(forces), expected, rtol=1e-4)


def test_a_strip_takes_no_start(model: ff.SensorModel) -> None:
    forces = ff.polar(1.0, 10, n=N)
    with pytest.raises(ff.FringeforceError, match="start is for pads"):
        ff.Reader(model).search(model.expose(forces, rng=0), start=forces)
