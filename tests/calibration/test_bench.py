"""Calibration with presses at any place on a bench where much departs from the drawing.

Truth is the exact Fourier series under distributed tractions of the presses themselves, with the
camera's equations; the calibration solves finite elements.
"""

from dataclasses import replace

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.calibration.bench_loads import BenchLoads, bench_loads, presses_as_loads
from fringeforce.calibration.load_log import load_log
from fringeforce.models.imaging import Imaging

PIXELS = 512
STRAIN_OPTIC = "transducer.photoelastic.strain_optic_coefficient"
COVER = "transducer.compliant.thickness"
SHIFT, SCALE, BLUR, GAMMA = 0.3e-3, 1.01, 80e-6, 1.1


def drawing(**changes) -> ff.Sensor:
    camera = {"pixels": PIXELS, "amplitude": 200.0, "offset": 15.0, "noise": 3.0}
    values = {"transducer.edges": "roller", "camera": camera, **changes}
    return ff.load_sensor("saad").replace(**values)


def built(sensor: ff.Sensor) -> ff.SensorModel:
    """What stands on the bench: other layers, camera, light, residual, lens and response."""
    optic, cover = 0.05 * 1.08, sensor.transducer.compliant.thickness * 1.05
    lens = {"camera.blur": BLUR, "camera.gamma": GAMMA}
    made = sensor.replace(**{STRAIN_OPTIC: optic, COVER: cover, **lens})
    along = np.linspace(-0.5, 0.5, PIXELS)
    imaging = replace(
        Imaging.known(
            positions=SHIFT + SCALE * sensor.pixel_positions,
            amplitude=150 * (1 + 0.2 * np.cos(4.5 * along + 0.6)),
            offset=20 + 3 * np.sin(3 * along),
        ),
        residual=0.25 * np.sin(7 * along + 1),
    )
    return replace(ff.characterize(made), imaging=imaging)


def pressed(rng: np.random.Generator, count: int) -> list[list[ff.Press]]:
    """One press in each frame, anywhere, of any width from 0.2 to 0.8 mm."""
    size, angle = rng.uniform(0.3, 3.0, count), np.radians(rng.uniform(-25, 25, count))
    return [
        [
            ff.Press(
                x=x,
                normal=force * np.cos(a),
                tangential=force * np.sin(a),
                width=w,
                profile="flat",
            )
        ]
        for x, force, a, w in zip(
            rng.uniform(-5e-3, 5e-3, count), size, angle, rng.uniform(0.2e-3, 0.8e-3, count),
            strict=True,
        )
    ]  # fmt: skip


def exposed(true: ff.SensorModel, presses: list[list[ff.Press]], rng) -> np.ndarray:
    return true.delivered(true._with_residual(true.phase(presses)), rng)


def written(presses: list[list[ff.Press]], rng: np.random.Generator) -> BenchLoads:
    """What a person writes down: places to a tenth of a millimetre, forces to a percent."""
    exact = presses_as_loads(presses)
    return replace(
        exact,
        places=exact.places + 0.1e-3 * rng.standard_normal(exact.places.shape),
        forces=exact.forces * (1 + 0.01 * rng.standard_normal(exact.forces.shape)),
        widths=np.full(exact.places.shape, np.nan),
    )


@pytest.fixture(scope="module")
def bench():
    rng = np.random.default_rng(61)
    sensor = drawing()
    true = built(sensor)
    presses = pressed(rng, 40)
    frames = exposed(true, presses, rng)
    loads = written(presses, rng)
    loads.forces[7] *= -1.0, 1.0
    loads.places[21] += 3e-3
    return sensor, true, presses, frames, loads


@pytest.fixture(scope="module")
def calibrated(bench) -> ff.SensorModel:
    sensor, _, _, frames, loads = bench
    return ff.calibrate(sensor, frames, loads, [STRAIN_OPTIC, COVER])


def test_the_sensor_is_found_within_its_deviations(calibrated) -> None:
    found = calibrated.calibration
    truth = [0.05 * 1.08, 0.525e-3, SHIFT, SCALE]
    assert (np.abs(found.values - truth) < 4.5 * found.std).all()
    assert found.chi2 == pytest.approx(1, abs=0.03)
    assert found.usable


def test_fields_lens_and_response_are_found(calibrated, bench) -> None:
    _, true, *_ = bench
    imaging, camera = calibrated.imaging, calibrated.sensor.camera
    middle = np.abs(true.imaging.positions) < 7e-3
    assert np.abs(imaging.residual - true.imaging.residual)[middle].max() < 0.03
    assert np.abs(imaging.amplitude / true.imaging.amplitude - 1)[middle].max() < 0.03
    blur, gamma = np.linalg.norm(imaging.lens_modes, axis=0)
    assert abs(camera.blur - BLUR) < 5 * blur
    assert abs(camera.gamma - GAMMA) < 5 * gamma


def test_wrong_presses_are_found_and_the_others_kept(calibrated) -> None:
    found = calibrated.calibration
    assert found.outliers == (7, 21)
    assert any("Frame 21" in text and "mm" in text for text in found.findings)


def test_frames_that_were_put_aside_are_checked(calibrated) -> None:
    frames, explained, inside, forces = calibrated.calibration.checked
    assert (frames, explained) == (8, 8)
    assert inside / forces > 0.75


def test_a_calibrated_model_keeps_its_residual_in_its_file(calibrated, tmp_path) -> None:
    calibrated.save(tmp_path / "m.h5")
    back = ff.load_model(tmp_path / "m.h5")
    np.testing.assert_array_equal(back.imaging.residual, calibrated.imaging.residual)
    np.testing.assert_array_equal(back.imaging.phase_modes, calibrated.imaging.phase_modes)
    np.testing.assert_array_equal(back.imaging.lens_modes, calibrated.imaging.lens_modes)
    assert back.calibration.checked == calibrated.calibration.checked
    assert back.sensor.tolerances == calibrated.sensor.tolerances


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        (lambda loads: replace(loads, places=-loads.places), "other sign"),
        (lambda loads: loads.rows(np.random.default_rng(0).permutation(len(loads))), "those of"),
    ],
    ids=["mirrored", "another day"],
)
def test_a_bench_that_cannot_be_explained_is_not_to_be_used(bench, change, cause) -> None:
    """Loads in another order are those of another day or of other frames, and never mirrored."""
    sensor, _, _, frames, loads = bench
    some = slice(None, None, 3)
    model = ff.calibrate(sensor, frames[some], change(loads.rows(some)), [STRAIN_OPTIC, COVER])
    found = model.calibration
    assert found is not None
    assert not found.usable
    assert "Do not use" in found.findings[0]
    assert cause in found.findings[0]


def test_the_delay_of_a_log_is_found() -> None:
    rng, sensor, delay, rate = np.random.default_rng(62), drawing(), 0.35, 50.0
    true, count = built(sensor), 8
    # presses of a third of a second, one after the other, each somewhere else
    ends = 0.2 + 0.45 * np.arange(count)
    where, size = rng.uniform(-4e-3, 4e-3, count), rng.uniform(0.8, 2.5, count)

    def moving(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        number = np.clip(np.searchsorted(ends, t) - 1, 0, count - 1)
        share = np.clip((t - ends[number]) / 0.33, 0, 1)
        force = size[number] * np.sin(np.pi * share) ** 2
        return where[number], np.stack([force, 0.2 * force * np.cos(9 * share)], axis=1)

    times = np.arange(int(4 * rate)) / rate
    places, forces = moving(times)
    presses = [
        [ff.Press(x=x, normal=n, tangential=s, width=0.4e-3, profile="flat")] if n > 1e-3 else []
        for x, (n, s) in zip(places, forces, strict=True)
    ]
    clock = np.arange(-1.0, 5.0, 0.004)
    log = load_log(clock + delay, *moving(clock))
    some = slice(None, None, 2)
    frames = exposed(true, presses[some], rng)
    model = ff.calibrate(sensor, frames, log, [STRAIN_OPTIC, COVER], times=times[some])
    assert model.calibration is not None
    assert model.calibration.delay == pytest.approx(delay, abs=5e-3)
    assert model.calibration.usable


def test_loads_by_time_need_the_times_of_the_frames(bench) -> None:
    sensor, _, _, frames, _ = bench
    log = load_log([0.0, 1.0], [0.0, 0.0], [(1.0, 0.0), (2.0, 0.0)])
    with pytest.raises(ff.FringeforceError, match="time of every frame"):
        ff.calibrate(sensor, frames, log)


def test_a_contact_beside_the_strip_is_named(bench) -> None:
    sensor, _, _, frames, _ = bench
    loads = bench_loads(np.full(40, 20e-3), np.ones((40, 2)))
    with pytest.raises(ff.FringeforceError, match=r"Contact 1 of frame 0 lies at x = 0\.02 m"):
        ff.calibrate(sensor, frames, loads)
