"""Forces from pictures are right within the deviations that are stated with them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from rendering import Scene
from scipy.stats import binom, chi2
from storing import (
    bayer_under_red_light,
    jpeg_in_srgb,
    png,
    quantised,
    tiff_of_12_bits,
    video,
)
from typer.testing import CliRunner

import fringeforce as ff
from fringeforce.cli import app
from fringeforce.pictures.camera import line_camera
from fringeforce.pictures.extraction import extract_frames, first_pictures
from fringeforce.pictures.sampling import channels_of
from fringeforce.reading.reading import Status

Levels = NDArray[np.float64]


KINDS: dict[Callable[[Levels, Path], None], dict[str, Any]] = {
    png: {},
    tiff_of_12_bits: {"bits": 12},
    jpeg_in_srgb: {"response": "sRGB"},
    video: {},
    bayer_under_red_light: {"mosaic": "RGGB"},
}


NARROW: list[list[float]] = []
WIDE = [[0, 0.06, 0], [0.02, 0, 0.09], [0, 0.05, 0]]
LIT = [{"wavelength": f"{name} LED"} for name in ("red", "green", "blue")]
UNEQUAL = [
    {**light, "amplitude": amplitude, "offset": offset}
    for light, amplitude, offset in zip(LIT, (52000, 36000, 21000), (3000, 2200, 3500), strict=True)
]
"""LEDs of which the weakest has two fifths of the light of the strongest, 16 bits."""


def bayer(
    lights: list[dict[str, Any]], crosstalk: Any, scene: Scene, loads: Levels, sensor: ff.Sensor
) -> NDArray[Any]:
    """Raw pictures of three lights at once."""
    camera = {"pixels": 4000, "bits": 16, "amplitude": 52000, "offset": 3000, "noise": 0}
    fine = sensor.replace(**{f"camera.{key}": value for key, value in camera.items()})
    fine = fine.replace(**{"polariscope.channels": lights, "polariscope.crosstalk": crosstalk})
    raw = []
    for colours in ff.characterize(fine).expose(loads, rng=0) / (2**16 - 1):
        red, green, blue = (scene.picture(one) for one in colours)
        green[::2, ::2], green[1::2, 1::2] = red[::2, ::2], blue[1::2, 1::2]
        raw.append(green)
    return quantised(np.array(raw), 0.01)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lights", "crosstalk", "stated"),
    [(LIT, NARROW, []), (LIT, WIDE, "5 +/- 5 %"), (UNEQUAL, WIDE, "5 +/- 5 %")],
    ids=["narrow colours", "wide colours", "unequal lights"],
)
def test_a_bayer_mosaic_tells_three_lights_apart(
    lights: list[dict[str, Any]],
    crosstalk: list,
    stated: Any,
    tilted: Scene,
    loads: Levels,
    sensor: ff.Sensor,
    tmp_path: Path,
) -> None:
    drawn = sensor.replace(**{"polariscope.channels": LIT, "polariscope.crosstalk": stated})
    np.save(tmp_path / "raw.npy", bayer(lights, crosstalk, tilted, loads, sensor))
    even = quantised(tilted.picture(np.full(1000, 0.7)), 0.01)
    region = ff.find_region([even], aspect=12.5, mosaic="RGGB")
    channels = channels_of(drawn.polariscope, region, colour=False)
    assert channels == ("R", "G", "B")
    first = first_pictures([tmp_path])
    seen = line_camera(first, region, sensor.transducer.length, channels)
    own = seen.put_into(drawn)
    if lights is UNEQUAL:
        scale = (2**seen.bits - 1) / (2**16 - 1)
        for light, true in zip(seen.lights, UNEQUAL, strict=True):
            assert light.amplitude == pytest.approx(true["amplitude"] * scale, rel=0.1)
            assert abs(light.offset - true["offset"] * scale) < 2 * 0.01 * light.amplitude
        # two of four pixels are green, and one each red and blue
        assert seen.lights[1].noise < 0.9 * seen.lights[2].noise
    frames, _ = extract_frames([tmp_path], own, region)
    distances = _distances(ff.Reader(ff.characterize(own)), frames, loads)
    assert max(distances) < chi2.ppf(1 - 0.001 / len(loads), loads[0].size)


@pytest.mark.slow
def test_two_commands_lead_from_pictures_of_unequal_lights_to_forces(
    tilted: Scene, loads: Levels, sensor: ff.Sensor, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("raw.npy", bayer(UNEQUAL, WIDE, tilted, loads, sensor))
    np.save("even.npy", quantised(tilted.picture(np.full(1000, 0.7)), 0.01)[None])
    drawn = {"polariscope.channels": LIT, "polariscope.crosstalk": "5 +/- 5 %"}
    Path("drawn.toml").write_text(sensor.replace(**drawn).to_toml())
    for words in (
        "extract drawn.toml raw.npy --outline even.npy --mosaic RGGB --design own.toml -o f.h5",
        "read own.toml f.h5 -o forces.csv",
    ):
        ended = CliRunner().invoke(app, words.split(), catch_exceptions=False)
        assert ended.exit_code == 0, ended.output
    assert f"{len(loads)} OK" in ended.output
    rows = np.genfromtxt("forces.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    off, std = (
        np.stack([rows[f"{name}_{kind}"] for name in ("normal", "tangential")], axis=-1)
        for kind in ("N", "std_N")
    )
    inside = np.abs(off.reshape(loads.shape) - loads) < 1.96 * std.reshape(loads.shape)
    assert inside.sum() >= binom.ppf(0.001, loads.size, 0.95)


NOISES = np.array([0.004, 0.01, 0.02])
"""Of the three colours of a camera whose white balance amplifies blue, as shares."""


def coloured(planes: Levels, rng: np.random.Generator) -> NDArray[np.uint8]:
    """A picture of three colours, shape (rows, columns, 3), each with its own noise."""
    noisy = 255 * (planes + NOISES * rng.standard_normal(planes.shape))
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


@pytest.mark.slow
def test_each_colour_gets_the_noise_of_its_pictures(
    tilted: Scene, loads: Levels, sensor: ff.Sensor, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    rng, camera = np.random.default_rng(5), {"pixels": 4000, "bits": 16, "noise": 0}
    camera |= {"amplitude": 52000, "offset": 3000}
    fine = sensor.replace(**{f"camera.{key}": value for key, value in camera.items()})
    fine = fine.replace(**{"polariscope.channels": LIT})
    Path("shots").mkdir()
    for number, lines in enumerate(ff.characterize(fine).expose(loads, rng=0) / (2**16 - 1)):
        planes = np.stack([tilted.picture(line) for line in lines], axis=-1)
        Image.fromarray(coloured(planes, rng)).save(f"shots/{number}.png")
    np.save("even.npy", quantised(tilted.picture(np.full(1000, 0.7)), 0.01)[None])
    Path("drawn.toml").write_text(sensor.replace(**{"polariscope.channels": LIT}).to_toml())
    for words in (
        "extract drawn.toml shots --outline even.npy --region r.toml --design own.toml -o f.h5",
        "read own.toml f.h5 -o forces.csv",
    ):
        ended = CliRunner().invoke(app, words.split(), catch_exceptions=False)
        assert ended.exit_code == 0, ended.output
    own, region = ff.load_sensor("own.toml"), ff.Region.load("r.toml")
    # of pictures of noise alone, the mean of sixteen neighbours, which are correlated
    plain = np.full((*tilted.picture(np.ones(2)).shape, 3), 0.5)
    channels = channels_of(own.polariscope, region, colour=True)
    sampler = ff.Sampler(region, own.camera.pixels, channels)
    lines = np.array([sampler.line(coloured(plain, rng)) for _ in range(40)])
    lines = lines - lines.mean(axis=0)
    whole = lines[..., : lines.shape[-1] // 16 * 16].reshape(*lines.shape[:2], -1, 16)
    true = np.sqrt(16 * whole.mean(axis=-1).var(axis=(0, 2))) * own.camera.full_scale / 255
    # some 360 numbers tell of each, so that it is sure to 4 %
    np.testing.assert_allclose(own.noise, true, rtol=0.16)
    assert f"{len(loads)} OK" in ended.output
    rows = np.genfromtxt("forces.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    off, std = (
        np.stack([rows[f"{name}_{kind}"] for name in ("normal", "tangential")], axis=-1)
        for kind in ("N", "std_N")
    )
    inside = np.abs(off.reshape(loads.shape) - loads) < 1.96 * std.reshape(loads.shape)
    assert inside.sum() >= binom.ppf(0.001, loads.size, 0.95)


def _distances(reader: ff.Reader, frames: NDArray[Any], loads: Levels) -> list[float]:
    """Squared errors of the forces in units of their covariance, of frames that are OK."""
    distances = []
    for frame, applied in zip(frames, loads, strict=True):
        reading = reader.read(frame)
        assert reading.status is Status.OK, reading.advice
        off = (reading.forces - applied).ravel()
        distances.append(off @ np.linalg.solve(reading.covariance, off))
        assert np.abs(off).max() < 0.1
    return distances


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_forces_are_right_within_their_deviations(
    kind: Callable[[Levels, Path], None],
    tilted: Scene,
    light: Levels,
    loads: Levels,
    sensor: ff.Sensor,
    tmp_path: Path,
) -> None:
    told = dict(KINDS[kind])
    response = told.pop("response", "linear")
    kind(np.array([tilted.picture(one) for one in light]), tmp_path)
    even = 255 * tilted.picture(np.full(1000, 0.7))
    region = ff.find_region([quantised(even / 255, 0.01)], aspect=12.5, **told)
    first = first_pictures([tmp_path])
    channels = channels_of(sensor.polariscope, region, first[0].ndim == 3)
    length = sensor.transducer.length
    own = line_camera(first, region, length, channels, response=response).put_into(sensor)
    frames, times = extract_frames([tmp_path], own, region)
    assert (times is not None) == (kind is video)
    if times is not None:
        np.testing.assert_allclose(np.diff(times), 1 / 25)
    distances = _distances(ff.Reader(ff.characterize(own)), frames, loads)
    # errors of the camera's place and light are common to all frames, so each is judged alone
    assert max(distances) < chi2.ppf(1 - 0.001 / len(loads), loads[0].size)
