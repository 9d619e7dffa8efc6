"""Quadratic forms of polariscopes against textbook intensities and the strip's Jones calculus."""

import numpy as np
import pytest

from fringeforce.design.light import Channel, Plates, Polariscope
from fringeforce.optics.arrangement import Arrangement, arranged, signed
from fringeforce.optics.integrated import double_pass
from fringeforce.optics.polariscope import intensity, pictures

RETARDANCE, AXIS = np.linspace(0, 9, 50), 0.7


def seen(form: np.ndarray, retardance: np.ndarray, axis: float) -> np.ndarray:
    direction = np.array([np.cos(2 * axis), np.sin(2 * axis)])
    # several slices: one alone is limited to a wave
    slices = np.repeat(retardance / 2 / 4 * direction[None, :, None], 4, axis=0)
    light = double_pass(slices)
    return np.einsum("kp,kl,lp->p", light, form, light)


@pytest.mark.parametrize("axis", [0.0, 0.4, -1.0])
def test_the_dark_field_is_equation_11_for_every_direction(axis: float) -> None:
    form = arranged("dark field")
    np.testing.assert_allclose(seen(form, RETARDANCE, axis), intensity(RETARDANCE), atol=1e-12)
    bright = arranged("bright field")
    np.testing.assert_allclose(
        seen(bright, RETARDANCE, axis), 1 - intensity(RETARDANCE), atol=1e-12
    )


def test_a_plane_polariscope_shows_isoclinics_as_well() -> None:
    expected = np.sin(2 * (AXIS - 0.2)) ** 2 * np.sin(RETARDANCE / 2) ** 2
    np.testing.assert_allclose(seen(arranged("plane", 0.2), RETARDANCE, AXIS), expected, atol=1e-12)


def test_four_analysers_measure_the_sine_of_the_retardance_with_its_direction() -> None:
    four = [seen(arranged("analyser", a), RETARDANCE, AXIS) for a in np.radians([0, 45, 90, 135])]
    np.testing.assert_allclose(four[0] + four[2], 1, atol=1e-12)
    along = np.sin(RETARDANCE) * np.cos(2 * AXIS)
    across = np.sin(RETARDANCE) * np.sin(2 * AXIS)
    np.testing.assert_allclose(np.abs(four[1] - four[3]), np.abs(along), atol=1e-12)
    np.testing.assert_allclose(np.abs(four[0] - four[2]), np.abs(across), atol=1e-12)


@pytest.mark.parametrize("plates", [None, Plates(retardance_error=8, extinction_ratio=0.01)])
def test_with_the_axis_along_x_it_is_the_polariscope_of_the_strip(plates: Plates | None) -> None:
    strip = Polariscope(wavelength=6e-7, plates=plates, channels=(Channel(), Channel(bias=180.0)))
    both: tuple[Arrangement, Arrangement] = ("dark field", "bright field")
    for picture, kind in zip(pictures(strip), both, strict=True):
        found = seen(arranged(kind, plates=plates), RETARDANCE, 0.0)
        np.testing.assert_allclose(found, picture.fringe.intensity(RETARDANCE), atol=1e-12)


def test_only_pictures_with_two_biases_tell_pushing_from_pulling() -> None:
    four = np.array([arranged("analyser", a) for a in np.radians([0, 45, 90, 135])])
    assert signed(four)
    assert signed(four[:2])
    assert not signed(four[[0, 2]])
    assert not signed(np.array([arranged("dark field"), arranged("plane", 0.3)]))
