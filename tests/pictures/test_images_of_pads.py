"""Images of pads are local linear regressions of the picture, solved pixel by pixel by SciPy."""

from typing import Any

import numpy as np
import pytest
from rendering import Scene
from scipy.linalg import lstsq

import fringeforce as ff
from fringeforce.base.errors import InputError
from fringeforce.pictures import imaging
from fringeforce.pictures.imaging import ImageSampler

SCENE = Scene(((6.3, 4.6), (83.8, 6.2), (86.4, 66.1), (3.7, 62.2)), (92, 71))
TURNED = Scene(((40.2, 3.1), (86.9, 37.4), (46.3, 67.8), (4.4, 30.5)), (92, 71))


def regression(
    region: ff.Region, picture: np.ndarray, pixels: tuple[int, int], site: str, analysers: bool
) -> np.ndarray:
    """Every pixel of the image by weighted least squares over the whole picture."""
    columns, rows = region.size
    row, column = (axis.ravel() for axis in np.mgrid[:rows, :columns])
    places = region.places(np.stack([column, row], -1))
    top, right, bottom, left = np.linalg.norm(
        np.roll(region.corners, -1, axis=0) - np.array(region.corners), axis=1
    )
    finest = np.array([min(top, bottom), min(left, right)])
    on = (np.abs(places - 0.5) <= 0.5 * (1 - 1 / finest)).all(axis=1)
    number = 2 * (row % 2) + column % 2
    one_of_two = analysers or bool(region.sites)
    half = np.maximum(1.0, (2 if one_of_two else 1) * np.array(pixels) / finest)
    at, image = places * pixels - 0.5, np.empty(pixels[::-1])
    for y, x in np.ndindex(image.shape):
        seen = on & (number == 2 * (y % 2) + x % 2) if analysers else on
        if region.sites:
            seen = seen & (np.array(region.sites)[number] == site)
        away = (at - [x, y]) / half
        kernel = np.where(seen, np.maximum(1 - np.abs(away), 0).prod(axis=1), 0)
        root = np.sqrt(kernel[kernel > 0])
        plane = np.column_stack([np.ones(root.size), away[kernel > 0]])
        moments = (root[:, None] * plane).T @ (root[:, None] * plane) / (root**2).sum()
        levels = picture.ravel()[kernel > 0]
        if np.linalg.det(moments) < 1e-6:  # on one line: their mean
            image[y, x] = np.average(levels, weights=root**2)
        else:
            solution: Any = lstsq(root[:, None] * plane, root * levels)
            image[y, x] = solution[0][0]
    return image


@pytest.mark.parametrize("scene", [SCENE, TURNED])
@pytest.mark.parametrize("pixels", [(17, 12), (48, 43)])
@pytest.mark.parametrize(
    ("mosaic", "channels", "analysers"),
    [
        ("", ("grey",), False),
        ("", ("grey",), True),
        ("RGGB", ("R", "G", "B"), False),
        ("0,45,135,90", ("135", "45"), False),
    ],
)
def test_each_pixel_is_the_regression_of_the_pixels_around_it(
    scene, pixels, mosaic, channels, analysers, monkeypatch
) -> None:
    region = ff.Region(scene.corners, scene.size, bits=16, mosaic=mosaic)
    if mosaic:
        pixels = min(pixels[0], 22), min(pixels[1], 22)
    picture = np.random.default_rng(1).integers(100, 60000, scene.size[::-1])
    found = []
    for band in (imaging.BAND, 7):  # however many rows are taken together
        monkeypatch.setattr(imaging, "BAND", band)
        sampler = ImageSampler(region, pixels, channels, analysers)
        found.append(np.reshape(sampler.line(picture), (len(channels), *pixels[::-1])))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)
    for name, image in zip(channels, found[0], strict=True):
        whole = regression(region, picture, pixels, name, analysers).clip(0, 65535)
        np.testing.assert_allclose(image, whole, rtol=1e-8, atol=1e-5)


def test_a_pixel_that_none_sees_is_named() -> None:
    """A long trapezium: its far end is drawn out beyond what pixels of one analyser reach."""
    region = ff.Region([(2, 2), (90, 30), (90, 40), (2, 68)], SCENE.size)
    with pytest.raises(InputError, match=r"No pixel of the picture sees row \d+, column \d+ of"):
        ImageSampler(region, (80, 10), analysers=True).line(np.zeros(SCENE.size[::-1], np.uint8))
