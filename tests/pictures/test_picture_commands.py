"""The commands from pictures to forces."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from rendering import Scene
from typer.testing import CliRunner

import fringeforce as ff
from fringeforce.base.errors import DesignError, FileFormatError, InputError
from fringeforce.cli import app
from fringeforce.io.frames import load_frames

pytestmark = pytest.mark.slow


@pytest.fixture
def folder(
    tilted: Scene,
    light: NDArray[np.float64],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> Path:
    """Pictures of loads, an outline, and a design that knows nothing of the camera."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(7)
    Path("shots").mkdir()
    outline = np.full(1000, 0.7)
    for name, one in [*((f"shots/{k}.png", x) for k, x in enumerate(light)), ("all.png", outline)]:
        picture = 255 * tilted.picture(one)
        noisy = np.clip(np.rint(picture + rng.normal(0, 2.5, picture.shape)), 0, 255)
        Image.fromarray(noisy.astype(np.uint8)).save(name)
    return tmp_path


def run(*words: str) -> str:
    result = CliRunner().invoke(app, list(words), catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_pictures_become_forces(folder: Path, sensor: ff.Sensor, loads: NDArray) -> None:
    found = ("--region", "region.toml")
    wanted = "--camera", "--design", "own.toml"
    said = run("extract", "saad", "shots", "--outline", "all.png", *found, *wanted)
    assert "pixels = 517" in said
    run("characterize", "own.toml", "-o", "own.h5")
    run("extract", "own.toml", "shots", *found, "--out", "frames.h5", "--preview", "seen.png")
    assert load_frames("frames.h5").shape == (4, 517)
    with Image.open("seen.png") as preview:
        assert np.ptp(np.asarray(preview.convert("L"))) > 200
    assert "4 OK" in run("read", "own.h5", "frames.h5", "-o", "lines.csv")
    assert "4 OK" in run("read", "own.h5", "shots", *found, "-o", "pictures.csv")
    assert "4 OK" in run("read", "own.toml", "shots", *found, "-o", "designed.csv")
    for name in ("pictures.csv", "designed.csv"):
        assert Path("lines.csv").read_text() == Path(name).read_text()
    with pytest.raises(FileFormatError, match=r"not from a folder.*--region"):
        run("read", "own.h5", "shots", "-o", "none.csv")
    run("live", "own.h5", "--camera", "file:shots", *found, "--to", "csv:live.csv")
    assert len(Path("live.csv").read_text().splitlines()) >= 1 + 4
    rows = np.genfromtxt("lines.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    assert np.abs(rows["normal_N"].reshape(4, 11) - loads[..., 0]).max() < 0.1


def test_colours_ask_for_their_cross_talk(folder: Path, sensor: ff.Sensor) -> None:
    lights = [{"wavelength": f"{name} LED"} for name in ("red", "green", "blue")]
    Path("plain.toml").write_text(sensor.replace(**{"polariscope.channels": lights}).to_toml())
    with Image.open("shots/1.png") as one:
        one.convert("RGB").save("colour.png")
    corners = "40.3,30.2 556.1,66.9 554.2,107.4 36.8,72.6"
    wanted = "colour.png", "--corners", corners, "--design", "mine.toml"
    assert 'crosstalk = "5 +/- 5 %"' in run("extract", "plain.toml", *wanted)
    stated = 'crosstalk = "5 +/- 5 %"\n\n[camera]'
    Path("mine.toml").write_text(Path("plain.toml").read_text().replace("[camera]", stated))
    assert "crosstalk" not in run("extract", "mine.toml", *wanted)
    assert ff.load_sensor("mine.toml").tolerances["polariscope.crosstalk.2.1"] == 0.05
    assert "crosstalk" not in run("extract", "saad", *wanted)


def test_corners_are_taken_as_stated_and_kept(folder: Path) -> None:
    corners = "40.3,30.2 556.1,66.9 554.2,107.4 36.8,72.6"
    run("extract", "saad", "shots", "--corners", corners, "--region", "own.toml", "--camera")
    assert ff.Region.load("own.toml").corners[2] == (554.2, 107.4)
    told = ("shots", "--region", "own.toml", "--response", "sRGB", "--design", "phone.toml")
    run("extract", "saad", *told)
    assert ff.load_sensor("phone.toml").camera.response == "sRGB"
    with pytest.raises(DesignError, match="response"):
        run("extract", "saad", "shots", "--region", "own.toml", "--response", "film", "--camera")
    for words, said in {
        ("shots", "--region", "own.toml", "--bits", "8", "--camera"): "states corners",
        ("shots", "--corners", "1,2 3", "--camera"): "four pairs",
        ("shots", "--camera"): "ends may be dark",
        ("shots", "--region", "own.toml", "--out", "f.h5"): "517 or fewer",
        ("shots",): "Say what to write",
    }.items():
        with pytest.raises(InputError, match=said):
            run("extract", "saad", *words)


def test_pictures_of_a_lens_that_distorts_become_forces(
    tilted: Scene,
    light: NDArray[np.float64],
    loads: NDArray[np.float64],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of a barrel; the same region is what stated corners and distortion make."""
    monkeypatch.chdir(tmp_path)
    scene, rng = replace(tilted, brown=-0.03), np.random.default_rng(7)
    Path("shots").mkdir()
    for name, one in [*((f"shots/{k}.png", x) for k, x in enumerate(light)), ("all.png", None)]:
        picture = 255 * scene.picture(np.full(1000, 0.7) if one is None else one)
        noisy = np.clip(np.rint(picture + rng.normal(0, 2.5, picture.shape)), 0, 255)
        Image.fromarray(noisy.astype(np.uint8)).save(name)
    wanted = "--region", "found.toml", "--design", "own.toml", "--preview", "seen.png"
    said = run("extract", "saad", "shots", "--outline", "all.png", *wanted)
    assert re.search(r"The lens distorts the corners by -[23]\.\d\d %\.", said)
    assert "4 OK" in run("read", "own.toml", "shots", "--region", "found.toml", "-o", "f.csv")
    rows = np.genfromtxt("f.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    assert np.abs(rows["normal_N"].reshape(4, 11) - loads[..., 0]).max() < 0.1
    found = ff.Region.load("found.toml")
    corners = " ".join(f"{column},{row}" for column, row in found.corners)
    stated = "--corners", corners, "--distortion", f"{found.distortion * 100} %"
    run("extract", "saad", "shots", *stated, "--region", "stated.toml", "--camera")
    again = ff.Region.load("stated.toml")
    assert again == replace(found, distortion=again.distortion)
    assert again.distortion == pytest.approx(found.distortion)
    with pytest.raises(InputError, match='"much" is no share; write a number'):
        run("extract", "saad", "shots", "--distortion", "much", "--camera")


def test_the_simulator_takes_no_region(model: ff.SensorModel) -> None:
    strip = ff.Region([(1, 1), (50, 1), (50, 9), (1, 9)], (600, 150))
    with pytest.raises(InputError, match="not for 'sim'"):
        ff.open_camera("sim", model, region=strip)
