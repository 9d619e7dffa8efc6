"""Calibration against simulated benches whose sensor is not the one on the drawing."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2 as chi_square

import fringeforce as ff
from fringeforce.calibration.calibrate import PARAMETERS
from fringeforce.calibration.design_entries import STRAIN_OPTIC
from fringeforce.calibration.design_jacobian import design_jacobian
from fringeforce.estimation.bounds import cramer_rao_bound
from fringeforce.models.imaging import Imaging
from fringeforce.reading.strip_reader import StripFrameReader

pytestmark = pytest.mark.slow

N, PIXELS, WRONG = 11, 2048, 17
COVER = "transducer.compliant.youngs_modulus"
BASE = "transducer.photoelastic.youngs_modulus"


def single_presses() -> np.ndarray:
    """Two frames at each of 22 single loads."""
    unit = np.eye(2 * N).reshape(2 * N, N, 2)
    return np.concatenate([scale * unit * [3.0, 1.5] for scale in (1, 0.6)])


def combined(rng: np.random.Generator, count: int, largest: float = 2.0) -> np.ndarray:
    size = rng.uniform(0, largest, (count, N)) * (rng.random((count, N)) < 0.7)
    angle = np.radians(rng.uniform(-20, 20, (count, N)))
    return np.stack([size * np.cos(angle), size * np.sin(angle)], axis=2)


@pytest.fixture(scope="module")
def true(sensor: ff.Sensor) -> ff.SensorModel:
    """The sensor on the bench: other materials, another cover, a camera and a lamp of its own."""
    optic = sensor.transducer.photoelastic.strain_optic_coefficient
    cover = sensor.transducer.compliant
    made = sensor.replace(
        **{
            STRAIN_OPTIC: 1.08 * optic,
            COVER: 0.8 * cover.youngs_modulus,
            "transducer.compliant.thickness": 1.1 * cover.thickness,
        }
    )
    along = np.linspace(-0.5, 0.5, PIXELS)
    return replace(
        ff.characterize(made),
        imaging=Imaging.known(
            positions=0.4e-3 + 1.01 * sensor.pixel_positions,
            amplitude=150 * (1 + 0.3 * np.cos(4.5 * along + 0.6)),
            offset=8 + 3 * np.sin(3 * along),
        ),
    )


@pytest.fixture(scope="module")
def dead() -> dict[int, int]:
    rng = np.random.default_rng(3)
    where = rng.choice(PIXELS - 80, 10, replace=False)
    return dict(zip(where.tolist(), rng.choice([0, 90, 255], 10).tolist(), strict=True))


def exposed(true: ff.SensorModel, forces: np.ndarray, rng, dead: dict[int, int]) -> np.ndarray:
    frames = true.expose(forces, rng=rng)
    frames[..., list(dead)] = list(dead.values())
    return frames


@pytest.fixture(scope="module")
def calibrated(sensor: ff.Sensor, true: ff.SensorModel, dead: dict[int, int]) -> ff.SensorModel:
    rng = np.random.default_rng(11)
    forces = np.concatenate([single_presses(), combined(rng, 20)])
    frames = exposed(true, forces, rng, dead)
    forces[WRONG] = np.roll(forces[WRONG], 1, axis=0)
    return ff.calibrate(sensor, frames, forces)


def findings(model: ff.SensorModel):
    assert model.calibration is not None
    return model.calibration


def test_the_true_design_and_camera_are_found_within_their_deviations(calibrated) -> None:
    found = findings(calibrated)
    truth = np.array([0.05 * 1.08, 11e6 * 0.8, 0.55e-3, 0.4e-3, 1.01])
    assert found.names == (*PARAMETERS, "camera shift", "camera scale")
    assert (np.abs(found.values - truth) < 4.5 * found.std).all()
    # the deviations mean something: each is a small part of what the drawing was wrong by
    assert (found.std < 0.05 * np.abs(truth - found.drawing)).all()
    assert found.chi2 == pytest.approx(1, abs=0.02)


def test_a_wrong_press_is_found_and_named(calibrated) -> None:
    assert findings(calibrated).outliers == (WRONG,)
    said = next(text for text in findings(calibrated).findings if f"Frame {WRONG}" in text)
    tactel, kind = divmod(WRONG, 2)
    recorded = f"{('normal', 'tangential')[kind]} on tactel {(tactel + 1) % N + 1},"
    assert recorded in said
    assert f"{('normal', 'tangential')[kind]} on tactel {tactel + 1}" in said.split("looks like")[1]


def test_dead_pixels_are_found_and_no_others(calibrated, dead) -> None:
    assert findings(calibrated).dead == tuple(sorted(dead))


def test_lighting_is_found_where_fringes_show_it(calibrated, true) -> None:
    middle = np.abs(true.imaging.positions) < 8e-3
    amplitude = calibrated.imaging.amplitude / true.imaging.amplitude
    assert np.abs(amplitude[middle] - 1).max() < 0.01
    assert np.abs(calibrated.imaging.offset - true.imaging.offset)[middle].max() < 1


def test_new_frames_are_read_as_well_as_by_a_perfectly_known_sensor(calibrated, true, dead) -> None:
    rng = np.random.default_rng(12)
    forces = combined(rng, 80)
    off, bounds, inside = [], [], []
    known, reader = StripFrameReader(true), ff.Reader(calibrated)
    seen = np.abs(true.pixel_positions) < true.sensor.transducer.length / 2
    influence, response = known.influence[seen], true.response.at(seen)
    for load, frame in zip(forces, exposed(true, forces, rng, dead), strict=True):
        reading = reader.search(frame)
        assert reading.status is ff.Status.OK
        off.append(reading.forces - load)
        inside.append(np.abs(off[-1]) < 1.96 * reading.std)
        bounds.append(cramer_rao_bound(influence @ load.ravel(), influence, response))
    assert np.sqrt(np.mean(np.square(off)) / np.mean(np.square(bounds))) < 1.3
    assert 0.93 <= np.mean(inside) <= 0.97


def test_the_drawing_cannot_read_what_the_calibrated_model_reads(model, true, dead) -> None:
    rng = np.random.default_rng(13)
    frame = exposed(true, combined(rng, 1)[0], rng, dead)
    assert ff.Reader(model).search(frame).status is ff.Status.MODEL_MISMATCH


def test_a_calibrated_model_survives_its_file(calibrated, true, tmp_path) -> None:
    calibrated.save(tmp_path / "m.h5")
    back = ff.load_model(tmp_path / "m.h5")
    for name, value in vars(calibrated.imaging).items():
        np.testing.assert_array_equal(getattr(back.imaging, name), value)
    assert back.calibration is not None
    record = findings(calibrated).record
    for name, value in vars(record).items():
        np.testing.assert_array_equal(getattr(back.calibration.record, name), value)
    for name, value in vars(findings(calibrated)).items():
        if value is not record:
            np.testing.assert_array_equal(getattr(back.calibration, name), value)
    frame = true.expose(ff.polar(1.0, 10, n=N), rng=0)
    np.testing.assert_array_equal(
        ff.Reader(back).search(frame).covariance, ff.Reader(calibrated).search(frame).covariance
    )


def test_estimates_scatter_as_their_covariance_says(sensor, true) -> None:
    rng, total, freedom = np.random.default_rng(14), 0.0, 0
    shape = true.sensor.replace(**{STRAIN_OPTIC: 0.05})
    truth = np.array([np.log(1.08), 0.4e-3, 1.01])
    readings = 0.0
    forces = combined(np.random.default_rng(15), 6, largest=1.0)
    for _ in range(6):
        frames = true.expose(forces, rng=rng)
        model = ff.calibrate(shape, frames, forces, parameters=[STRAIN_OPTIC])
        found = findings(model)
        error = np.append(np.log(found.values[0] / found.drawing[0]), found.values[1:]) - truth
        total += error @ np.linalg.solve(found.covariance, error)
        freedom += len(error)
        load = ff.polar(3.0, 10, n=N)
        frame = true.expose(load, rng=rng)
        reading = ff.Reader(model).search(frame)
        sure = replace(model, imaging=Imaging.known(*_lit(model)))
        assert (reading.std > ff.Reader(sure).search(frame).std).all()
        off = (reading.forces - load).ravel()
        readings += off @ np.linalg.solve(reading.covariance, off)
    low, high = chi_square.ppf([1e-4, 1 - 1e-4], freedom)
    assert low < total < high
    low, high = chi_square.ppf([1e-4, 1 - 1e-4], 6 * 2 * N)
    assert low < readings < high


def _lit(model: ff.SensorModel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    assert model.imaging is not None
    return model.imaging.positions, model.imaging.amplitude, model.imaging.offset


def test_young_s_moduli_and_the_strain_optic_coefficient_are_not_told_apart(sensor, model) -> None:
    rng = np.random.default_rng(16)
    forces = combined(rng, 8, largest=1.0)
    true = ff.characterize(sensor.replace(**{BASE: 1.2 * 110e6}))
    paths = [STRAIN_OPTIC, COVER, BASE]
    found = findings(ff.calibrate(sensor, true.expose(forces, rng=rng), forces, paths))
    assert len(found.unidentified) == 1
    assert all(f"{path}^1" in found.unidentified[0] for path in paths)
    assert any(found.unidentified[0] in text for text in found.findings)
    # what does matter is found: K_s / E_2 and E_1 / E_2
    factors = found.values[:3] / found.drawing[:3]
    assert factors[0] / factors[2] == pytest.approx(1 / 1.2, rel=5e-3)
    assert factors[1] / factors[2] == pytest.approx(1 / 1.2, rel=0.1)


def test_derivatives_of_the_design_do_not_depend_on_their_step(sensor) -> None:
    paths = (*PARAMETERS, "transducer.photoelastic.poissons_ratio", "tactels.pitch")
    centre, x = np.full(len(paths), -0.05), np.linspace(-0.012, 0.012, 301)
    fine, coarse = (design_jacobian(sensor, paths, centre, step).at(x) for step in (0.002, 0.004))
    scale = np.abs(fine).max(axis=(1, 2))
    assert (np.abs(fine - coarse).max(axis=(1, 2)) < 3e-3 * scale).all()


def test_imaging_as_designed_changes_no_frame_and_no_reading(model, sensor) -> None:
    even = np.ones(PIXELS)
    imaging = Imaging.known(sensor.pixel_positions, 245 * even, 5 * even)
    same, forces = replace(model, imaging=imaging), ff.polar(1.0, 10, n=N)
    frame = model.expose(forces, rng=1)
    np.testing.assert_array_equal(same.expose(forces, rng=1), frame)
    np.testing.assert_allclose(
        ff.Reader(same).search(frame).forces, ff.Reader(model).search(frame).forces, rtol=1e-9
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda f, p: (f[:-1], p), ["(8, 11, 2)", "7 frames"]),
        (lambda f, p: (f[:, :100], p), ["(8, 100)", "2048"]),
        (lambda f, p: (f, p * np.nan), ["not finite", "0, 1, 2"]),
        (lambda f, p: (f, p * 1e3), ["1000 N", "newtons"]),
        (lambda f, p: (f, p * 0), ["0 of 8", "at least 4"]),
        (lambda f, p: (f - 1.0, p), ["0 to 255", "bits"]),
        (lambda f, p: (np.full_like(f, 255), p), ["saturated", "exposure"]),
    ],
)
def test_a_bench_that_does_not_fit_is_named_with_its_remedy(sensor, change, words) -> None:
    frames, forces = np.zeros((8, PIXELS)), np.ones((8, N, 2))
    with pytest.raises(ff.FringeforceError) as caught:
        ff.calibrate(sensor, *change(frames, forces))
    assert all(word in str(caught.value) for word in words)


@pytest.mark.parametrize("path", ["camera.noise", "transducer.length", "transducer.cover", "name"])
def test_a_value_that_cannot_be_calibrated_is_named(sensor, path) -> None:
    with pytest.raises(ff.FringeforceError, match=path):
        ff.calibrate(sensor, np.zeros((8, PIXELS)), np.ones((8, N, 2)), [path])


def test_a_tactel_that_was_never_pressed_is_named(sensor, model) -> None:
    forces = combined(np.random.default_rng(18), 6, largest=1.0)
    forces[:, 4, 0] = 0
    frames = model.expose(forces, rng=2)
    said = findings(ff.calibrate(sensor, frames, forces, [STRAIN_OPTIC])).findings
    assert any("Never loaded normally: tactel 5;" in text for text in said)


def test_presses_below_half_a_fringe_are_told_to_be_too_weak(sensor, true) -> None:
    shape = true.sensor.replace(**{STRAIN_OPTIC: 0.05})
    weak = np.eye(2 * N).reshape(2 * N, N, 2) * [0.4, 0.2]
    found = findings(ff.calibrate(shape, true.expose(weak, rng=4), weak, [STRAIN_OPTIC]))
    assert found.std[0] > 0.02 * found.values[0]
    assert any(STRAIN_OPTIC in text and "Press so hard" in text for text in found.findings)
