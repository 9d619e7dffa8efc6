"""What errors of quarter-wave plates do to the pictures, against textbook formulae."""

import numpy as np
import pytest

from fringeforce.design.light import Channel, Plates, Polariscope
from fringeforce.optics.polariscope import pictures, quarter_wave_plates

PHASE = np.linspace(0, 12, 200)


@pytest.mark.parametrize("error", [-12.0, 0.0, 8.0])
def test_plates_that_err_alike_dim_the_dark_field_by_the_squared_cosine(error: float) -> None:
    line = Polariscope(wavelength=6e-7, plates=Plates(retardance_error=error))
    # Theocaris and Gdoutos, Matrix Theory of Photoelasticity, chapter 4, axis along the polariser
    expected = np.cos(np.radians(error)) ** 2 * np.sin(PHASE / 2) ** 2
    found = pictures(line)[0].fringe.intensity(PHASE)
    np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.parametrize("wavelength", [5e-7, 6e-7, 7e-7])
def test_plates_are_a_quarter_wave_for_all_channels_only_where_achromatic(
    wavelength: float,
) -> None:
    channels = (Channel(wavelength=wavelength),)
    common = {"wavelength": 6e-7, "channels": channels}
    perfect = pictures(Polariscope(**common, plates=Plates()))[0]
    assert perfect.dispersion == pytest.approx(6e-7 / wavelength)
    np.testing.assert_allclose(perfect.fringe.intensity(PHASE), np.sin(PHASE / 2) ** 2, atol=1e-12)
    plain = pictures(Polariscope(**common, plates=Plates(dispersion="quarter wave at wavelength")))
    error = np.pi / 2 * (6e-7 / wavelength - 1)
    expected = np.cos(error) ** 2 * np.sin(PHASE / 2) ** 2
    np.testing.assert_allclose(plain[0].fringe.intensity(PHASE), expected, atol=1e-12)


def test_plates_stand_at_45_degrees_to_both_sides_and_turn_together() -> None:
    first, second = quarter_wave_plates(Plates(angle_error=5, retardance_error=3))
    for plate, angle in ((first, 50.0), (second, -40.0)):
        along = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        across = np.array([-along[1], along[0]])
        ahead = np.angle((along @ plate @ along) / (across @ plate @ across))
        assert np.degrees(ahead) == pytest.approx(93)
        assert abs(along @ plate @ across) < 1e-12
