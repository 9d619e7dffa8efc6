"""What a bench of a pad has besides frames: a log by time, a load cell, references, a plan."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from pad_benches import COVER, EFFECT, TRUE, built, drawing
from typer.testing import CliRunner

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.calibration.bench_loads import bench_loads, loads_on_tactels
from fringeforce.calibration.load_log import LoadLog, load_log
from fringeforce.calibration.pads import search as pad_search
from fringeforce.calibration.verification import verify
from fringeforce.cli import app
from fringeforce.contacts.press import Press
from fringeforce.io.bench_loads import load_bench_loads, save_bench_loads
from fringeforce.models.pad import PadModel, characterize_pad
from fringeforce.optics.camera import noise_variance

FEW = {"camera.pixels": [24, 24]}
LINEAR = {"camera.gamma": "1 +/- 0.002"}
"""What the drawing says of a camera whose dark level is to be told by itself."""
DELAY, GAIN, ZERO, CELL = 0.235, 1.02, 0.03, (0.02, 0.03)
STEP, LASTS = 0.25, 1.5
"""Time between frames and between presses [s]."""
PLACES = np.array([[-1.0, 0.8], [1.1, 0.2], [0.1, -1.2]]) * 1e-3
LARGEST = np.array([[2.2, 0.4, -0.3], [1.6, -0.3, 0.1], [2.4, 0.1, 0.4]])


def pressed(time: float) -> tuple[np.ndarray, np.ndarray]:
    """Where and how strongly a finger presses at a time: three ramps up and down."""
    number = int(np.clip(time // LASTS, 0, len(PLACES) - 1))
    since = time - LASTS * number
    share = np.clip(min(since - 0.2, LASTS - 0.2 - since) / 0.4, 0, 1) if time > 0 else 0.0
    return PLACES[number], share * LARGEST[number]


def touch(place: np.ndarray, force: np.ndarray) -> Press:
    """A finger at a place."""
    (x, y), (normal, *shear) = place, force
    return Press(x=x, y=y, normal=normal, tangential=(shear[0], shear[1]), width=1.8e-3)


@pytest.fixture(scope="module")
def timed() -> Iterator[PadModel]:
    """A pad calibrated by a late log of a cell that reads 2 % and 30 mN too much."""
    rng, model = np.random.default_rng(5), built(**FEW)
    times, presses = np.arange(0, LASTS * len(PLACES), STEP), []
    for place, force in map(pressed, times):
        presses.append([touch(place, force)] if force[0] > 0 else [])
    frames = model.expose(presses, rng)
    clock = np.arange(-1, 6, 0.01)
    places, forces = (np.array(values) for values in zip(*map(pressed, clock), strict=True))
    read = forces * GAIN + np.where(forces != 0, [ZERO, 0.0, 0.0], 0.0)
    unloaded = ff.References(unloaded=model.expose(np.zeros((20, 4, 3)), rng))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pad_search, "characterize_pad", lambda pad: characterize_pad(pad, None, 40))
        yield ff.calibrate(
            drawing(**FEW, **LINEAR),
            frames,
            load_log(clock + DELAY, places, read),
            [COVER, EFFECT],
            references=unloaded,
            times=times,
            load_cell=CELL,
        )


@pytest.mark.slow
def test_the_delay_of_a_log_is_found(timed):
    assert timed.calibration.usable, timed.calibration.findings
    assert abs(timed.calibration.delay - DELAY) < 5e-3


@pytest.mark.slow
def test_values_are_found_within_what_the_load_cell_leaves(timed):
    found = timed.calibration
    for name in (COVER, EFFECT, "camera.shift_x", "camera.amplitude"):
        place = found.names.index(name)
        assert abs(found.values[place] - TRUE[name]) < 4 * found.std[place], name
    # the gain of three components stands for a strength of the effect, 2 % / sqrt(3) or more
    assert found.std[found.names.index(EFFECT)] / TRUE[EFFECT] > CELL[0] / np.sqrt(3)


@pytest.mark.slow
def test_unloaded_frames_tell_the_dark_level(timed):
    place = timed.calibration.names.index("camera.offset")
    assert abs(timed.calibration.values[place] - 5.0) < 4 * timed.calibration.std[place]
    # twenty frames are a row of a twentieth of the noise's variance, but for the residual
    assert timed.calibration.std[place] < 0.2


def test_a_log_of_a_pad_is_read_from_a_table(tmp_path):
    rows = ["time_s;x_mm;y_mm;fx_N;fy_N;fz_N", "0;1,5;-0,5;0;0;0", "1;1,5;-0,5;0,2;-0,1;-2"]
    (tmp_path / "log.csv").write_text("\n".join(rows))
    log = load_bench_loads(tmp_path / "log.csv", drawing())
    assert isinstance(log, LoadLog)
    loads = log.at([0.5], 0.0)
    np.testing.assert_allclose(loads.places[0, 0], [1.5e-3, -0.5e-3])
    np.testing.assert_allclose(loads.forces[0, 0], [1.0, 0.1, -0.05])


@pytest.fixture(scope="module")
def checked() -> tuple[PadModel, np.ndarray, np.ndarray]:
    """A pad that is known, frames of it, and forces on its tactels."""
    rng, model = np.random.default_rng(3), built(**FEW, **{"camera.drift": 0.0})
    forces = np.zeros((4, 4, 3))
    forces[range(4), range(4)] = rng.uniform(-0.3, 0.3, (4, 3))
    forces[range(4), range(4), 0] = rng.uniform(0.8, 2.0, 4)
    return model, model.expose(forces, rng), forces


def test_a_good_pad_passes_and_wrong_loads_fail(checked):
    model, frames, forces = checked
    found = verify(model, frames, forces)
    assert found.passed
    assert found.error < 3 * found.stated
    assert verify(model, frames, 1.2 * forces).wrong == (0, 1, 2, 3)


def test_loads_by_place_are_compared_by_whole_force_and_centre(checked):
    model, frames, forces = checked
    loads = replace(loads_on_tactels(forces, model.sensor.tactels.places), tactels=None)
    found = verify(model, frames, loads)
    assert found.passed
    assert found.places is not None
    assert found.places[0] < 0.1e-3
    beside = replace(loads, places=loads.places + np.array([0.0, 0.8e-3]))
    assert verify(model, frames, beside).wrong == (0, 1, 2, 3)


def test_frames_without_load_are_no_reason_to_fail(checked):
    model, frames, forces = checked
    silent = model.expose(np.zeros((1, *forces.shape[1:])), 1)
    loads = loads_on_tactels(np.concatenate([forces, 0 * forces[:1]]), model.sensor.tactels.places)
    found = verify(model, np.concatenate([frames, silent]), replace(loads, tactels=None))
    assert found.passed
    assert found.statuses == {"OK": 4, "NO_CONTACT": 1}


@pytest.mark.slow
def test_presses_beside_the_tactels_are_read_as_contacts_anywhere(tmp_path):
    """What tactels do not explain; frames are those of spheres by the exact series."""
    rng, side = np.random.default_rng(7), {"transducer.length": 9e-3, "transducer.width": 9e-3}
    model = built(**side, **{"camera.pixels": [56, 56], "camera.drift": 0.0})
    places, forces = rng.uniform(-1.5e-3, 1.5e-3, (5, 2)), rng.uniform(-0.3, 0.3, (5, 3))
    forces[:, 0] = rng.uniform(0.8, 2.0, 5)
    presses = [[touch(*one)] for one in zip(places, forces, strict=True)]
    frames = model.expose([*presses, []], rng)
    loads = bench_loads(places, forces, np.arange(5), 6)
    found = verify(model, frames, loads)
    assert found.beside
    assert found.passed, found
    assert found.error < 0.03
    assert found.places is not None
    assert found.places[0] < 0.05e-3
    with pytest.raises(InputError, match="Not one of"):
        verify(model, np.zeros_like(frames), loads)
    model.save(tmp_path / "m.h5")
    np.save(tmp_path / "f.npy", frames)
    for shift, status in ((0.0, 0), (0.8e-3, 1)):
        save_bench_loads(tmp_path / "l.csv", replace(loads, places=loads.places + shift))
        run = CliRunner().invoke(app, ["check", *(str(tmp_path / n) for n in NAMES)])
        assert run.exit_code == status, run.output
        assert "read as contacts anywhere" in run.output


@pytest.mark.slow
def test_commands_take_pads(checked, tmp_path):
    model, frames, forces = checked
    model.save(tmp_path / "m.h5")
    np.save(tmp_path / "f.npy", frames)
    loads = loads_on_tactels(forces, model.sensor.tactels.places)
    for factor, status in ((1.0, 0), (1.2, 1)):
        save_bench_loads(tmp_path / "l.csv", replace(loads, forces=factor * loads.forces))
        run = CliRunner().invoke(app, ["check", *(str(tmp_path / n) for n in NAMES)])
        assert run.exit_code == status, run.output
    (tmp_path / "pad.toml").write_text(drawing(**FEW).to_toml())
    plan = [str(tmp_path / "pad.toml"), "--presses", "3", "-o", str(tmp_path / "p.csv")]
    run = CliRunner().invoke(app, ["plan", *plan])
    assert run.exit_code == 0, run.output
    words = (tmp_path / "p.txt").read_text().splitlines()
    assert words[0] == "frame 0: press at x 1.0 mm, y 1.0 mm, 3 N down"
    planned = load_bench_loads(tmp_path / "p.csv", drawing())
    np.testing.assert_allclose(planned.places[0, 0], [1e-3, 1e-3])
    assert planned.forces.shape == (3, 1, 3)


NAMES = "m.h5", "f.npy", "l.csv"


@pytest.mark.slow
def test_a_plan_is_better_than_presses_at_random():
    rng, model = np.random.default_rng(1), characterize_pad(drawing(**FEW), None, 40)
    plan = ff.plan_presses(model, 6, [COVER, EFFECT])
    loads = np.zeros((6, 4, 3))
    loads[range(6), rng.integers(0, 4, 6), 0] = rng.uniform(0.5, 3.0, 6)
    assert plan.ratio[-1] < ff.assess_presses(model, loads, [COVER, EFFECT]).ratio[-1]


def test_a_plan_promises_no_more_than_frames_hold():
    """The bound of Cramer and Rao, by differences of frames of pads with other covers."""
    pad = drawing(**FEW)
    loads = np.zeros((3, 4, 3))
    loads[range(3), range(3), 0] = 1.0, 2.0, 1.5
    plan = ff.assess_presses(characterize_pad(pad, None, 40), loads, [COVER])
    step, x = 0.02e-3, pad.tactels.places
    thin, thick = (
        characterize_pad(drawing(**{COVER: 0.5e-3 + way * step}, **FEW), None, 48, 8)
        for way in (-1, 1)
    )
    presses = [
        [Press(x=x[j, 0], y=x[j, 1], normal=loads[j, j, 0], width=pad.tactels.side)]
        for j in range(3)
    ]
    grey = pad.camera.amplitude * (thick.intensity(presses) - thin.intensity(presses)) / (2 * step)
    bound = np.sqrt(noise_variance(pad.camera) / np.square(grey).sum())
    found = plan.std[-1][plan.names.index(COVER)]
    # places, widths, light and effect are unknown besides
    assert bound < found < 30 * bound
