"""Models from matrices that were given: an exact series, and a beam in four-point bending."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.cli import app
from fringeforce.io.tables import save_forces
from fringeforce.mechanics import fourier
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant
from fringeforce.studies.summary import summary

CAMERA = {
    "pixels": 256,
    "bits": 8,
    "amplitude": 200.0,
    "offset": 20.0,
    "noise": 4.0,
    "noise_model": "gaussian",
}
HEIGHT, ARM, FRINGE = 25.4e-3, 27.6e-3, 7.6e3
Y = np.linspace(-HEIGHT / 2, HEIGHT / 2, 41)
BENDING = 2 * np.pi * 6 * ARM / (HEIGHT**3 * FRINGE) * Y
"""Phase per total load F: moment F a / 2, stress 12 M y / (t h^3), order sigma t / f_sigma."""


def _beam(light: dict[str, Any] | None = None, **more: Any) -> ff.SensorModel:
    polariscope = {"wavelength": "546.1 nm", **(light or {})}
    return ff.model_from_influence(Y, BENDING[:, None], CAMERA, polariscope, **more)


@pytest.fixture(scope="module")
def strips() -> tuple[ff.SensorModel, ff.SensorModel]:
    """The shipped strip on rollers, by finite elements and by the exact series."""
    sensor = ff.load_sensor("saad").replace(**{"transducer.edges": "roller"})
    x = np.linspace(-12.5e-3, 12.5e-3, 1001)
    stress = fourier.integrated_stress(sensor.transducer, sensor.tactels.positions, x, 1000)
    wavelength = sensor.polariscope.wavelength
    psi = phase_lead(stress, stress_optic_constant(sensor.transducer.photoelastic, wavelength))
    given = ff.model_from_influence(
        x,
        psi,
        sensor.camera.model_dump(exclude_none=True),
        {"wavelength": wavelength},
        positions=sensor.tactels.positions,
    )
    return ff.characterize(sensor), given


@pytest.mark.slow
def test_an_exact_series_reads_like_the_shipped_model(
    strips: tuple[ff.SensorModel, ff.SensorModel],
) -> None:
    shipped, _ = strips
    forces = ff.polar(np.linspace(0.3, 1.2, 11), angle=10, n=11)
    frame = shipped.expose(forces, rng=4)
    one, other = (ff.Reader(model).read(frame) for model in strips)
    assert other.status == one.status == ff.Status.OK
    assert np.abs(other.forces - one.forces).max() < 0.2 * one.std.min()
    np.testing.assert_allclose(other.std, one.std, rtol=0.02)
    assert (np.abs(other.forces - forces) < 4.5 * other.std).all()


@pytest.mark.slow
@pytest.mark.parametrize("load", [35.0, 78.0, 133.0])
def test_a_beam_in_bending_reads_its_load(load: float) -> None:
    rng = np.random.default_rng(7)
    pixels = (np.arange(256) + 0.5) / 256 * HEIGHT - HEIGHT / 2
    order = 6 * ARM * load * pixels / HEIGHT**3 / FRINGE  # fringes by the formula, not the model
    light = 20 + 200 * np.sin(np.pi * order) ** 2
    frame = np.rint(light + rng.normal(0, 4, 256)).clip(0, 255)
    reading = ff.Reader(_beam()).read(frame)
    assert reading.status == ff.Status.OK
    assert abs(reading.forces[0, 0] - load) < 4 * reading.std[0, 0] < 0.01 * load
    # the tangential force was said to be none
    assert abs(reading.forces[0, 1]) <= reading.std[0, 1] < 1e-5 * load


@pytest.mark.slow
def test_a_scale_that_is_uncertain_is_as_uncertain_in_the_load() -> None:
    beam = _beam(scale_error="3 %")
    reader = ff.Reader(beam)
    errors = []
    for seed in range(24):
        reading = reader.read(beam.as_built(rng=seed).expose([[100.0, 0.0]], rng=seed))
        assert reading.std[0, 0] == pytest.approx(3.0, rel=0.15)
        errors.append((reading.forces[0, 0] - 100) / reading.std[0, 0])
    # 24 squares of unit normal numbers sum to 8.1 .. 51 in 99.9 of 100 cases (chi-square)
    assert 8.1 < np.square(errors).sum() < 51.2


def test_single_loads_are_found_behind_a_tone_curve_that_is_cut_off() -> None:
    """The light, the offset and the gamma of an overexposed camera are unknown by a quarter."""
    camera = CAMERA | {"amplitude": "360 +/- 100", "offset": "12 +/- 6", "gamma": "0.45 +/- 0.08"}
    light = {"wavelength": "546.1 nm", "residual": "0 +/- 0.3 rad", "residual_length": "12 mm"}
    camera |= {"clipped": True, "shift": "0 +/- 0.1 mm"}
    beam = ff.model_from_influence(Y, BENDING[:, None], camera, light)
    reader, errors, rng = ff.Reader(beam), [], np.random.default_rng(0)
    for seed in range(16):
        load = rng.uniform(50, 150)
        reading = reader.search(beam.as_built(rng=seed).expose([[load, 0.0]], rng=seed))
        errors.append((reading.forces[0, 0] - load) / reading.std[0, 0])
    # 16 squares of unit normal numbers sum to 4.0 .. 39 in 99.9 of 100 cases (chi-square)
    assert 4.0 < np.square(errors).sum() < 39


@pytest.fixture(scope="module")
def pulled() -> tuple[ff.BuiltSensor, np.ndarray, np.ndarray]:
    """A beam whose scale is 4 % off and whose lamp is dim, with six frames of known loads."""
    drawn = _beam({"residual": "0 +/- 0.1 rad"})
    dim = drawn.sensor.replace(**{"camera.amplitude": 188.0})
    true = replace(drawn, sensor=dim, psi=1.04 * drawn.psi).as_built(rng=4)
    loads = np.zeros((6, 1, 2))
    loads[:, 0, 0] = [35, 60, 78, 100, 126, 133]
    return true, np.stack([true.expose(load, rng=n) for n, load in enumerate(loads)]), loads


def test_known_loads_tell_the_scale_of_a_given_matrix(
    pulled: tuple[ff.BuiltSensor, np.ndarray, np.ndarray], tmp_path: Path
) -> None:
    true, frames, loads = pulled
    beam = _beam({"residual": "0 +/- 0.1 rad"}, scale_error="5 %")
    found = ff.update(beam, frames, loads=loads)
    assert found.calibration is not None
    assert found.calibration.usable
    scale, std = found.calibration.values[0], found.calibration.std[0]
    assert std < 0.002
    assert abs(scale - 1.04) < 4 * std
    np.testing.assert_allclose(found.psi, scale * beam.psi, rtol=1e-4, atol=1e-9)
    found.save(tmp_path / "found.h5")
    errors = []
    for seed, load in enumerate(np.linspace(40, 130, 24)):
        frame = true.expose([[load, 0.0]], rng=100 + seed)
        reading = ff.Reader(found).read(frame)
        assert reading.std[0, 0] < 0.5
        errors.append((reading.forces[0, 0] - load) / reading.std[0, 0])
        if seed == 0:
            again = ff.Reader(ff.load_model(tmp_path / "found.h5")).read(frame)
            np.testing.assert_allclose(again.forces, reading.forces, rtol=1e-9)
    # what all readings share, their mean shows once: 24 squares and one more
    assert np.square(errors).mean() < 4.5


def test_frames_without_load_do_for_readings(
    pulled: tuple[ff.BuiltSensor, np.ndarray, np.ndarray],
) -> None:
    true, _, _ = pulled
    beam = _beam({"residual": "0 +/- 0.1 rad"})
    rest = np.stack([true.expose(np.zeros((1, 2)), rng=n) for n in range(3)])
    found = ff.update(beam, rest, unloaded=True)
    reading = ff.Reader(found).search(true.expose([[80.0, 0.0]], rng=9))
    assert np.isfinite(reading.std).all()


def test_the_command_takes_known_loads(
    pulled: tuple[ff.BuiltSensor, np.ndarray, np.ndarray], tmp_path: Path
) -> None:
    _, frames, loads = pulled
    _beam(scale_error="5 %").save(tmp_path / "beam.h5")
    np.save(tmp_path / "f.npy", frames)
    save_forces(tmp_path / "loads.csv", loads)
    names = [str(tmp_path / name) for name in ("beam.h5", "f.npy", "loads.csv", "found.h5")]
    command = ["update", *names[:2], "--loads", names[2], "-o", names[3]]
    ended = CliRunner().invoke(app, command)
    assert ended.exit_code == 0, ended.output
    assert "The strength of the effect changed by +" in ended.output


def test_loads_that_do_not_fit_are_refused() -> None:
    beam, frames = _beam(), np.zeros((2, 256))
    with pytest.raises(InputError, match="contradict"):
        ff.update(beam, frames, loads=np.zeros((2, 1, 2)), unloaded=True)
    with pytest.raises(InputError, match=r"\(3, 1, 2\) do not fit 2 frames"):
        ff.update(beam, frames, loads=np.zeros((3, 1, 2)))


@pytest.mark.slow
def test_a_stream_of_a_rising_load_is_followed() -> None:
    beam, loads = _beam({"residual": "0 +/- 0.1 rad"}), np.linspace(60, 80, 40)
    frames = beam.as_built(rng=1).expose([[[load, 0.0]] for load in loads], rng=2)
    readings = list(ff.Reader(beam).stream(frames))
    errors = np.array([r.forces[0, 0] for r in readings]) - loads
    std = np.array([r.std[0, 0] for r in readings])
    assert np.isfinite(std).all()
    assert (np.abs(errors) < 4.5 * std).all()


def test_a_given_model_is_saved_whole(tmp_path: Path) -> None:
    beam = _beam({"residual": "0 +/- 0.1 rad"}, scale_error=0.02, influence_error="1 %")
    beam.save(tmp_path / "beam.h5")
    again = ff.load_model(tmp_path / "beam.h5")
    assert again.sensor == beam.sensor
    np.testing.assert_array_equal(again.psi, beam.psi)
    x = np.linspace(-HEIGHT / 2, HEIGHT / 2, 77)
    expected = np.interp(x, Y, BENDING)
    np.testing.assert_allclose(again.influence(x)[:, 0, 0], expected, atol=1e-12)


def test_what_needs_the_mechanics_is_refused() -> None:
    beam = _beam()
    with pytest.raises(InputError, match="was given"):
        ff.characterize(beam.sensor)
    with pytest.raises(InputError, match="was given"):
        beam.phase([ff.Press(x=0.0, normal=1.0, width=1e-3)])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"x": Y[::-1]}, "ascending"),
        ({"x": Y[:3]}, "at least four"),
        ({"psi": BENDING[1:, None]}, "does not fit 41 stations"),
        ({"psi": np.zeros((41, 1))}, "changes no phase"),
        ({"psi": np.full((41, 1), np.nan)}, "not finite"),
        ({"psi": np.ones((41, 1, 3))}, "three single forces"),
        ({"length": 0.05}, "not within the stations"),
        ({"x": Y + 0.02}, "not within the stations"),
        ({"positions": [0.0, 1e-3]}, "one for each"),
        ({"scale_error": "three"}, "no share"),
        ({"camera": {"pixels": 256}}, "camera.bits is missing"),
    ],
)
def test_what_does_not_fit_is_one_clear_error(change: dict[str, Any], message: str) -> None:
    stated: dict[str, Any] = {"x": Y, "psi": BENDING[:, None], "camera": CAMERA}
    stated |= {"polariscope": {"wavelength": "546 nm"}} | change
    with pytest.raises(InputError, match=message):
        ff.model_from_influence(**stated)


def test_a_summary_tells_nothing_of_layers_that_are_not_there() -> None:
    facts = dict(summary(_beam()))
    assert facts["forces"] == "1, over 25.4 mm"
    assert not {"strip", "compliant layer", "stress-optic constant K_t"} & set(facts)
    # 2 pi 6 a / (H^2 2 f) at the edges of the beam; noise of 4 levels of 200
    assert "0.106 rad normal: good, above the limit of 0.04 rad" in facts["peak phase per newton"]
    assert facts["condition number"].startswith("1 of")
