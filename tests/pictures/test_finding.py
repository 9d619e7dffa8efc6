"""A strip is found where the renderer drew it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rendering import Scene

import fringeforce as ff
from fringeforce.base.errors import InputError

SIZE = (400, 200)


def turned(degrees: float, converging: float = 0.0) -> Scene:
    """A strip 300 x 24 pixels about the middle of the picture; one end smaller than the other."""
    angle = np.radians(degrees)
    axes = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    half = np.array(
        [[-150, -12], [150, -12 * (1 - converging)], [150, 12 * (1 - converging)], [-150, 12]]
    )
    corners = half @ axes + np.array([199.3, 99.6])
    return Scene(tuple((float(c), float(r)) for c, r in corners), SIZE)


def noisy(scene: Scene, light: float, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    picture = 255 * scene.picture(np.full(1000, light))
    return np.clip(np.rint(picture + rng.normal(0, 3, picture.shape)), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("degrees", [-5.0, 0.0, 2.0, 5.0])
@pytest.mark.parametrize("converging", [0.0, 0.08])
def test_corners_are_found_to_a_tenth_of_a_pixel(degrees: float, converging: float) -> None:
    scene = turned(degrees, converging)
    region = ff.find_region([noisy(scene, 0.6)])
    assert np.abs(np.array(region.corners) - np.array(scene.corners)).max() < 0.15
    assert region.tilt == pytest.approx(degrees, abs=0.05)
    assert region.distortion == 0


@pytest.mark.parametrize("brown", [-0.06, -0.03, 0.03])
@pytest.mark.parametrize("beside", [0.0, 55.0])
def test_places_before_a_lens_that_distorts_are_found(brown: float, beside: float) -> None:
    """By edges that bend against each other, or one way beside the middle of the picture."""
    plain = turned(3.0)
    straight = ff.Region([(column, row + beside) for column, row in plain.corners], SIZE)
    scene = replace(plain, corners=tuple((c, r) for c, r in straight.corners), brown=brown)
    picture = noisy(scene, 0.6)
    share = np.stack(np.meshgrid(np.linspace(0, 1, 21), [0.0, 0.5, 1.0]), axis=-1)
    true = scene.seen(straight.points(share))
    region = ff.find_region([picture])
    off = np.abs(region.points(share) - true).max()
    assert off < 0.35
    assert np.abs(region.places(true) - share)[..., 0].max() < 1e-3
    plainly = ff.find_region([picture], distortion=0.0)
    assert np.abs(plainly.points(share) - true).max() > 2 * off
    assert region.distortion == pytest.approx(brown, rel=0.3)


def test_edges_without_noise_or_through_the_middle_tell_of_no_distortion() -> None:
    """The upper edge runs along the middle row, where no lens bends it."""
    for first, last in ((20, 60), (40, 70)):
        picture = np.full((81, 220), 5, dtype=np.uint8)
        picture[first:last, 10:210] = 200
        region = ff.find_region([picture])
        edges = [(9.5, first - 0.5), (209.5, first - 0.5), (209.5, last - 0.5), (9.5, last - 0.5)]
        np.testing.assert_allclose(region.corners, edges, atol=0.05)
        assert region.distortion == 0


def test_a_distortion_is_kept_in_the_file_and_stated_for_corners(tmp_path: Path) -> None:
    corners = [(20, 30), (380, 30), (380, 80), (20, 80)]
    region = ff.Region(corners, SIZE, distortion=-0.03)
    region.save(tmp_path / "region.toml")
    assert ff.Region.load(tmp_path / "region.toml") == region
    np.testing.assert_allclose(region.points([[0, 0], [1, 1]]), np.array(corners)[[0, 2]])
    points = np.random.default_rng(0).uniform((20, 30), (380, 80), (50, 2))
    np.testing.assert_allclose(region.points(region.places(points)), points, atol=1e-9)
    low, high = region.bounds
    assert low[1] < 30  # a long edge bulges away from the middle
    assert high[1] == 81


def test_colour_pictures_are_searched_in_their_brightest_plane() -> None:
    scene = turned(3.0)
    colour = np.zeros((*SIZE[::-1], 3), np.uint8)
    colour[..., 0] = noisy(scene, 0.6)
    assert ff.find_region([colour]) == ff.find_region([colour[..., 0]])


def test_a_picture_without_a_strip_or_with_dark_ends_is_refused() -> None:
    with pytest.raises(InputError, match="--corners"):
        ff.find_region([np.full((80, 90), 7, np.uint8)])
    scene = turned(2.0)
    places = np.linspace(-1, 1, 1000)
    picture = np.rint(255 * scene.picture(0.7 * np.exp(-((places / 0.4) ** 4)))).astype(np.uint8)
    with pytest.raises(InputError, match="its ends may be dark"):
        ff.find_region([picture], aspect=12.5)


def test_places_of_a_region_agree_with_cross_ratios() -> None:
    scene = Scene(((40, 30), (350, 60), (340, 150), (60, 110)), SIZE, subpixels=1)
    region = ff.Region(scene.corners, SIZE)
    columns, rows = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    places = region.places(np.stack([columns, rows], axis=-1))
    np.testing.assert_allclose(np.moveaxis(places, -1, 0), scene.shares(), atol=1e-9)
    np.testing.assert_allclose(region.points(places)[..., 0], columns, atol=1e-8)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"corners": [(0, 0), (9, 9), (9, 0), (0, 9)]}, "four-sided"),
        ({"corners": [(0, 0), (999, 0), (999, 9), (0, 9)]}, "leave the picture"),
        ({"corners": [(0, 0), (9, 0)]}, "four pairs"),
        ({"bits": 17}, "bits = 17"),
        ({"margin": 0.5}, "margin = 0.5"),
        ({"mosaic": "RGBW"}, "RGBW"),
        ({"distortion": 0.3}, "distortion = 0.3"),
    ],
)
def test_what_is_no_region_is_refused(change: dict, said: str) -> None:
    good: dict[str, Any] = {"corners": [(0, 0), (99, 0), (99, 9), (0, 9)], "size": (100, 10)}
    with pytest.raises(InputError, match=said):
        ff.Region(**{**good, **change})


def test_files_that_hold_no_region_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "region.toml"
    with pytest.raises(InputError, match="cannot be read as a region"):
        ff.Region.load(path)
    for text, said in (("size = [3, 3]", "lacks corners"), ("height = 3", "no height")):
        path.write_text(text)
        with pytest.raises(InputError, match=said):
            ff.Region.load(path)
