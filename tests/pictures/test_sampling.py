"""Lines that are taken from pictures are the light of the strip, with the noise that is stated."""

import numpy as np
import pytest
from numpy.typing import NDArray
from rendering import Scene

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.design.light import Polariscope
from fringeforce.pictures.camera import line_camera
from fringeforce.pictures.sampling import channels_of

PIXELS = 400


@pytest.fixture
def region(tilted: Scene) -> ff.Region:
    return ff.Region(tilted.corners, tilted.size)


def test_a_wave_of_light_is_seen_where_it_is(tilted: Scene, region: ff.Region) -> None:
    even = Scene(tilted.corners, tilted.size, uneven=0.0, subpixels=6)
    places = (np.arange(20000) + 0.5) / 20000
    waves = 30.3
    picture = 4000 * even.picture(0.5 + 0.4 * np.cos(2 * np.pi * waves * places))
    sampler = ff.Sampler(region, PIXELS)
    line = ff.Sampler(ff.Region(region.corners, region.size, bits=12), PIXELS).line(picture)
    own = (np.arange(PIXELS) + 0.5) / PIXELS
    turn = np.exp(-2j * np.pi * waves * own)
    window = np.hanning(PIXELS)
    seen = 2 * (window * (line - line.mean()) * turn).sum() / window.sum()
    # 1 / 1000 of a fringe, and the contrast that the stated point spread leaves
    assert abs(np.angle(seen)) < 2 * np.pi / 1000
    left = np.exp(-((2 * np.pi * waves / PIXELS * sampler.spread) ** 2) / 2)
    assert abs(seen) / 1600 == pytest.approx(left, abs=0.004)


def test_linear_light_is_reproduced_exactly(region: ff.Region) -> None:
    columns, rows = region.size
    row, column = np.mgrid[:rows, :columns]
    along, _ = np.moveaxis(region.places(np.stack([column, row], axis=-1)), -1, 0)
    picture = np.clip(100 + 50 * along, 0, 255)
    own = (np.arange(500) + 0.5) / 500
    np.testing.assert_allclose(ff.Sampler(region, 500).line(picture), 100 + 50 * own, rtol=1e-12)


def test_saturated_pixels_stay_at_the_top_and_others_are_averaged(region: ff.Region) -> None:
    picture = np.full(region.size[::-1], 200, np.uint8)
    picture[:, 250:260] = 255
    picture[60:62, 400] = 255  # two of its rows
    line = ff.Sampler(region, PIXELS).line(picture)
    assert 6 <= (line == 255).sum() <= 9
    assert line[line < 255].max() < 250


def test_noise_of_the_line_is_what_the_camera_states(tilted: Scene, region: ff.Region) -> None:
    rng = np.random.default_rng(3)
    clean = 255 * tilted.picture(0.5 + 0.2 * np.sin(np.arange(4000) / 200))
    pictures = [
        np.rint(clean + rng.normal(0, 3, clean.shape)).astype(np.uint8).clip(0, 255)
        for _ in range(60)
    ]
    camera = line_camera(pictures[:16], region, length=25e-3, pixels=PIXELS)
    lines = np.array([ff.Sampler(region, PIXELS).line(picture) for picture in pictures])
    # of sums over eight neighbours, which tell the noise at long waves
    sums = (lines - lines.mean(axis=0)).reshape(60, -1, 8).sum(axis=2)
    measured = sums.std() * np.sqrt(60 / 59 / 8) * (2**camera.bits - 1) / 255
    assert camera.noise == pytest.approx(measured, rel=0.12)
    assert camera.noise > 4
    design = camera.put_into(ff.load_sensor("saad"))
    assert design.camera.noise == pytest.approx(camera.noise, rel=0.01)
    assert design.camera.pixels == PIXELS


@pytest.mark.parametrize("turned", [0.0, 3.0, 7.0])
@pytest.mark.parametrize("moved", [0.1, 0.5, 0.9])
def test_the_last_pixels_of_a_line_neither_extrapolate_nor_spoil_its_noise(
    turned: float, moved: float
) -> None:
    """Wherever the picture's pixels lie beside the ends of a strip that is turned by few pixels."""
    right = [(541.2, 60.0 + turned), (541.2, 99.0 + turned)]
    corners = [(50.0 + moved, 60.0), *right, (50.3, 99.0)]
    scene, region = Scene(tuple(corners), (600, 150)), ff.Region(corners, (600, 150))
    clean = 255 * scene.picture(0.5 + 0.4 * np.sin(np.arange(4000) / 60))
    rng = np.random.default_rng(4)
    pictures = [clean + rng.normal(0, 2.5, clean.shape) for _ in range(80)]
    camera = line_camera(pictures[:16], region, length=25e-3)
    lines = np.array([ff.Sampler(region, camera.pixels).line(picture) for picture in pictures])
    off = (lines - lines.mean(axis=0)) * np.sqrt(80 / 79)
    assert off[:, [0, -1]].std() < 2.5 * off.std()
    sums = off[:, : camera.pixels // 8 * 8].reshape(80, -1, 8).sum(axis=2)
    measured = sums.std() / np.sqrt(8) * (2**camera.bits - 1) / 255
    assert camera.noise == pytest.approx(measured, rel=0.12)


def test_bayer_mosaics_give_each_colour_its_own_pixels(region: ff.Region) -> None:
    raw = ff.Region(region.corners, region.size, mosaic="RGGB")
    columns, rows = region.size
    picture = np.zeros((rows, columns), np.uint8)
    picture[::2, ::2], picture[1::2, 1::2] = 200, 50
    picture[::2, 1::2] = picture[1::2, ::2] = 100
    lines = ff.Sampler(raw, 250, ("R", "G", "B")).line(picture)
    np.testing.assert_allclose(lines, np.array([[200], [100], [50]]) * np.ones(250), rtol=1e-9)


def test_planes_of_colour_are_those_of_the_channels(region: ff.Region) -> None:
    picture = np.zeros((*region.size[::-1], 3), np.uint8)
    picture[...] = (30, 60, 90)
    lines = ff.Sampler(region, 100, ("B", "R")).line(picture)
    np.testing.assert_allclose(lines[:, 50], (90, 30))


def polariscope(*channels: dict) -> Polariscope:
    return Polariscope.model_validate({"wavelength": 632.8e-9, "channels": channels})


def test_channels_are_told_apart_by_wavelength_or_bias(region: ff.Region) -> None:
    waves = polariscope({"wavelength": 460e-9}, {"wavelength": 530e-9}, {"wavelength": 630e-9})
    assert channels_of(waves, region, colour=True) == ("B", "G", "R")
    turned = ff.Region(region.corners, region.size, mosaic="180,90,270,0")
    biases = polariscope({"bias": 0}, {"bias": 90})
    assert channels_of(biases, turned, colour=False) == ("0", "90")
    with pytest.raises(InputError, match="apart"):
        channels_of(biases, region, colour=True)
    with pytest.raises(InputError, match="lacks a bias"):
        channels_of(polariscope({"bias": 45}), turned, colour=False)


@pytest.mark.parametrize(
    ("picture", "pixels", "said"),
    [
        (np.zeros((10, 10), np.uint8), 100, "region was made for 600 columns"),
        (np.full((150, 600), 300, np.uint16), 100, "exceeds 8 bits"),
        (np.zeros((150, 600), np.uint8), 2048, "pixels = 517 or fewer"),
    ],
)
def test_pictures_that_do_not_fit_are_refused(
    region: ff.Region, picture: NDArray[np.unsignedinteger], pixels: int, said: str
) -> None:
    with pytest.raises(InputError, match=said):
        ff.Sampler(region, pixels).line(picture)
