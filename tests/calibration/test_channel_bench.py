"""Calibration of a strip under three lights at once, on frames of the exact series."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.stats import binom, chi2

import fringeforce as ff
from fringeforce.calibration.planning.plan import next_presses
from fringeforce.design.strip import Sensor
from fringeforce.models.imaging import Imaging
from fringeforce.plotting.calibration_report import calibration_report
from fringeforce.studies.summary import calibration_summary
from reading.exact_frames import Bench, drawing, loads

Array = NDArray[np.float64]
pytestmark = pytest.mark.slow

EFFECT = "transducer.photoelastic.strain_optic_coefficient"
MODULUS = "transducer.compliant.youngs_modulus"
THICKNESS = "transducer.compliant.thickness"
CROSSTALK = "polariscope.crosstalk"
WAVES = "635 nm", "525 nm", "470 nm"
PIXELS, PRESSES, NEW = 512, 32, 20
SHIFT = 0.12e-3
FAR = 3.3
"""Standard deviations beyond which one of a thousand values lies."""
CHANCE = 1e-3


def drawn(**values: object) -> Sensor:
    lights = [
        {"wavelength": w, "amplitude": a} for w, a in zip(WAVES, (200, 160, 220), strict=True)
    ]
    return drawing(
        **{
            "camera.pixels": PIXELS,
            "tactels.contact_width": "0.2 mm",
            "camera.amplitude": 200.0,
            "camera.offset": 12.0,
            "polariscope.channels": lights,
            CROSSTALK: "5 +/- 3 %",
            **values,
        }
    )


@pytest.fixture(scope="module")
def bench() -> Bench:
    """A sensor that is not as drawn, in nothing but what a calibration finds."""
    rng, made = np.random.default_rng(41), drawn()
    true = {EFFECT: 0.053, MODULUS: 10.2e6, THICKNESS: 0.51e-3}
    along = np.linspace(-1, 1, PIXELS)
    others = np.abs(0.05 + 0.03 * rng.standard_normal((3, 3))) * (1 - np.eye(3))
    own = Bench(
        made.replace(**true),
        made.tactels.positions,
        np.full(11, 0.2e-3),
        shift=SHIFT,
        residual=0.1 * np.cos(4 * along),
        gain=np.array([1 + 0.04 * np.sin(2 * along), 1 - 0.05 * along**2, 1 + 0.03 * along]),
        visibility=0.97,
        blur=1.2,
        shares=others + np.diag(1 - others.sum(axis=1)),
        light=(np.array([196.0, 152.0, 212.0]), np.array([13.0, 11.0, 12.0])),
    )
    influence = own.influence()
    own.influence = lambda: influence  # type: ignore[method-assign]  # the same of all frames
    return own


def pressed(bench: Bench, seed: int, count: int = PRESSES) -> tuple[Array, NDArray[np.uint8]]:
    """Presses on one or two tactels, and frames of them."""
    rng = np.random.default_rng([43, seed])
    forces = loads(rng, count, largest=2.5)
    few = np.argsort(rng.random(forces.shape[:2])) < rng.integers(1, 3, (count, 1))
    forces[~few] = 0.0
    return forces, bench.frames(forces, rng)


@pytest.fixture(scope="module")
def model(bench: Bench) -> ff.SensorModel:
    forces, frames = pressed(bench, 0)
    return ff.calibrate(drawn(), frames, forces)


def test_the_sensor_is_found_with_its_cross_talk(bench: Bench, model: ff.SensorModel) -> None:
    found = model.calibration
    assert found is not None
    assert found.usable
    assert bench.shares is not None
    layers = bench.sensor.transducer
    true = {
        EFFECT: layers.photoelastic.strain_optic_coefficient,
        MODULUS: layers.compliant.youngs_modulus,
        THICKNESS: layers.compliant.thickness,
        "camera shift": SHIFT,
        "camera scale": 1.0,
    }
    true |= {
        f"{CROSSTALK}.{c}.{d}": bench.shares[c, d] for c in range(3) for d in range(3) if c != d
    }
    assert set(found.names) == set(true)
    for name, value, std in zip(found.names, found.values, found.std, strict=True):
        assert abs(value - true[name]) < FAR * std, name
        if name.startswith(CROSSTALK):
            assert std < 0.03  # of the drawing
            drawn_share = model.sensor.polariscope.crosstalk[int(name[-3])][int(name[-1])]
            assert drawn_share == pytest.approx(max(value, 0.0))


def assert_light_found(seen: Imaging | None, bench: Bench) -> None:
    """The light of every channel is found within its deviations."""
    assert seen is not None
    assert bench.light is not None
    bright = bench.visibility * bench.light[0][:, None] * bench.gain
    unsure = np.sqrt(np.square(seen.amplitude_modes).sum(axis=0))
    off = (seen.amplitude - bright.ravel())[seen.usable] / unsure[seen.usable]
    assert np.mean(np.abs(off) < 2) > 0.8  # neighbours err together
    assert np.abs(off).max() < 5


def test_light_is_found_channel_by_channel(bench: Bench, model: ff.SensorModel) -> None:
    assert_light_found(model.imaging, bench)


def read_well(reader: ff.Reader, frames: NDArray[np.uint8], forces: Array) -> list[ff.Reading]:
    """The readings that are OK: nearly all of new frames, within their deviations."""
    readings = [reader.search(frame) for frame in frames]
    good = [k for k, one in enumerate(readings) if one.ok]
    assert len(frames) - len(good) <= binom.ppf(1 - CHANCE, len(frames), 0.02)
    squares = []
    for k in good:
        off = (readings[k].forces - forces[k]).ravel()
        squares.append(off @ np.linalg.solve(readings[k].covariance, off))
    # readings share the calibration, some dozen numbers
    low, high = chi2.ppf([CHANCE, 1 - CHANCE], 22 * len(good) / 2)
    assert low < np.sum(squares) / 2 < high
    return [readings[k] for k in good]


def test_new_frames_are_read_within_their_deviations(
    bench: Bench, model: ff.SensorModel, tmp_path
) -> None:
    model.save(tmp_path / "m.h5")
    reader, rng = ff.Reader(ff.load_model(tmp_path / "m.h5")), np.random.default_rng(47)
    forces = loads(rng, NEW)
    single, *_ = read_well(reader, bench.frames(forces, rng), forces)
    alone = ff.Reader(model).search(bench.frames(forces[:1], np.random.default_rng(47))[0])
    assert_allclose(alone.std, single.std, rtol=0.05)


NOISY = 3.0, 6.0, 12.0
"""Noise of the channels of a camera whose white balance amplifies two colours, grey levels."""


@pytest.fixture(scope="module")
def unequal(bench: Bench) -> Bench:
    """The same sensor before such a camera."""
    lights = [
        {**channel.model_dump(include={"wavelength", "amplitude"}), "noise": noise}
        for channel, noise in zip(bench.sensor.polariscope.channels, NOISY, strict=True)
    ]
    assert bench.light is not None
    light = bench.light[0], np.array([15.0, 13.0, 14.0])
    made = bench.sensor.replace(**{"polariscope.channels": lights, "camera.offset": 14.0})
    own = replace(bench, sensor=made, light=light)
    own.influence = bench.influence  # type: ignore[method-assign]
    return own


def test_channels_of_unequal_noise_count_by_it(bench: Bench, unequal: Bench) -> None:
    lights = [
        {"wavelength": wave, "amplitude": amplitude, "noise": noise}
        for wave, amplitude, noise in zip(WAVES, (200, 160, 220), NOISY, strict=True)
    ]
    forces, frames = pressed(unequal, 3)
    drawing_ = drawn(**{"polariscope.channels": lights, "camera.offset": 14.0})
    found = ff.calibrate(drawing_, frames, forces)
    told = found.calibration
    assert told is not None
    assert told.usable
    assert not told.dead
    assert not told.outliers
    # 32 frames of 1536 pixels; uniform noise scatters less than normal noise
    assert abs(told.chi2 - 1) < 4 * np.sqrt(2 / frames.size)
    layers = bench.sensor.transducer
    true = {
        EFFECT: layers.photoelastic.strain_optic_coefficient,
        MODULUS: layers.compliant.youngs_modulus,
        THICKNESS: layers.compliant.thickness,
        "camera shift": SHIFT,
    }
    for name, value in true.items():
        place = told.names.index(name)
        assert abs(told.values[place] - value) < FAR * told.std[place], name
    assert_light_found(found.imaging, unequal)
    rng = np.random.default_rng(73)
    more = loads(rng, NEW)
    read_well(ff.Reader(found), unequal.frames(more, rng), more)


def test_summary_and_report_have_the_shares(model: ff.SensorModel, tmp_path) -> None:
    said = "\n".join(calibration_summary(model))
    assert f"{CROSSTALK}.0.1" in said
    assert "0.05 -> 0.0" in said
    calibration_report(model, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert f"{CROSSTALK}.2.1" in page


def test_a_sensor_that_is_not_the_drawn_one_is_not_to_be_used(bench: Bench) -> None:
    forces, frames = pressed(bench, 1, 16)
    thin = drawn(**{THICKNESS: "0.45 +/- 0.005 mm"})
    found = ff.calibrate(thin, frames, forces, aside=0).calibration
    assert found is not None
    assert not found.usable
    assert "not the one of the drawing" in found.findings[0]


def test_dead_pixels_of_one_channel_are_left_out_and_named(bench: Bench) -> None:
    forces, frames = pressed(bench, 2, 16)
    frames[:, 1, 100] = 90
    model = ff.calibrate(drawn(), frames, forces, aside=0)
    assert model.calibration is not None
    assert model.calibration.dead == (PIXELS + 100,)
    assert any(
        "Pixels 100 of channel 2 do not follow" in said for said in model.calibration.findings
    )


def test_a_plan_begins_with_what_the_calibration_left_uncertain(model: ff.SensorModel) -> None:
    assert model.calibration is not None
    plan = ff.plan_presses(model, 3)
    assert plan.names == model.calibration.names
    assert_allclose(plan.std[0], model.calibration.std, rtol=1e-6)
    assert (np.diff(plan.ratio) < 0).all()
    assert next_presses(model, plan.loads).startswith("Readings are expected to err")


@pytest.fixture(scope="module")
def later(bench: Bench) -> Bench:
    """The same sensor weeks on: every LED, the filters, the residual and the camera drifted."""
    assert bench.shares is not None
    assert bench.light is not None
    along = np.linspace(-1, 1, PIXELS)
    drift = np.array([[0.0, 0.012, -0.008], [0.007, 0.0, 0.015], [-0.01, 0.006, 0.0]])
    others = np.maximum(bench.shares * (1 - np.eye(3)) + drift, 0.0)
    amplitude, offset = bench.light
    own = replace(
        bench,
        shift=SHIFT + 0.06e-3,
        residual=bench.residual + 0.12 * np.sin(2.5 * along + 0.4),
        gain=bench.gain * (1 + 0.03 * np.sin(1.5 * along)),
        shares=others + np.diag(1 - others.sum(axis=1)),
        light=(amplitude * [0.93, 1.03, 0.97], offset + np.array([0.5, -0.5, 0.3])),
    )
    influence = own.influence()
    own.influence = lambda: influence  # type: ignore[method-assign]  # the same of all frames
    return own


@pytest.fixture(scope="module")
def updated(model: ff.SensorModel, later: Bench) -> ff.SensorModel:
    rng = np.random.default_rng(53)
    return ff.update(model, later.frames(loads(rng, 12), rng))


def test_drift_of_every_channel_is_found_under_unknown_loads(
    bench: Bench, later: Bench, updated: ff.SensorModel
) -> None:
    found = updated.calibration
    assert found is not None
    assert found.usable
    said = "\n".join(found.findings)
    for number, way in enumerate("-+-", start=1):
        assert f"The light of channel {number} changed by {way}" in said
    assert "The share of channel 3 in the light of channel 2 changed by +" in said
    assert later.shares is not None
    true = {"camera shift": later.shift}
    true |= {
        f"{CROSSTALK}.{c}.{d}": later.shares[c, d] for c in range(3) for d in range(3) if c != d
    }
    at = [found.names.index(name) for name in true]
    off = (found.values[at] - list(true.values())) / found.std[at]
    assert np.abs(off).max() < FAR
    assert_light_found(updated.imaging, later)


def test_frames_are_refused_before_an_update_and_read_after_it(
    model: ff.SensorModel, updated: ff.SensorModel, later: Bench, tmp_path
) -> None:
    updated.save(tmp_path / "later.h5")
    rng = np.random.default_rng(59)
    forces = loads(rng, NEW)
    frames = later.frames(forces, rng)
    before, reader = ff.Reader(model), ff.Reader(ff.load_model(tmp_path / "later.h5"))
    assert not any(before.search(frame).ok for frame in frames[:4])
    read_well(reader, frames, forces)


def test_unloaded_frames_tell_darkness_and_leave_the_light_of_channels_open(
    model: ff.SensorModel, later: Bench
) -> None:
    """Without load fringes are dark: what they do not show becomes a tolerance of readings."""
    rng = np.random.default_rng(61)
    found = ff.update(model, later.frames(np.zeros((6, 11, 2)), rng), unloaded=True)
    assert found.calibration is not None
    said = "\n".join(found.calibration.findings)
    assert "The camera's place: these frames do not tell" in said
    assert "only known loads tell" in said
    assert found.sensor.tolerances["camera.shift"] == pytest.approx(0.1e-3)
    reader, forces = ff.Reader(found), loads(rng, 8)
    readings = [reader.search(frame) for frame in later.frames(forces, rng)]
    assert sum(one.ok for one in readings) >= 6
    for one, force in zip(readings, forces, strict=True):
        if one.ok:
            off = (one.forces - force).ravel()
            assert off @ np.linalg.solve(one.covariance, off) < chi2.ppf(1 - CHANCE / 8, 22) * 2


def test_a_reader_that_follows_allows_for_drift_of_channels_that_is_stated(
    model: ff.SensorModel, bench: Bench, later: Bench
) -> None:
    """One LED fades by 7 % and light leaks into its channel while a load sways."""
    stated: dict[str, str] = {"polariscope.channels.0.amplitude": "200 +/- 5 %"}
    found = model.sensor.polariscope.crosstalk
    stated |= {f"{CROSSTALK}.0.{c}": f"{found[0][c]} +/- 0.01" for c in (1, 2)}
    reader, rng = ff.Reader(model.with_tolerances(**stated)), np.random.default_rng(71)
    assert bench.light is not None
    assert bench.shares is not None
    assert later.shares is not None
    mean, count = loads(rng, 1)[0], 40
    for k in range(count):
        light = bench.light[0] * [1 - 0.07 * k / count, 1.0, 1.0], bench.light[1]
        shares = bench.shares.copy()
        shares[0] += k / count * (later.shares - bench.shares)[0]
        own = replace(bench, light=light, shares=shares)
        own.influence = bench.influence  # type: ignore[method-assign]
        forces = mean * (1 + 0.3 * np.sin(k / 8))
        reading = reader.read(own.frames(forces[None], rng)[0])
        assert reading.ok
        off = (reading.forces - forces).ravel()
        assert off @ np.linalg.solve(reading.covariance, off) < chi2.ppf(1 - CHANCE / count, 22)


def test_another_sensor_is_no_drift(model: ff.SensorModel, bench: Bench) -> None:
    thick = replace(bench, sensor=bench.sensor.replace(**{THICKNESS: 0.6e-3}))
    rng = np.random.default_rng(67)
    found = ff.update(model, thick.frames(loads(rng, 4), rng)).calibration
    assert found is not None
    assert not found.usable


def test_loads_of_other_frames_are_not_to_be_used(bench: Bench, cause_not_asked: None) -> None:
    """What explains none of them runs to the thinnest cover that is solved, and no farther."""
    forces, frames = (part[:24] for part in pressed(bench, 0))
    mixed = np.random.default_rng(0).permutation(24)
    found = ff.calibrate(drawn(), frames, forces[mixed], aside=0).calibration
    assert found is not None
    assert not found.usable
    thickness = found.values[found.names.index(THICKNESS)]
    assert 0.5e-3 / 4 * (1 - 1e-9) <= thickness <= 0.5e-3 * 4 * (1 + 1e-9)
