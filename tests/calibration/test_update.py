"""Calibrated models brought up to date with frames whose loads nobody knows."""

from dataclasses import replace

import numpy as np
import pytest
from benches import PIXELS, STRAIN_OPTIC, combined, drawing, lit, presses, shots

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.models.imaging import Calibration, Imaging

SHIFT, LIGHT = 0.06e-3, 0.92
RESIDUAL = 0.15 * np.sin(np.linspace(0, 5, PIXELS) + 0.4)


def seen(model: ff.SensorModel) -> Imaging:
    assert model.imaging is not None
    return model.imaging


def told(model: ff.SensorModel) -> Calibration:
    assert model.calibration is not None
    return model.calibration


def residual(model: ff.SensorModel) -> np.ndarray:
    found = seen(model).residual
    return np.zeros(PIXELS) if found is None else found


def sensor() -> ff.Sensor:
    return drawing().replace(**{STRAIN_OPTIC: 0.0527})


@pytest.fixture(scope="module")
def calibrated() -> ff.SensorModel:
    rng = np.random.default_rng(3)
    forces = presses(rng, 8)
    frames = shots(lit(ff.characterize(sensor()), rng), forces, rng)
    return ff.calibrate(drawing(), frames, forces, [STRAIN_OPTIC])


@pytest.fixture(scope="module")
def later() -> ff.SensorModel:
    """The same sensor some weeks on: a dimmer lamp, a residual, a camera that was pushed."""
    model = lit(ff.characterize(sensor()), np.random.default_rng(3))
    imaging = seen(model)
    return replace(
        model,
        imaging=replace(
            imaging,
            positions=imaging.positions + SHIFT,
            amplitude=imaging.amplitude * LIGHT,
            residual=RESIDUAL,
        ),
    )


@pytest.fixture(scope="module")
def updated(calibrated, later) -> ff.SensorModel:
    rng = np.random.default_rng(4)
    return ff.update(calibrated, shots(later, combined(rng, 12), rng))


def off(model: ff.SensorModel, later: ff.SensorModel) -> list[float]:
    """Errors of place [m], light and residual [rad] in the middle of the strip, rms."""
    found, true = seen(model), seen(later)
    middle = np.abs(true.positions) < 6e-3
    errors = (
        found.positions - true.positions,
        found.amplitude / true.amplitude - 1,
        residual(model) - residual(later),
    )
    return [float(np.sqrt(np.mean(np.square(error[middle])))) for error in errors]


def test_drift_is_found_under_unknown_loads(calibrated, updated, later) -> None:
    before, after = off(calibrated, later), off(updated, later)
    for old, new, share in zip(before, after, (0.3, 0.2, 0.4), strict=True):
        assert new < share * old
    assert told(updated).usable
    text = " ".join(told(updated).findings)
    assert "light changed by -" in text
    assert "camera's place changed by +0.0" in text


def test_its_deviations_hold_the_truth(updated, later) -> None:
    """Errors of light and residual are smooth: few are independent, and may all be large."""
    middle = slice(40, -40)
    found = seen(updated)
    assert found.phase_modes is not None
    errors = found.amplitude - seen(later).amplitude, residual(updated) - residual(later)
    for error, modes in zip(errors, (found.amplitude_modes, found.phase_modes), strict=True):
        std = np.sqrt(np.square(modes).sum(axis=0))
        assert 0.1 < np.sqrt(np.mean(np.square(error / std)[middle])) < 2.5
    values = told(updated)
    at = values.names.index("camera shift")
    assert abs(values.values[at] - 0.2e-3 - SHIFT) < 4 * values.std[at]


def test_readings_are_right_again(calibrated, updated, later) -> None:
    rng = np.random.default_rng(5)
    forces = combined(rng, 20)
    frames = shots(later, forces, rng)
    ok, good, readings = [], [], []
    for model in (calibrated, updated):
        reader = ff.Reader(model)
        readings = [reader.search(frame) for frame in frames]
        good = [reading.status is ff.Status.OK for reading in readings]
        ok.append(np.mean(good))
    assert ok[0] < 0.3
    assert ok[1] > 0.85
    inside = [
        np.abs(reading.forces - truth) < 1.96 * reading.std
        for reading, truth, is_good in zip(readings, forces, good, strict=True)
        if is_good
    ]
    assert np.mean(inside) > 0.9


def test_unloaded_frames_tell_the_residual_but_not_its_sign(calibrated, later) -> None:
    """Crossed polarisers show sin(residual / 2)^2; what they leave open, readings allow for."""
    rng = np.random.default_rng(6)
    model = ff.update(calibrated, shots(later, np.zeros((6, 11, 2)), rng), unloaded=True)
    findings = told(model).findings
    assert any("not its sign" in text for text in findings)
    assert any("camera's place: these frames do not tell" in text for text in findings)
    np.testing.assert_array_equal(seen(model).positions, seen(calibrated).positions)
    assert model.sensor.tolerances["camera.shift"] == pytest.approx(0.1e-3)
    assert model.sensor.tolerances["polariscope.residual"] == pytest.approx(0.1)
    forces = combined(rng, 8)
    reader = ff.Reader(model)
    readings = [reader.search(frame) for frame in shots(later, forces, rng)]
    assert sum(reading.status is ff.Status.OK for reading in readings) >= 5


def test_unloaded_frames_tell_how_a_known_residual_changed(calibrated, later) -> None:
    rng = np.random.default_rng(6)
    known = replace(calibrated, imaging=replace(seen(calibrated), residual=0.4 + 0 * RESIDUAL))
    now = replace(later, imaging=replace(seen(later), residual=0.4 + RESIDUAL))
    model = ff.update(known, shots(now, np.zeros((6, 11, 2)), rng), unloaded=True)
    modes = seen(model).phase_modes
    assert modes is not None
    error = np.abs(residual(model) - residual(now))
    std = np.sqrt(np.square(modes).sum(axis=0))
    assert (error / std)[40:-40].max() < 4
    assert np.median(error[40:-40]) < 0.02


def test_frames_that_show_no_load_do_not_tell_where_the_camera_is(calibrated) -> None:
    """Loads made up for them would, as far off as many deviations."""
    as_it_was = lit(ff.characterize(sensor()), np.random.default_rng(3))
    rng = np.random.default_rng(0)
    frames = shots(as_it_was, np.zeros((3, 11, 2)), rng)
    model = ff.update(calibrated, frames, drift=ff.Drift(shift=0.2e-3))
    assert told(model).usable
    assert "camera's place: these frames do not tell" in " ".join(told(model).findings)


def test_frames_without_load_among_others_do_no_harm(calibrated, later) -> None:
    rng = np.random.default_rng(7)
    forces = combined(rng, 12)
    forces[::3] = 0.0
    model = ff.update(calibrated, shots(later, forces, rng))
    values = told(model)
    at = values.names.index("camera shift")
    assert abs(values.values[at] - 0.2e-3 - SHIFT) < 4 * values.std[at]


def test_frames_of_another_sensor_are_not_taken(calibrated) -> None:
    rng = np.random.default_rng(7)
    thin = "transducer.compliant.thickness"
    other = lit(ff.characterize(drawing().replace(**{thin: 0.3e-3})), rng)
    model = ff.update(calibrated, shots(other, combined(rng, 2), rng))
    assert not told(model).usable
    assert told(model).findings[0].startswith("Do not use this model")


@pytest.mark.parametrize(
    ("frames", "text"),
    [
        (np.zeros((3, 100)), r"100.*512 pixels"),
        (np.full((2, PIXELS), np.nan), "not finite"),
        (np.zeros((0, PIXELS)), "512 pixels"),
    ],
)
def test_frames_that_do_not_fit_are_refused(calibrated, frames, text) -> None:
    with pytest.raises(InputError, match=text):
        ff.update(calibrated, frames)


def test_loads_of_a_skin_are_not_found_with_the_drift(calibrated) -> None:
    skin = replace(calibrated, sensor=calibrated.sensor.replace(skin={"extent": "10 mm"}))
    with pytest.raises(InputError, match="unloaded=True"):
        ff.update(skin, np.zeros((1, PIXELS)))


def test_a_drawing_is_not_updated(later) -> None:
    with pytest.raises(InputError, match="Calibrate it first"):
        ff.update(ff.characterize(drawing()), np.zeros((1, PIXELS)))
    with pytest.raises(InputError, match=r"light = -0\.1"):
        ff.Drift(light=-0.1)


@pytest.mark.parametrize(
    ("drift", "text"),
    [
        (ff.Drift(shift=0.1), "no pixel surely sees the strip, whose ends are 12.5 mm"),
        (ff.Drift(scale=5.0), "scale = 5 .* state less than 0.33"),
    ],
)
def test_a_camera_that_may_look_anywhere_is_refused(calibrated, drift, text) -> None:
    with pytest.raises(InputError, match=text):
        ff.update(calibrated, np.zeros((1, PIXELS)), drift=drift)


def test_nothing_need_have_drifted(calibrated) -> None:
    frames = shots(calibrated, np.tile([1.0, 0.1], (3, 11, 1)), np.random.default_rng(3))
    never = ff.Drift(light=0.0, offset=0.0, residual=0.0, shift=0.0, scale=0.0, crosstalk=0.0)
    found = ff.update(calibrated, frames, drift=never)
    assert found.calibration is not None
    assert found.calibration.usable
    assert "changed by" not in " ".join(found.calibration.findings)


def test_the_command_writes_the_model_and_says_what_changed(calibrated, later, tmp_path) -> None:
    from typer.testing import CliRunner

    from fringeforce.cli import app

    rng = np.random.default_rng(8)
    calibrated.save(tmp_path / "m.h5")
    np.save(tmp_path / "f.npy", shots(later, np.zeros((4, 11, 2)), rng))
    ended = CliRunner().invoke(
        app,
        ["update", str(tmp_path / "m.h5"), str(tmp_path / "f.npy"), "--unloaded", "-o",
         str(tmp_path / "n.h5")],
    )  # fmt: skip
    assert ended.exit_code == 0, ended.output
    assert "The residual: unloaded frames tell its size" in ended.output
    assert ff.load_model(tmp_path / "n.h5").sensor.tolerances["camera.shift"] == 0.1e-3
