"""Cylinders on an elastic surface, against the half-space of Hertz, Cattaneo and Mindlin."""

import numpy as np
import pytest

from fringeforce.base.errors import InputError
from fringeforce.contacts.cylinder import Compliance, cylinder_forces
from fringeforce.design.files import load_sensor
from fringeforce.mechanics.fourier import surface_displacement

STEP, COUNT = 5e-6, 100
RADIUS, NORMAL = 5e-3, 0.1


@pytest.fixture(scope="module")
def deep() -> tuple[Compliance, float]:
    """A layer much thicker than the contacts are wide, and its plane-strain modulus times width.

    Hardly compressible, so that pressure and shear do not act on each other, as in the theory.
    """
    sensor = load_sensor("saad").replace(
        **{
            "transducer.edges": "roller",
            "transducer.plane": "strain",
            "transducer.compliant.thickness": "8 mm",
            "transducer.compliant.poissons_ratio": 0.4999,
            "tactels.count": 1,
        }
    )
    strip = sensor.transducer
    compliance = Compliance(STEP, *surface_displacement(strip, STEP, 2 * COUNT, terms=20000))
    cover = strip.compliant
    return compliance, cover.youngs_modulus / (1 - cover.poissons_ratio**2) * strip.width


def test_pressure_is_that_of_hertz(deep: tuple[Compliance, float]) -> None:
    compliance, modulus = deep
    pressure = cylinder_forces(compliance, RADIUS, NORMAL, 0.0, 0.5)[:, 0]
    # K. L. Johnson, Contact Mechanics, equations (4.43) and (4.44)
    half = np.sqrt(4 * NORMAL * RADIUS / (np.pi * modulus))
    x = (np.arange(len(pressure)) - len(pressure) // 2) * STEP
    hertz = 2 * NORMAL / (np.pi * half) * np.sqrt(np.maximum(1 - (x / half) ** 2, 0)) * STEP
    assert half > 25 * STEP
    assert np.isclose(pressure.sum(), NORMAL)
    assert np.abs(pressure - hertz).max() < 0.05 * hertz.max()  # at the edges, where it is steep
    inner = np.abs(x) < 0.9 * half
    assert np.abs(pressure - hertz)[inner].max() < 0.01 * hertz.max()


@pytest.mark.parametrize("used", [0.3, 0.7])
def test_shear_is_that_of_cattaneo_and_mindlin(deep: tuple[Compliance, float], used: float) -> None:
    compliance, modulus = deep
    friction = 0.5
    pressure, shear = cylinder_forces(
        compliance, RADIUS, NORMAL, used * friction * NORMAL, friction
    ).T
    assert np.isclose(shear.sum(), used * friction * NORMAL)
    assert (np.abs(shear) <= friction * pressure * (1 + 1e-6)).all()
    half = np.sqrt(4 * NORMAL * RADIUS / (np.pi * modulus))
    x = (np.arange(len(shear)) - len(shear) // 2) * STEP
    # Johnson's equations (7.25) and (7.28)
    stuck = half * np.sqrt(1 - used)
    full = np.sqrt(np.maximum(1 - (x / half) ** 2, 0))
    less = stuck / half * np.sqrt(np.maximum(1 - (x / stuck) ** 2, 0))
    theory = friction * 2 * NORMAL / (np.pi * half) * (full - less) * STEP
    inner = np.abs(x) < 0.9 * half
    assert np.abs(shear - theory)[inner].max() < 0.03 * theory.max()


def test_all_slips_at_the_limit_of_friction(deep: tuple[Compliance, float]) -> None:
    pressure, shear = cylinder_forces(deep[0], RADIUS, NORMAL, -0.5 * NORMAL, 0.5).T
    np.testing.assert_allclose(shear, -0.5 * pressure, atol=1e-12)


def test_contacts_wider_than_what_is_known_are_refused(deep: tuple[Compliance, float]) -> None:
    with pytest.raises(InputError, match="contact wider than"):
        cylinder_forces(deep[0], RADIUS, 50.0, 0.0, 0.5)
