"""The temperature of the clear layer: one scale of the phase, taken out of readings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.cli import app

PATH = "transducer.photoelastic.temperature_coefficient"
REFERENCE = "transducer.photoelastic.reference_temperature"
WARM = 313.15
"""40 degC, 20 K above the reference."""


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="module")
def model() -> ff.SensorModel:
    sensor = ff.load_sensor("saad").replace(**{PATH: "-0.2 +/- 0.05 %/K"})
    return ff.characterize(sensor)


def test_phase_scales_by_one_plus_coefficient_times_distance(model: ff.SensorModel) -> None:
    forces = ff.polar(1.0, angle=10, n=11)
    # A sin^2(s p / 2) + I_o by hand, equation (13), within its noise
    frame = model.expose(forces, rng=0, temperature=WARM).astype(float)
    camera = model.sensor.camera
    light = np.sin((1 - 0.002 * 20) * model.phase(forces) / 2) ** 2
    assert np.abs(frame - camera.offset - camera.amplitude * light).max() < camera.noise + 0.51
    cold = model.expose(forces, rng=0, temperature=293.15)
    np.testing.assert_array_equal(cold, model.expose(forces, rng=0))


def test_readings_take_the_scale_out_and_state_its_deviation(model: ff.SensorModel) -> None:
    forces = ff.polar(1.0, angle=10, n=11)
    frame = model.expose(forces, rng=1, temperature=WARM)
    plain = ff.Reader(model).read(frame)
    reading = ff.Reader(model).read(frame, temperature=WARM)
    assert reading.ok
    np.testing.assert_allclose(reading.forces, plain.forces / 0.96, rtol=1e-12)
    mode = 20 * 0.0005 / 0.96 * reading.forces.ravel()
    expected = plain.covariance / 0.96**2 + np.outer(mode, mode)
    np.testing.assert_allclose(reading.covariance, expected, rtol=1e-9)
    assert (np.abs(reading.forces - forces) < 5 * reading.std).all()


def test_sensors_drawn_from_the_tolerance_are_read_within_their_deviations() -> None:
    # no other tolerance: the pull of the total force is that of the coefficient nearly alone
    sensor = ff.load_sensor("saad").replace(
        **{PATH: "-0.2 +/- 0.05 %/K", REFERENCE: "20 +/- 2 degC"}
    )
    model, forces = ff.characterize(sensor), ff.polar(1.0, angle=10, n=11)
    frames = [model.as_built(k).expose(forces, k, temperature=WARM) for k in range(60)]
    batch = ff.Reader(model).read_batch(np.array(frames), temperatures=WARM)
    total = batch.forces[:, :, 0].sum(axis=1)
    assert batch.covariance is not None
    std = np.sqrt(batch.covariance[:, ::2, ::2].sum(axis=(1, 2)))
    pull = (total - forces[:, 0].sum()) / std
    # chi-square of 60 degrees: 99.9 % between 31 and 100 (scipy.stats.chi2)
    assert 31 < pull @ pull < 100


SMALL = {
    "transducer.length": "15 mm",
    "transducer.width": "15 mm",
    "skin.extent": ["12 mm", "12 mm"],
    "camera.pixels": [96, 96],
}


@pytest.mark.parametrize(
    ("design", "press"),
    [
        (ff.load_sensor("skin"), ff.Press(x=1e-3, normal=2.0, tangential=0.3, width=1.1e-3)),
        (
            ff.load_sensor("pad-skin").replace(**SMALL),
            ff.Press(x=1e-3, y=-2e-3, normal=4.0, tangential=(0.5, 0.2), radius=6e-3),
        ),
    ],
    ids=["strip", "pad"],
)
def test_contacts_on_skins_keep_their_places_and_gain_the_scale(
    design: ff.Sensor | ff.Pad, press: ff.Press
) -> None:
    """At 40 degC its light is that of a coefficient which is four per cent smaller."""
    layer = design.transducer.photoelastic
    effect = f"transducer.photoelastic.{layer.effect}"
    weaker = design.replace(**{effect: 0.96 * getattr(layer, layer.effect)})
    frame = ff.characterize(weaker).expose([press], rng=1)
    warm = ff.characterize(design.replace(**{PATH: "-0.2 +/- 0.05 %/K"}))
    plain, reading = ff.Reader(warm).read(frame), ff.Reader(warm).read(frame, temperature=WARM)
    assert reading.ok
    assert plain.total is not None
    assert reading.total is not None
    relative = 20 * 0.0005 / 0.96
    for one, other in zip(
        (plain.total, *plain.contacts), (reading.total, *reading.contacts), strict=True
    ):
        np.testing.assert_allclose(0.96 * other.force, one.force, rtol=1e-9)
        np.testing.assert_allclose(0.96 * other.moment, one.moment, rtol=1e-9)
        np.testing.assert_array_equal(other.place, one.place)
        np.testing.assert_allclose(other.place_std, one.place_std, rtol=1e-9)
        std = np.hypot(one.force_std / 0.96, relative * other.force)
        np.testing.assert_allclose(other.force_std, std, rtol=1e-9)
    assert abs(reading.total.force[0] - press.normal) < 4 * reading.total.force_std[0]
    batch = ff.Reader(warm).read_batch(frame[None], covariance=False, temperatures=WARM)
    assert batch.resultants is not None
    np.testing.assert_allclose(batch.resultants[0][0].force, reading.total.force, rtol=1e-6)


def test_a_recording_that_warms_up_while_it_creeps_is_read(model: ff.SensorModel) -> None:
    soft = model.sensor.replace(**{"transducer.relaxation": [["8 %", "3 s"]]})
    creeping, times = ff.characterize(soft), np.arange(40) * 0.25
    forces = np.zeros((40, 11, 2))
    forces[2:, 5, 0] = 2.0
    warm = 293.15 + np.linspace(0, 25, 40)
    frames = creeping.expose(forces, rng=0, times=times, temperature=warm)
    batch = ff.Reader(creeping).read_batch(frames, times=times, temperatures=warm)
    left = batch.forces[3:] - forces[3:]
    assert np.abs(left / batch.std[3:]).max() < 5
    # at 318 K the scale alone is 5 %, creep up to 9 %
    assert abs(left[:, 5, 0].mean()) < 0.01
    single = list(ff.Reader(creeping).stream(frames, times=times, temperatures=warm))
    np.testing.assert_allclose(single[-1].forces, batch.forces[-1], atol=0.02)
    np.testing.assert_allclose(single[-1].std, batch.std[-1], rtol=0.1)


def test_designs_keep_coefficient_and_reference() -> None:
    sensor = ff.load_sensor("saad").replace(
        **{PATH: "-0.2 %/K +/- 25 %", REFERENCE: "25 +/- 1 degC"}
    )
    layer = sensor.transducer.photoelastic
    assert layer.temperature_coefficient == pytest.approx(-0.002)
    assert layer.reference_temperature == 298.15
    assert sensor.tolerances[PATH] == pytest.approx(0.0005)
    assert sensor.tolerances[REFERENCE] == pytest.approx(1.0)
    text = sensor.to_toml()
    assert '"25 degC +/- 1 K"' in text
    assert "%/K" in text
    path = Path("warm.toml")
    path.write_text(text)
    assert ff.load_sensor(path) == sensor


@pytest.mark.parametrize(
    ("temperature", "words"), [(25.0, "give kelvin"), (np.nan, "finite"), (900.0, "leaves no")]
)
def test_wrong_temperatures_are_refused(
    model: ff.SensorModel, temperature: float, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        model.expose(np.zeros((11, 2)), temperature=temperature)
    with pytest.raises(InputError, match=words):
        ff.Reader(model).read(np.zeros(2048), temperature=temperature)


def test_designs_without_a_coefficient_refuse_temperatures() -> None:
    model = ff.characterize(ff.load_sensor("saad"))
    with pytest.raises(InputError, match="temperature_coefficient"):
        ff.Reader(model).read(np.zeros(2048), temperature=WARM)
    with pytest.raises(InputError, match="do not fit"):
        ff.Reader(ff.characterize(model.sensor.replace(**{PATH: "-0.2 %/K"}))).read_batch(
            np.zeros((3, 2048)), temperatures=[WARM, WARM]
        )


def test_live_asks_a_thermometer(model: ff.SensorModel) -> None:
    forces = ff.polar(1.0, angle=10, n=11)
    np.save("warm.npy", model.expose([forces] * 8, rng=0, temperature=WARM))
    camera = ff.open_camera("file:warm.npy", model)
    sink = ff.open_sink("csv:warm.csv", model)
    ff.live(ff.Reader(model), camera, [sink], temperature=lambda: WARM)
    found = np.genfromtxt("warm.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    assert abs(found["normal_N"].mean() - forces[0, 0]) < 0.02


def test_commands_take_a_temperature_and_a_log(model: ff.SensorModel) -> None:
    model.save("warm.h5")
    Path("loads.csv").write_text(
        "frame,tactel,normal_N,tangential_N\n" + "".join(f"{k},5,2,0\n" for k in range(4))
    )
    Path("log.csv").write_text("time_s,temperature_degC\n0,20\n3,50\n")
    run = CliRunner().invoke
    simulated = run(
        app,
        [
            "simulate",
            "warm.h5",
            "loads.csv",
            "-o",
            "shots.h5",
            "--fps",
            "1",
            "--temperature",
            "log.csv",
        ],
    )
    assert simulated.exit_code == 0, simulated.output
    done = run(
        app,
        [
            "read",
            "warm.h5",
            "shots.h5",
            "-o",
            "forces.csv",
            "--fps",
            "1",
            "--temperature",
            "log.csv",
        ],
    )
    assert done.exit_code == 0, done.output
    rows = np.genfromtxt("forces.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    np.testing.assert_allclose(rows["normal_N"][rows["tactel"] == 5], 2.0, atol=0.05)
    log = ["-o", "forces.csv", "--temperature", "log.csv"]
    kept = run(app, ["read", "warm.h5", "shots.h5", *log])  # the file has the times
    assert kept.exit_code == 0, kept.output
    assert run(app, ["simulate", "warm.h5", "loads.csv", "-o", "still.h5"]).exit_code == 0
    refused = run(app, ["read", "warm.h5", "still.h5", *log])
    assert refused.exit_code != 0
    assert "--fps" in str(refused.exception or refused.output)
    kelvin = run(app, ["read", "warm.h5", "shots.h5", "-o", "forces.csv", "--temperature", "298"])
    assert kelvin.exit_code != 0
    assert "such as 24.85 for 298 K" in str(kelvin.exception)
    pad = ff.load_sensor("pad").replace(**{PATH: "-0.2 %/K"})
    Path("pad.toml").write_text(pad.to_toml(), encoding="utf-8")
    Path("presses.csv").write_text(
        "frame,tactel,normal_N,tangential_x_N,tangential_y_N\n0,60,2,0,0\n3,60,2,0,0\n"
    )
    words = ["simulate", "pad.toml", "presses.csv", "-o", "pad.h5", "--fps", "1"]
    warm = run(app, [*words, "--temperature", "log.csv"])
    assert warm.exit_code == 0, warm.output


def test_a_warm_pad_is_read_with_the_force_that_acts() -> None:
    pad = ff.load_sensor("pad").replace(
        tactels={"count": [2, 2]}, **{PATH: "-0.2 +/- 0.05 %/K", "camera.pixels": [96, 96]}
    )
    model, forces = ff.characterize(pad), np.zeros((4, 3))
    forces[1] = 1.5, 0.3, -0.2
    frame = model.expose(forces, rng=0, temperature=WARM)
    plain = ff.Reader(model).read(frame)
    reading = ff.Reader(model).read(frame, temperature=WARM)
    # light of 1 - 0.2 % of 20 K, a twenty-fifth less, is that of so much smaller forces
    np.testing.assert_allclose(plain.forces / reading.forces, 0.96)
    assert (np.abs(reading.forces - forces) < 5 * reading.std).all()
    assert np.abs(plain.forces[1, 0] - 1.5) > 5 * plain.std[1, 0]
    with pytest.raises(InputError, match="not with presses"):
        model.expose([ff.Press(x=0.0, y=0.0, normal=1.0, width=1e-3)], temperature=WARM)
