"""Calibrated pads brought up to date with frames whose loads nobody knows."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pad_benches import COVER, EFFECT, PROFILES, TRUE, drawing
from scipy import stats
from typer.testing import CliRunner

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.calibration.bench_loads import BenchLoads, bench_loads
from fringeforce.cli import app
from fringeforce.design.tolerances import Tolerances
from fringeforce.io.bench_loads import save_bench_loads
from fringeforce.models.as_built import RESIDUAL
from fringeforce.models.imaging import Calibration
from fringeforce.models.pad import PadModel, characterize_pad
from fringeforce.models.pad_knowledge import PadKnowledge
from fringeforce.models.pad_presses import press_slices
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.optics import camera as camera_optics
from fringeforce.plotting.pad_calibration import residual_field

FEW = {"camera.pixels": [32, 32]}
STDS = {
    "camera.amplitude": 0.5,
    "camera.offset": 0.1,
    "camera.shift_x": 2e-6,
    "camera.shift_y": 2e-6,
    "camera.scale": 3e-4,
    COVER: 2e-6,
    EFFECT: 2e-4,
    RESIDUAL: 1e-3,
}
DRIFTED = {"camera.amplitude": 215.0, "camera.shift_x": 0.21e-3, "camera.shift_y": -0.04e-3}
ROUGH = 0.15
"""Root mean square of the residual that came, over both passes [rad]."""


@pytest.fixture(scope="module")
def calibrated() -> PadModel:
    """A pad as a calibration leaves it: right, and sure of it."""
    return known_pad_of(**FEW)


def known_pad_of(**changes) -> PadModel:
    """The same of a pad that is drawn in some other way."""
    pad = drawing(**{**TRUE, **changes, "camera.drift": 0.01})
    pad = pad.model_copy(update={"tolerances": Tolerances(STDS)})
    model = characterize_pad(pad, None, 48, 8)
    groups = PadUncertainty.of(model).groups[:-1]  # the last is the lamp's
    counts = {group.path: group.end - group.begin for group in groups}
    size = sum(counts.values())
    known = PadKnowledge(STDS, counts, np.zeros(size), np.eye(size))
    names = tuple(path for path in STDS if path != RESIDUAL)
    values = np.array([TRUE.get(name, DRAWN.get(name, 0.0)) for name in names])
    stds = np.array([STDS[name] for name in names])
    relative = np.where([name.startswith("camera") for name in names], 1.0, values)
    covariance = np.diag(np.square(stds / relative))
    found = Calibration(names, values, values, covariance, (), (), (), 1.0, ())
    return replace(model, known=known, calibration=found)


DRAWN = {"camera.scale": 1.0, "camera.offset": 5.0}


def rest(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The two parts of a smooth residual: waves over the pad, root mean square near one."""
    along, across = np.meshgrid(x / 7e-3, y / 7e-3)
    return np.array([np.sin(3 * along + across + 0.4), np.cos(2 * across - along + 0.9)]) * np.sqrt(
        2
    )


def shots(forces: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Frames of the same pad some weeks on: a dimmer lamp, a camera that was pushed, a residual."""
    pad = drawing(**{**TRUE, **FEW, **DRIFTED})
    model = characterize_pad(pad, None, 64, 12)
    x, y = pad.pixel_positions
    slices = [model.slices(load) + ROUGH * rest(x, y) / (2 * 12) for load in forces]
    light = np.array([model.seen(one).reshape(model.frame_shape) for one in slices])
    return camera_optics.expose(pad.camera, light, rng, frame_axes=len(model.frame_shape))


def loads(rng: np.random.Generator, count: int) -> np.ndarray:
    """Forces that nobody writes down."""
    forces = rng.uniform(-0.3, 0.3, (count, 4, 3))
    forces[..., 0] = rng.uniform(0.4, 1.6, (count, 4))
    return forces


@pytest.fixture(scope="module")
def updated(calibrated) -> PadModel:
    rng = np.random.default_rng(4)
    return ff.update(calibrated, shots(loads(rng, 5), rng))


def test_drift_is_found_under_unknown_loads(calibrated, updated):
    before, after = calibrated.calibration, updated.calibration
    assert after.usable, after.findings
    for name, value in DRIFTED.items():
        place = after.names.index(name)
        off = abs(after.values[place] - value)
        assert off < 4 * after.std[place], name
        assert off < 0.1 * abs(before.values[place] - value), name
    text = " ".join(after.findings)
    assert "The light changed by -" in text
    assert "The camera's place along x changed by +0.0" in text
    assert "only known loads tell" in text


def test_the_residual_is_found_within_its_deviations(updated):
    x = y = ((np.arange(64) + 0.5) / 64 - 0.5) * 7e-3
    true = ROUGH * rest(x, y)
    off = residual_field(updated) - true
    assert np.sqrt(np.mean(off**2)) < 0.25 * np.sqrt(np.mean(true**2))


def test_readings_are_right_again(calibrated, updated):
    rng = np.random.default_rng(5)
    forces = loads(rng, 3)
    frames = shots(forces, rng)
    before, after = (
        [ff.Reader(model).search(frame) for frame in frames] for model in (calibrated, updated)
    )
    assert not any(reading.status is ff.Status.OK for reading in before)
    assert all(reading.status is ff.Status.OK for reading in after)
    for reading, force in zip(after, forces, strict=True):
        assert (np.abs(reading.forces - force) < 5 * reading.std).all()


def test_frames_without_load_tell_the_light_and_not_where_the_camera_is(calibrated, tmp_path):
    calibrated.save(tmp_path / "m.h5")
    rng = np.random.default_rng(6)
    np.save(tmp_path / "f.npy", shots(np.zeros((3, 4, 3)), rng))
    arguments = [str(tmp_path / "m.h5"), str(tmp_path / "f.npy"), "--unloaded"]
    run = CliRunner().invoke(app, ["update", *arguments, "-o", str(tmp_path / "l.h5")])
    assert run.exit_code == 0, run.output
    found = ff.load_model(tmp_path / "l.h5")
    text = " ".join(found.calibration.findings)
    assert "The camera's place along x: these frames do not tell" in text
    assert "The residual changed by" in text
    place = found.calibration.names.index("camera.shift_x")
    assert found.calibration.std[place] == pytest.approx(0.1e-3, rel=0.1)
    assert abs(found.calibration.values[place] - TRUE["camera.shift_x"]) < 0.05e-3


WIDE = {"transducer.length": 9e-3, "transducer.width": 9e-3, "camera.pixels": [56, 56]}


def skin_shots(
    presses: list[list[ff.Press]], rng: np.random.Generator, size: dict[str, Any] = WIDE
) -> np.ndarray:
    """Frames of contacts anywhere on the same pad, as wide as a skin needs, some weeks on."""
    pad = drawing(**{**TRUE, **size, **DRIFTED})
    model = characterize_pad(pad, None, 64, 12)
    x, y = pad.pixel_positions
    light = []
    for one in presses:
        slices = press_slices(pad, one, x, y)
        slices = slices + ROUGH * rest(x, y) / (2 * len(slices))
        light.append(model.seen(slices).reshape(model.frame_shape))
    return camera_optics.expose(pad.camera, np.array(light), rng, frame_axes=2)


def spheres(rng: np.random.Generator, count: int) -> list[list[ff.Press]]:
    """Presses that nobody writes down."""
    found = []
    for _ in range(count):
        (x, y), (a, b) = rng.uniform(-2e-3, 2e-3, 2), rng.uniform(-0.3, 0.3, 2)
        found.append(
            [ff.Press(x=x, y=y, normal=rng.uniform(0.8, 2), tangential=(a, b), radius=6e-3)]
        )
    return found


@pytest.mark.slow
def test_a_skin_is_brought_up_to_date_under_contacts_that_nobody_knows() -> None:
    rng, skin = np.random.default_rng(8), known_pad_of(**WIDE).as_skin()
    found = ff.update(skin, skin_shots([[], *spheres(rng, 3)], rng))
    told, before = found.calibration, skin.calibration
    assert told is not None
    assert before is not None
    assert told.usable, told.findings
    for name, value in DRIFTED.items():
        place = told.names.index(name)
        off = abs(told.values[place] - value)
        assert off < 4 * told.std[place], name
        assert off < 0.2 * abs(before.values[place] - value), name
    presses = spheres(rng, 2)
    frames = skin_shots(presses, rng)
    assert not ff.Reader(skin).search(frames[0]).ok
    fresh = [ff.Reader(found).search(frame) for frame in frames]
    assert all(reading.ok for reading in fresh)
    for reading, (press,) in zip(fresh, presses, strict=True):
        total = reading.total
        assert total is not None
        true = np.array([press.normal, *press.shear, press.x, press.y], dtype=float)
        off = np.concatenate([total.force, total.centre]) - true
        assert (np.abs(off) < 5 * np.concatenate([total.force_std, total.place_std])).all()


def anywhere(rng: np.random.Generator, count: int) -> list[list[ff.Press]]:
    """Presses by position, under three kinds of pressure."""
    found = []
    for number in range(count):
        (x, y), normal, angle = (
            rng.uniform(-1.5e-3, 1.5e-3, 2),
            rng.uniform(0.8, 2.5),
            rng.uniform(0, 2 * np.pi),
        )
        shear = 0.3 * normal * np.cos(angle), 0.3 * normal * np.sin(angle)
        wide, profile = rng.uniform(1.4e-3, 2.2e-3), PROFILES[number % 3]
        found.append(
            [ff.Press(x=x, y=y, normal=normal, tangential=shear, width=wide, profile=profile)]
        )
    return found


PRESSED, WRONG = 10, 4


def written(presses: list[list[ff.Press]], rng: np.random.Generator, wrong: int) -> BenchLoads:
    """What is written down: 0.05 mm rms beside, 1 % wrong, and the load of one row by 40 %."""
    places = np.array([[one.x, one.y] for (one,) in presses])
    forces = np.array([[one.normal, *one.shear] for (one,) in presses])
    places = places + 0.05e-3 * rng.standard_normal(places.shape)
    forces = forces * (1 + 0.01 * rng.standard_normal(forces.shape))
    forces[wrong - 1] *= 1.4
    return bench_loads(places, forces, np.arange(len(presses)) + 1, len(presses) + 1)


@pytest.fixture(scope="module")
def pressed(tmp_path_factory, calibrated) -> tuple[PadModel, str]:
    """The pad brought up to date by the command with presses by position, and what it said."""
    rng, folder = np.random.default_rng(9), tmp_path_factory.mktemp("pressed")
    presses = anywhere(rng, PRESSED)
    frames = skin_shots([[], *presses], rng, FEW)
    save_bench_loads(folder / "loads.csv", written(presses, rng, WRONG))
    np.save(folder / "f.npy", frames)
    calibrated.save(folder / "m.h5")
    arguments = [str(folder / "m.h5"), str(folder / "f.npy"), "-o", str(folder / "l.h5")]
    run = CliRunner().invoke(app, ["update", *arguments, "--loads", str(folder / "loads.csv")])
    assert run.exit_code == 0, run.output
    found = ff.load_model(folder / "l.h5")
    assert isinstance(found, PadModel)
    return found, run.output


@pytest.mark.slow
def test_presses_by_position_tell_the_drift_and_the_wrong_one_is_named(pressed):
    model, said = pressed
    found = model.calibration
    assert found.outliers == (WRONG,)
    assert f"Frame {WRONG}, recorded as" in said
    assert "The strength of the effect" in said
    for name, value in {**TRUE, **DRIFTED}.items():
        place = found.names.index(name)
        assert abs(found.values[place] - value) < 4 * found.std[place], name
    x = y = ((np.arange(64) + 0.5) / 64 - 0.5) * 7e-3
    true = ROUGH * rest(x, y)
    off = residual_field(model) - true
    assert np.sqrt(np.mean(off**2)) < 0.1 * np.sqrt(np.mean(true**2))


@pytest.mark.slow
def test_readings_after_presses_by_position_are_right_and_their_intervals_hold(calibrated, pressed):
    rng = np.random.default_rng(5)
    forces = loads(rng, 12)
    frames = shots(forces, rng)
    assert not any(ff.Reader(calibrated).search(frame).ok for frame in frames[:3])
    readings = [ff.Reader(pressed[0]).search(frame) for frame in frames]
    assert all(reading.ok for reading in readings)
    off = np.array([(r.forces - f) / r.std for r, f in zip(readings, forces, strict=True)])
    inside = int((np.abs(off) < 1.96).sum())
    # 144 forces, a false alarm of one in a thousand if 95 % are inside
    assert stats.binom.ppf(0.0005, off.size, 0.95) <= inside


def test_presses_that_are_no_presses_of_these_frames_must_not_be_used(calibrated):
    rng = np.random.default_rng(10)
    frames = skin_shots([[], *anywhere(rng, 5)], rng, FEW)
    found = ff.update(calibrated, frames, loads=[[], *anywhere(rng, 5)]).calibration
    assert not found.usable
    assert found.findings[0].startswith("Do not use this model")


def test_a_skin_has_no_tactels_whose_loads_are_known(calibrated):
    skin = calibrated.as_skin()
    loads = np.zeros((1, skin.sensor.tactels.total, 3))
    with pytest.raises(InputError, match="leave loads= out"):
        ff.update(skin, np.zeros((1, *skin.frame_shape)), loads=loads)


def test_frames_that_no_drift_explains_must_not_be_used(calibrated):
    rng = np.random.default_rng(7)
    frames = shots(loads(rng, 3), rng)
    turned = np.rot90(frames, axes=(-2, -1))
    found = ff.update(calibrated, turned, unloaded=True).calibration
    assert not found.usable
    assert found.findings[0].startswith("Do not use this model")


def test_a_pad_as_drawn_is_refused():
    model = characterize_pad(drawing(**FEW), None, 48, 8)
    with pytest.raises(InputError, match="Calibrate it first"):
        ff.update(model, np.zeros((3, *model.frame_shape)), unloaded=True)
