"""Channels of unequal light, such as a colour camera's under LEDs: frames of the exact series."""

from collections.abc import Iterable

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray
from scipy.stats import binom, chi2

import fringeforce as ff
from fringeforce.base.errors import DesignError
from fringeforce.studies.summary import summary
from reading.exact_frames import Bench, drawing, loads

Array = NDArray[np.float64]
WAVES = "635 nm", "525 nm", "470 nm"
BRIGHT, DARK = np.array([200.0, 150.0, 235.0]), np.array([8.0, 12.0, 6.0])
SPREAD, DARKER = 0.03, 0.3
FRAMES, REFUSED = 60, 10
CHANNELS, CROSSTALK = "polariscope.channels", "polariscope.crosstalk"


def lights(bright: Iterable = BRIGHT, dark: Iterable = DARK) -> list[dict[str, object]]:
    """Channels with light of their own."""
    own = zip(WAVES, bright, dark, strict=True)
    return [{"wavelength": w, "amplitude": a, "offset": b} for w, a, b in own]


STATED = lights(
    [f"{a} +/- {SPREAD * 100:g} %" for a in BRIGHT], [f"{b} +/- {DARKER}" for b in DARK]
)


@pytest.fixture(scope="module")
def plain() -> ff.Sensor:
    return drawing(**{CHANNELS: lights()})


def exact(plain: ff.Sensor, seed: int, count: int, light: tuple | None = None) -> tuple:
    """Forces, and frames of them under light of their own: as `STATED` if not given."""
    rng = np.random.default_rng([37, seed])
    forces, bench = loads(rng, count), Bench(plain, plain.tactels.positions, np.zeros(11))
    influence, seen = bench.influence(), []
    bench.influence = lambda: influence  # type: ignore[method-assign]  # the same of all strips
    bench.shares = np.eye(3)
    for load in forces:
        bench.light = light or (
            BRIGHT * (1 + SPREAD * rng.standard_normal(3)),
            DARK + DARKER * rng.standard_normal(3),
        )
        seen.append(bench.frames(load[None], rng)[0])
    return forces, np.array(seen)


def test_each_channel_has_its_light(plain: ff.Sensor) -> None:
    model, force = ff.characterize(plain), ff.polar(1.0, 10, 11)
    levels = BRIGHT[:, None] * model.intensity(force) + DARK[:, None]
    frames = model.expose(np.array([force] * 4), rng=0)
    noise = plain.camera.noise + 0.5
    assert np.abs(frames - levels).max() <= noise + 1e-9
    assert np.abs(model.residuals(frames, [force] * 4)).max() < 4
    rows = dict(summary(model))
    said = rows["channels [grey levels]"]
    assert said.startswith("635 nm, 200 over 8, noise 5; 525 nm, 150 over 12, noise 5;")


def test_light_is_drawn_for_each_channel_and_kept_in_files(plain: ff.Sensor, tmp_path) -> None:
    stated = plain.replace(**{CHANNELS: STATED})
    assert stated.tolerances[f"{CHANNELS}.1.amplitude"] == pytest.approx(SPREAD * 150)
    bright, dark = ff.characterize(stated).as_built(0).model.sensor.light
    apart = np.append((bright / BRIGHT - 1) / SPREAD, (dark - DARK) / DARKER)
    assert len(np.unique(apart)) == 6
    assert chi2.cdf(np.square(apart).sum(), 6) == pytest.approx(0.5, abs=0.499)
    (tmp_path / "own.toml").write_text(stated.to_toml())
    assert ff.load_sensor(tmp_path / "own.toml") == stated
    some = drawing(**{CHANNELS: [{"amplitude": 150}, {"offset": 9}], "camera.amplitude": 200})
    assert_allclose(some.light, [[150, 200], [some.camera.offset, 9]])


@pytest.mark.slow
def test_intervals_of_readings_with_a_tolerance_hold(plain: ff.Sensor) -> None:
    reader = ff.Reader(ff.characterize(plain.replace(**{CHANNELS: STATED})))
    forces, frames = exact(plain, 0, FRAMES)
    readings = [reader.search(frame) for frame in frames]
    good = [k for k, one in enumerate(readings) if one.ok]
    assert FRAMES - len(good) <= binom.ppf(1 - 1e-3, FRAMES, 0.02)
    squares = []
    for k in good:
        off = (readings[k].forces - forces[k]).ravel()
        squares.append(off @ np.linalg.solve(readings[k].covariance, off))
    low, high = chi2.ppf([1e-3, 1 - 1e-3], 22 * len(good))
    # the finite elements are within 1e-4 of the series
    assert low < sum(squares) < 1.02 * high


def test_followed_frames_read_as_searched_ones(plain: ff.Sensor) -> None:
    values = {CHANNELS: STATED, "camera.unevenness": "3 %", "camera.pixels": 1024}
    reader, rng = ff.Reader(ff.characterize(plain.replace(**values))), np.random.default_rng(7)
    mean = loads(rng, 1)[0] + 0.2
    forces = mean * (1 + 0.2 * np.sin(np.linspace(0, 0.6, 40)))[:, None, None]
    frames = reader.model.as_built(rng).expose(forces, rng)
    batch = reader.read_on(frames, covariance=True)
    assert batch.tracked[1:].all()
    for k in (10, 39):
        alone = ff.Reader(reader.model).search(frames[k])
        apart = (batch.forces[k] - alone.forces).ravel()
        # the first frame tells another light than this one: six numbers, and it is uneven
        assert apart @ np.linalg.solve(alone.covariance, apart) < 2 * chi2.ppf(1 - 1e-3, 12)
        assert_allclose(batch.std[k], alone.std, rtol=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("skin", [False, True], ids=["tactels", "skin"])
def test_a_channel_dimmer_than_drawn_is_named(plain: ff.Sensor, skin: bool) -> None:
    dim = BRIGHT * [1, 0.99, 1], DARK
    if skin:
        own = plain.replace(**{"skin": {"extent": "11 mm"}})
        made = own.replace(**{CHANNELS: lights(*dim)})
        press = ff.Press(x=1.1e-3, normal=1.5, tangential=0.3, width=1e-3)
        frames = ff.characterize(made).expose([[press]] * 2, rng=1)
    else:
        own, (_, frames) = plain, exact(plain, 1, REFUSED, dim)
    readings = [ff.Reader(ff.characterize(own)).search(frame) for frame in frames]
    assert all(one.status is ff.Status.MODEL_MISMATCH for one in readings)
    named = ["light of channel 2 seems" in one.findings[0] for one in readings]
    assert sum(named) >= binom.ppf(1e-3, len(frames), 0.9)
    said = readings[named.index(True)].findings[0]
    assert "% dimmer than drawn" in said
    assert "give amplitude of channel 2 in polariscope.channels a tolerance" in said
    loose = own.replace(**{CHANNELS: STATED})
    assert all(ff.Reader(ff.characterize(loose)).search(frame).ok for frame in frames[:2])


@pytest.mark.parametrize(
    ("own", "problem"),
    [
        ({"amplitude": 255}, r"channel 2: amplitude \+ offset \+ noise = 263 exceeds"),
        ({"offset": 1}, "channel 2: offset = 1 is below the noise"),
        ({"amplitude": -3}, "greater than 0"),
        ({"amplitude": "200 +/- 60 %"}, "tolerance that is too large"),
    ],
)
def test_light_that_cannot_be_is_refused_once(own: dict[str, object], problem: str) -> None:
    with pytest.raises(DesignError, match=problem) as refused:
        drawing(**{CHANNELS: [{}, own], "camera.noise": 3.0, "camera.offset": 5.0})
    assert "has a problem" in str(refused.value)
