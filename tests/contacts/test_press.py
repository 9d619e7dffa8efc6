"""Presses: their tractions, against moments of the textbooks, and what cannot press."""

from typing import Any

import numpy as np
import pytest

from fringeforce.base.errors import InputError
from fringeforce.contacts.press import Press, Profile
from fringeforce.design.files import load_sensor
from fringeforce.mechanics import fourier
from fringeforce.models.characterization import characterize
from fringeforce.models.presses import press_phase, tractions
from fringeforce.optics.photoelasticity import phase_lead, stress_optic_constant


@pytest.mark.parametrize(
    ("profile", "variance"), [("line", 0.0), ("flat", 1 / 3), ("hertz", 1 / 4), ("punch", 1 / 2)]
)
def test_profiles_have_the_variance_of_their_weight(profile: Profile, variance: float) -> None:
    press = Press(x=1e-3, normal=2.0, tangential=0.5, width=0.6e-3, profile=profile)
    places, forces = press.distributed()
    np.testing.assert_allclose(forces.sum(axis=0), [2.0, 0.5])
    share = forces[:, 0] / 2.0
    assert np.isclose(share @ places, 1e-3)
    assert np.isclose(share @ (places - 1e-3) ** 2, variance * 0.3e-3**2, atol=1e-18)


def test_an_edge_is_a_flat_body_that_leaves_the_surface_at_the_other_end() -> None:
    edge = Press(x=1e-3, normal=2.0, tangential=0.5, width=0.6e-3, profile="edge")
    places, forces = edge.distributed()
    np.testing.assert_allclose(forces.sum(axis=0), [2.0, 0.5])
    assert np.isclose(forces[:, 0] @ places / 2.0, 1e-3 + 0.15e-3)
    # a half-plane rises with the slope that sums pressure over distance, Johnson's equation (2.25);
    # between the nodes the sums are exact (Erdogan and Gupta, Q. Appl. Math. 29, 525, 1972)
    n = len(places)
    between = 1e-3 + 0.3e-3 * np.cos(np.pi * np.arange(1, n) / n)
    slopes = (forces[:, 0] / (between[:, None] - places)).sum(axis=1)
    np.testing.assert_allclose(slopes, slopes.mean(), rtol=1e-9)
    assert np.isclose(abs(slopes.mean()), 2.0 / 0.3e-3)
    left, _ = Press(x=1e-3, normal=2.0, width=0.6e-3, profile="edge", angle=180).distributed()
    np.testing.assert_allclose(left, 2e-3 - places)


def test_light_of_a_line_is_that_of_the_exact_series_and_of_the_matrix() -> None:
    rolling = load_sensor("saad").replace(**{"transducer.edges": "roller"})
    x, forces = rolling.pixel_positions, np.zeros((11, 2))
    forces[4] = 1.0, 0.4
    press = Press(x=float(rolling.tactels.positions[4]), normal=1.0, tangential=0.4)
    layer = rolling.transducer.photoelastic
    stress = fourier.integrated_stress(rolling.transducer, [press.x], x)
    constant = stress_optic_constant(layer, rolling.polariscope.wavelength)
    exact = phase_lead(stress[:, 0] @ [1.0, 0.4], constant)
    np.testing.assert_allclose(press_phase(rolling, x, [press]), exact, atol=1e-12)
    free = characterize(load_sensor("saad"))
    lines = free.phase([press])
    assert np.abs(lines - free.phase(forces)).max() < 2e-3 * np.abs(lines).max()


def test_a_wide_press_is_the_sum_of_narrow_ones() -> None:
    model = characterize(load_sensor("saad"))
    wide = model.phase([Press(x=0.2e-3, normal=1.0, tangential=0.2, width=1e-3, profile="flat")])
    places = 0.2e-3 + (np.arange(200) + 0.5) / 200 * 1e-3 - 0.5e-3
    narrow = [Press(x=float(x), normal=1 / 200, tangential=0.2 / 200) for x in places]
    np.testing.assert_allclose(model.phase(narrow), wide, atol=1e-4 * np.abs(wide).max())


def test_frames_of_presses_come_singly_and_in_rows() -> None:
    model = characterize(load_sensor("saad"))
    one = [Press(x=0.0, normal=1.0, radius=3e-3)]
    assert model.expose(one, rng=0).shape == (2048,)
    assert model.expose([one, [*one, Press(x=3e-3, normal=0.5)]], rng=0).shape == (2, 2048)
    built = model.with_tolerances(**{"tactels.placement": "0 +/- 0.1 mm"}).as_built(rng=1)
    still = model.phase(one)
    np.testing.assert_allclose(built.phase(one), still)


def test_a_cylinder_is_narrower_than_on_its_cover_alone() -> None:
    sensor = load_sensor("saad")
    places, forces = tractions(sensor, Press(x=0.0, normal=2.0, radius=5e-3))
    cover, width = sensor.transducer.compliant, sensor.transducer.width
    half = np.sqrt(4 * 2.0 / width * 5e-3 / (np.pi * cover.youngs_modulus))
    assert np.isclose(forces[:, 0].sum(), 2.0)
    assert 0.3 * half < np.ptp(places) / 2 < half


@pytest.mark.parametrize("normal", [1e-5, 1e-3, 6e-3])
def test_a_faint_cylinder_keeps_its_force_and_is_as_wide_as_on_a_half_space(normal: float) -> None:
    sensor = load_sensor("saad")
    press = Press(x=0.0, normal=normal, tangential=0.3 * normal, radius=2e-3)
    places, forces = tractions(sensor, press)
    cover, width = sensor.transducer.compliant, sensor.transducer.width
    # Johnson, Contact Mechanics, equation (4.43)
    half = np.sqrt(4 * normal / width * 2e-3 / (np.pi * cover.youngs_modulus))
    np.testing.assert_allclose(forces.sum(axis=0), [normal, 0.3 * normal], rtol=1e-6)
    # the light along the strip does not resolve a few micrometres
    assert np.ptp(places) / 2 == pytest.approx(half, abs=6e-6)


@pytest.mark.parametrize(
    ("numbers", "words"),
    [
        ({"normal": 0.0}, "normal = 0.0"),
        ({"x": np.nan}, "x = nan"),
        ({"width": -1e-3}, "width = -0.001"),
        ({"tangential": 1.0}, "friction of 0.6"),
        ({"radius": 1e-3, "width": 1e-3}, "either a radius"),
        ({"profile": "flat"}, "needs a width"),
        ({"profile": "round", "width": 1e-3}, "'round'"),
    ],
)
def test_what_cannot_press_is_told(numbers: dict[str, Any], words: str) -> None:
    given: dict[str, Any] = {"x": 0.0, "normal": 1.0, **numbers}
    with pytest.raises(InputError, match=words):
        Press(**given)


def test_a_press_beyond_the_strip_is_told() -> None:
    with pytest.raises(InputError, match="beyond the strip"):
        tractions(load_sensor("saad"), Press(x=12.4e-3, normal=1.0, width=1e-3))
