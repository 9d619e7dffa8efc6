"""The colour of monochromatic light, against the tables of the CIE."""

import numpy as np
import pytest

from fringeforce.optics.colour import encoded, light_colour

# CIE 1931 colour matching functions of the 2 degree observer (CIE 015, Colorimetry), by nm
OBSERVER = {
    430: (0.2839, 0.0116, 1.3856),
    450: (0.3362, 0.0380, 1.7721),
    470: (0.1954, 0.0910, 1.2876),
    490: (0.0320, 0.2080, 0.4652),
    510: (0.0093, 0.5030, 0.1582),
    530: (0.1655, 0.8620, 0.0422),
    550: (0.4334, 0.9950, 0.0087),
    570: (0.7621, 0.9520, 0.0021),
    580: (0.9163, 0.8700, 0.0017),
    590: (1.0263, 0.7570, 0.0011),
    600: (1.0622, 0.6310, 0.0008),
    610: (1.0026, 0.5030, 0.0003),
}
# primaries and white of IEC 61966-2-1 as chromaticities x, y
PRIMARIES = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]])
WHITE = np.array([0.3127, 0.3290])


def screen_colour(xyz: tuple[float, float, float]) -> np.ndarray:
    """Linear RGB, derived from the primaries rather than taken from a table."""

    def full(xy: np.ndarray) -> np.ndarray:
        return np.append(xy, 1 - xy.sum()) / xy[1]

    columns = np.array([full(xy) for xy in PRIMARIES]).T
    matrix = columns * np.linalg.solve(columns, full(WHITE))
    rgb = np.clip(np.linalg.solve(matrix, xyz), 0, None)
    return rgb / rgb.max()


@pytest.mark.parametrize("nm", OBSERVER)
def test_light_has_the_colour_that_the_standard_observer_sees(nm: int) -> None:
    # the fits are good to some hundredths
    np.testing.assert_allclose(light_colour(nm * 1e-9), screen_colour(OBSERVER[nm]), atol=0.06)


def test_light_that_nobody_sees_is_shown_white() -> None:
    assert light_colour(30e-6).tolist() == [1, 1, 1]


def test_screens_get_the_bytes_of_the_standard() -> None:
    linear = np.linspace(-0.2, 1.3, 3001)
    # IEC 61966-2-1
    shown = np.clip(linear, 0, 1)
    curve = np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * shown ** (1 / 2.4) - 0.055)
    assert np.abs(encoded(linear) - 255 * curve).max() < 0.6
    assert encoded(np.array([0.0, 1.0])).tolist() == [0, 255]
