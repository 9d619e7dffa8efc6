"""Contacts under cylinders of known radius, against the light of their own tractions."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.calibration.bench_expectation import contact_size
from fringeforce.calibration.bench_loads import bench_loads
from fringeforce.calibration.contact_phase import contact_phases
from fringeforce.calibration.round_contacts import under_radii
from fringeforce.contacts.press import Profile
from fringeforce.estimation.frame_model import EVEN, HERTZ, moment_table
from fringeforce.models.presses import press_phase

ORDER = 12


@pytest.mark.parametrize(("profile", "kind"), [(EVEN, "flat"), (HERTZ, "hertz")])
def test_moments_are_those_of_the_tractions_of_presses(profile: float, kind: Profile) -> None:
    press = ff.Press(x=0.3, normal=1.0, width=1.4, profile=kind)
    places, forces = press.distributed()
    table = moment_table(ORDER, profile)
    for power in range(ORDER):
        i = np.arange(power // 2 + 1)
        found = table[power, i] @ (0.3 ** (power - 2 * i) * 0.7 ** (2 * i))
        assert found == pytest.approx(forces[:, 0] @ places**power, rel=1e-12)


@pytest.mark.parametrize(("radius", "normal"), [(1e-3, 2.0), (5e-3, 0.5), (5e-3, 4.0)])
@pytest.mark.parametrize("beside", [0.0, 0.05e-3])
def test_the_light_of_a_cylinder_is_that_of_its_tractions(
    radius: float, normal: float, beside: float
) -> None:
    skin, forces = ff.load_sensor("skin"), (normal, 0.25 * normal)
    loads, shapes = under_radii(skin, bench_loads([1e-3], [forces], radii=radius))
    size = contact_size(skin, loads)
    contacts = contact_phases(skin, (), np.zeros(0), np.array([1e-3]), size, 0.1, None, shapes[0])
    order = contacts.mixing.shape[1]
    k, i = np.arange(order)[:, None], np.arange(order // 2 + 1)
    place, half = beside / size.reach, loads.widths[0, 0] / 2 / size.reach
    powers = np.power(place, np.maximum(k - 2 * i, 0)) * half ** (2 * i)
    moments = (moment_table(order, size.profile) * powers).sum(axis=1)
    found = np.einsum("gctr,r,t->g", contacts.lead[0, 3], contacts.mixing @ moments, forces)
    x = contacts.grid[:-1]
    press = ff.Press(x=1e-3 + beside, normal=normal, tangential=forces[1], radius=radius)
    true = press_phase(skin, x, [press])
    # a pixel of noise is a hundredth of the peak
    np.testing.assert_allclose(found, true, rtol=0, atol=1e-3 * np.abs(true).max())
