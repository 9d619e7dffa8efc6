"""Images that are taken from tilted pictures of a pad are the light of the pad."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rendering import Scene
from scipy.ndimage import map_coordinates
from typer.testing import CliRunner

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.cli import app
from fringeforce.models.pad import characterize_pad
from fringeforce.pictures.extraction import extract_frames
from fringeforce.pictures.imaging import ImageSampler

SCENE = Scene(((12.3, 9.6), (196.8, 11.2), (199.4, 163.1), (9.7, 160.2)), (212, 176))
CORNERS = " ".join(f"{column},{row}" for column, row in SCENE.corners)


def _middles(columns: int, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Shares along x and y of the middles of an image's pixels."""
    x, y = (np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows
    return np.broadcast_to(x, (rows, columns)), np.broadcast_to(y[:, None], (rows, columns))


def test_light_that_is_even_on_the_pad_slopes_as_it_does() -> None:
    region = ff.Region(SCENE.corners, SCENE.size, bits=16)
    row, column = np.mgrid[: SCENE.size[1], : SCENE.size[0]]
    along, across = np.moveaxis(region.places(np.stack([column, row], -1)), -1, 0)
    image = ImageSampler(region, (96, 80)).line(20000 + 9000 * along - 7000 * across)
    x, y = _middles(96, 80)
    np.testing.assert_allclose(image, (20000 + 9000 * x - 7000 * y).ravel(), rtol=1e-10)


def test_fringes_are_seen_where_they_are() -> None:
    along, across = SCENE.shares()
    fine = 30000 + 20000 * np.cos(2 * np.pi * (5 * along + 3 * across))
    s, (columns, rows) = SCENE.subpixels, SCENE.size
    picture = fine.reshape(rows, s, columns, s).mean(axis=(1, 3))
    region = ff.Region(SCENE.corners, SCENE.size, bits=16)
    image = ImageSampler(region, (96, 80)).line(picture).reshape(80, 96) - 30000
    x, y = _middles(96, 80)
    window = np.outer(np.hanning(80), np.hanning(96))
    seen = 2 * (window * image * np.exp(-2j * np.pi * (5 * x + 3 * y))).sum() / window.sum()
    assert abs(np.angle(seen)) < 2 * np.pi / 1000  # a thousandth of a fringe
    assert abs(seen) == pytest.approx(20000, rel=0.03)  # the kernel blurs a little


def test_too_fine_images_and_turned_analysers_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    region = ff.Region(SCENE.corners, SCENE.size)
    with pytest.raises(InputError, match=r"too few for images of 300 x 80; state pixels = \[193"):
        ImageSampler(region, (300, 80)).line(np.zeros(SCENE.size[::-1], np.uint8))
    turned = ff.Region(np.roll(SCENE.corners, 1, axis=0).tolist(), SCENE.size)
    np.save("turned.npy", np.zeros((1, *SCENE.size[::-1]), np.uint8))
    with pytest.raises(InputError, match="within 1 degrees"):
        extract_frames(["turned.npy"], ff.load_sensor("pad"), turned)


def _run(*words: str) -> str:
    result = CliRunner().invoke(app, list(words), catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


@pytest.mark.slow
def test_pictures_of_a_pad_become_forces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    small = {"transducer.length": "13 mm", "transducer.width": "11 mm", "tactels.count": [5, 4]}
    levels = {"amplitude": 200, "offset": 12, "noise": 2, "noise_model": "gaussian"}
    camera = {f"camera.{key}": value for key, value in levels.items()}
    pad = ff.load_sensor("pad").replace(**small, **camera)
    exact = {"bits": 16, "amplitude": 52000, "offset": 3000, "noise": 0, "pixels": [384, 320]}
    fine = pad.replace(**{f"camera.{key}": value for key, value in exact.items()})
    loads = np.zeros((2, 20, 3))
    loads[0, [6, 7]], loads[1, 12] = [(2.0, 0.3, -0.1), (1.0, 0.0, 0.2)], (1.5, -0.2, 0.1)
    light = characterize_pad(fine, samples=48, slices=6).expose(loads, rng=0)
    along, across = SCENE.shares()
    inside = (abs(along - 0.5) < 0.5) & (abs(across - 0.5) < 0.5)
    rng, s, (columns, rows) = np.random.default_rng(5), SCENE.subpixels, SCENE.size
    Path("shots").mkdir()
    for number, image in enumerate(light):
        picture = np.zeros((rows, columns))
        for row, column in ((0, 0), (0, 1), (1, 0), (1, 1)):  # what is behind each analyser
            at = [(across * 320 - 0.5 - row) / 2, (along * 384 - 0.5 - column) / 2]
            own = map_coordinates(
                (image[row::2, column::2] - 3000) / 52000, at, float, 1, "nearest"
            )
            seen = np.where(inside, 12 + 200 * own, 5).reshape(rows, s, columns, s).mean((1, 3))
            picture[row::2, column::2] = seen[row::2, column::2]
        noisy = np.clip(np.rint(picture + rng.normal(0, 2, picture.shape)), 0, 255)
        Image.fromarray(noisy.astype(np.uint8)).save(f"shots/{number}.png")
    # light is taken at new pixels from between others, which smooths it
    pad = pad.replace(**{"camera.pixels": [96, 80], "camera.blur": "0.1 +/- 0.05 mm"})
    Path("pad.toml").write_text(pad.to_toml())
    characterize_pad(pad, samples=48, slices=6).save("m.h5")
    found = ("--region", "region.toml")
    said = _run("extract", "pad.toml", "shots", "--corners", CORNERS, *found, "-o", "frames.h5")
    assert "2 frames of 80 x 96 pixels" in said
    for name, words in {"frames": ["frames.h5"], "pictures": ["shots", *found]}.items():
        assert "2 OK" in _run("read", "m.h5", *words, "-o", f"{name}.csv")
    assert Path("frames.csv").read_text() == Path("pictures.csv").read_text()
    _run("live", "m.h5", "--camera", "file:shots", *found, "--to", "csv:live.csv")
    assert len(Path("live.csv").read_text().splitlines()) == 1 + 2 * 20
    rows_read = np.genfromtxt("frames.csv", delimiter=",", names=True, encoding="utf-8", dtype=None)
    normal = rows_read["normal_N"].reshape(2, 20)
    assert np.abs(normal - loads[..., 0]).max() < 0.1
