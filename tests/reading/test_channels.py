"""Several pictures of one strip: bounds from the literature of interferometry, and readings."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fringeforce as ff
from fringeforce.base.errors import FileFormatError
from fringeforce.contacts.loads import polar
from fringeforce.estimation.bounds import cramer_rao_bound
from fringeforce.io.frames import load_frames, save_frames
from fringeforce.optics.camera import noise_variance

N, FRAMES = 11, 60
ARRANGEMENTS = {
    "dark field": [{}],
    "quarter-wave bias": [{"bias": 90}],
    "dark and bright field": [{}, {"bias": 180}],
    "quadrature": [{}, {"bias": 90}],
    "three colours": [{}, {"wavelength": "532 nm"}, {"wavelength": "450 nm"}],
    "four orientations": [{"bias": bias} for bias in (0, 90, 180, 270)],
}
PLATES = {"retardance_error": 4.0, "angle_error": 1.5, "extinction_ratio": 0.01}


@pytest.fixture(scope="module")
def models(sensor: ff.Sensor) -> dict[str, ff.SensorModel]:
    return {
        name: ff.characterize(sensor.replace(**{"polariscope.channels": channels}))
        for name, channels in ARRANGEMENTS.items()
    }


def contacts(rng: np.random.Generator, count: int) -> np.ndarray:
    size, angle = rng.uniform(0, 3, (count, N)), np.radians(rng.uniform(-20, 20, (count, N)))
    return np.stack([size * np.cos(angle), size * np.sin(angle)], axis=2)


def bound(model: ff.SensorModel, forces: np.ndarray) -> np.ndarray:
    psi = model.frame_influence
    return cramer_rao_bound(psi @ forces.ravel(), psi, model.response).reshape(N, 2)


@pytest.mark.parametrize("name", ARRANGEMENTS)
def test_readings_scatter_as_the_bound_of_the_arrangement_predicts(models, name) -> None:
    model, rng = models[name], np.random.default_rng(1)
    reader = ff.Reader(model)
    off, bounds, inside = [], [], []
    for load in contacts(rng, FRAMES):
        reading = reader.search(model.expose(load, rng=rng))
        assert reading.status is ff.Status.OK
        assert reading.phase.shape == (model.sensor.camera.pixels,)
        off.append(reading.forces - load)
        bounds.append(bound(model, load))
        inside.append(np.abs(off[-1]) < 1.96 * reading.std)
    # 1,320 forces: the root mean square is known to 3 %
    assert np.sqrt(np.mean(np.square(off)) / np.mean(np.square(bounds))) == pytest.approx(
        1, abs=0.1
    )
    assert 0.92 < np.mean(inside) < 0.98


def test_two_pictures_in_quadrature_do_not_care_where_the_phase_is(models) -> None:
    """sin^2 + cos^2 = 1: information is that of the influence matrix alone."""
    model = models["quadrature"]
    psi = model.pixel_influence.reshape(-1, 2 * N)
    slope = model.sensor.camera.amplitude / 2
    flat = np.sqrt(
        np.diag(np.linalg.inv(psi.T @ psi * slope**2 / noise_variance(model.sensor.camera)))
    )
    for load in contacts(np.random.default_rng(2), 3):
        assert_allclose(bound(model, load).ravel(), flat, rtol=1e-9)


@pytest.mark.parametrize("name", ["quarter-wave bias", "quadrature", "four orientations"])
def test_a_bias_tells_pure_shear_from_its_negative(models, name) -> None:
    model, shear = models[name], np.zeros((N, 2))
    shear[4, 1] = -0.5
    reading = ff.Reader(model).search(model.expose(shear, rng=3))
    assert reading.status is ff.Status.OK
    assert (np.abs(reading.forces - shear) < 5 * reading.std).all()


@pytest.mark.parametrize("name", ["quadrature", "quarter-wave bias"])
def test_a_live_reader_follows_all_channels(models, name) -> None:
    model, rng = models[name], np.random.default_rng(4)
    forces = np.linspace(0.8, 1.2, 30)[:, None, None] * polar(1.0, 10, N)
    frames = model.expose(forces, rng=rng)
    reader = ff.Reader(model)
    readings = list(reader.stream(frames))
    assert np.mean([reading.tracked for reading in readings]) > 0.9
    off = np.array([r.forces - load for r, load in zip(readings, forces, strict=True)])
    deviations = np.array([r.std for r in readings])
    assert np.mean((off / deviations) ** 2) == pytest.approx(1, abs=0.25)
    batch = ff.Reader(model).read_batch(frames)
    assert_allclose(batch.forces, [r.forces for r in readings], atol=0.1 * deviations.max())


def test_wrong_plates_move_bias_and_contrast_and_readings_know(sensor) -> None:
    real = ff.characterize(sensor.replace(**{"polariscope.plates": PLATES}))
    assert (np.asarray(real.response.amplitude) < sensor.camera.amplitude).all()
    load = polar(1.0, 10, N)
    frame = real.expose(load, rng=5)
    assert (
        np.abs(ff.Reader(real).search(frame).forces - load) < 5 * ff.Reader(real).search(frame).std
    ).all()
    assert ff.Reader(ff.characterize(sensor)).search(frame).status is ff.Status.MODEL_MISMATCH


def test_a_design_with_channels_survives_its_text(sensor, tmp_path) -> None:
    channels = ARRANGEMENTS["three colours"]
    rich = sensor.replace(**{"polariscope.channels": channels, "polariscope.plates": PLATES})
    path = tmp_path / "rich.toml"
    path.write_text(rich.to_toml())
    assert ff.load_sensor(path) == rich
    model = ff.characterize(rich)
    model.save(tmp_path / "m.h5")
    assert ff.load_model(tmp_path / "m.h5").sensor == rich
    tables = "".join(f"[[polariscope.channels]]\nbias = {b}\n" for b in (0, 90))
    path.write_text(sensor.to_toml().replace("[camera]", f"{tables}[camera]"))
    assert len(ff.load_sensor(path).polariscope.channels) == 2


def test_frames_of_several_channels_survive_their_file(models, tmp_path) -> None:
    model = models["quadrature"]
    frames = model.expose(contacts(np.random.default_rng(9), 3), rng=9)
    save_frames(tmp_path / "f.h5", frames, model.pixel_positions)
    np.testing.assert_array_equal(load_frames(tmp_path / "f.h5"), frames)
    np.save(tmp_path / "f.npy", frames)
    np.testing.assert_array_equal(load_frames(tmp_path / "f.npy"), frames)
    np.save(tmp_path / "f.npy", frames[None])
    with pytest.raises(
        FileFormatError, match=r"or \(frames, channels, pixels\) of several channels"
    ):
        load_frames(tmp_path / "f.npy")


def test_a_frame_of_another_number_of_channels_is_a_bad_frame(models) -> None:
    frame = models["dark field"].expose(polar(1.0, 10, N), rng=6)
    reading = ff.Reader(models["quadrature"]).search(frame)
    assert reading.status is ff.Status.BAD_FRAME
    assert "(2, 2048)" in reading.advice


@pytest.mark.slow
def test_a_bench_in_quadrature_finds_the_modulus(models) -> None:
    """One picture hardly tells loads where its light is at an extreme; the other does there."""
    model, modulus = models["quadrature"], "transducer.compliant.youngs_modulus"
    start = model.sensor.replace(
        **{modulus: 1.05 * model.sensor.transducer.compliant.youngs_modulus}
    )
    forces = contacts(np.random.default_rng(7), 5)
    found = ff.calibrate(start, model.expose(forces, rng=8), forces, [modulus])
    truth = model.sensor.transducer.compliant.youngs_modulus
    calibration = found.calibration
    assert calibration is not None
    at = calibration.names.index(modulus)
    assert abs(calibration.values[at] - truth) < 4 * calibration.std[at] < 0.04 * truth
