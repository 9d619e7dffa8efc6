"""Fingertips, resultants and colours, against closed forms."""

import numpy as np
import pytest
from scipy.integrate import dblquad

from fringeforce.contacts.resultant import resultant
from fringeforce.design.pad import PadTactels
from fringeforce.explorer.pads.fingers import groups, tactel_forces
from fringeforce.explorer.pads.protocol import Finger
from fringeforce.optics.colour import encoded, light_colour, white_light

TACTELS = PadTactels(count=(11, 9), pitch=1e-3)
ALL = np.arange(99)


def finger(x: float, y: float, radius: float, normal: float, **others: float) -> Finger:
    return Finger(x=x, y=y, radius=radius, normal=normal, **others)


def test_tactels_share_the_load_as_the_pressure_of_hertz_does() -> None:
    radius, place = 4e-3, (0.3e-3, -0.2e-3)
    forces = tactel_forces(TACTELS, [finger(*place, radius, 5.0)])[:, 0]

    def pressure(y: float, x: float) -> float:
        r = np.hypot(x - place[0], y - place[1])
        return 3 * 5.0 / (2 * np.pi * radius**2) * np.sqrt(max(1 - (r / radius) ** 2, 0))

    for tactel in (49, 51, 40, 60):
        x, y = TACTELS.places[tactel]
        half = TACTELS.pitch / 2
        cell = x - half, x + half, y - half, y + half
        expected = dblquad(pressure, *cell, epsrel=1e-4)[0]
        assert forces[tactel] == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize("place", [(0.0, 0.0), (1.2e-3, -0.7e-3), (5.5e-3, 4e-3)])
@pytest.mark.parametrize("radius", [1e-5, 2e-3])
def test_no_force_is_lost_between_a_contact_and_its_tactels(
    place: tuple[float, float], radius: float
) -> None:
    one = finger(*place, radius, 3.0, shear_x=0.5, shear_y=-1.0)
    total = tactel_forces(TACTELS, [one]).sum(axis=0)
    np.testing.assert_allclose(total, [3.0, 0.5, -1.0], rtol=1e-9)


def test_a_twist_is_a_moment_and_no_force() -> None:
    one = finger(1e-3, 0.5e-3, 3e-3, 4.0, twist=2e-3)
    forces = tactel_forces(TACTELS, [one])
    found = resultant(TACTELS.places, forces, ALL)
    np.testing.assert_allclose(found.force[1:], 0, atol=1e-2)
    assert found.moment[2] == pytest.approx(2e-3, rel=0.05)


def test_the_centre_of_pressure_is_where_the_finger_is() -> None:
    forces = tactel_forces(TACTELS, [finger(1e-3, -0.5e-3, 2e-3, 4.0)])
    found = resultant(TACTELS.places, forces, ALL)
    np.testing.assert_allclose(found.centre, [1e-3, -0.5e-3], atol=2e-5)
    np.testing.assert_array_equal(found.std, 0)


def test_a_tactel_belongs_to_the_nearest_contact_or_to_none() -> None:
    fingers = [finger(-3e-3, 0, 1e-3, 1.0), finger(3e-3, 0, 1e-3, 1.0)]
    left, right = groups(TACTELS, fingers)
    assert not (left & right).any()
    assert left[(TACTELS.places == [-3e-3, 0]).all(axis=1)].all()
    assert not (left | right)[0]


def test_all_wavelengths_together_are_white_and_none_is_black() -> None:
    white = white_light(np.linspace(420e-9, 680e-9, 10))
    assert encoded(np.ones(10) @ white).tolist() == [255, 255, 255]
    assert encoded(np.zeros(10) @ white).tolist() == [0, 0, 0]


def test_screens_are_encoded_as_their_standard_says() -> None:
    # IEC 61966-2-1: the middle grey of 18 % and the end of its straight part
    assert encoded(np.array([0.18, 0.0031308, 2.0, -1.0])).tolist() == [118, 10, 255, 0]


@pytest.mark.parametrize(
    ("wavelength", "brightest"), [(450e-9, 2), (530e-9, 1), (632.8e-9, 0), (680e-9, 0)]
)
def test_light_has_the_colour_that_people_call_it_by(wavelength: float, brightest: int) -> None:
    assert light_colour(wavelength).argmax() == brightest
