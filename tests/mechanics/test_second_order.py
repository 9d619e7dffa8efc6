"""Elements that contacts ask for, by the second order of their light."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import fringeforce as ff
from fringeforce.mechanics.finite_strain import finite_strip
from fringeforce.mechanics.second_order import STEEP, resolved_share


def _light(sensor: ff.Sensor, loads: str, width: float, order: int, share: float) -> np.ndarray:
    """Light of two contacts that press with a third of the cover's modulus, and of their shear."""
    transducer = sensor.transducer.model_copy(update={"loads": loads})
    widths, centres = np.full(2, width), [-0.6e-3, 0.4e-3]
    strip = finite_strip(transducer, centres, widths, order=order, share=share, growth=STEEP)
    force = 0.3 * 11e6 * width * 2e-3
    seen = strip.light.at_stations(strip.solved(force * np.array([[1.0, 0.3], [0.8, -0.2]])))
    return CubicSpline(strip.mesh.stations, seen)(np.linspace(-9e-3, 9e-3, 2000))


@pytest.mark.parametrize(("width", "dead", "follower"), [(2e-4, 1, 1 / 4), (8e-4, 1, 1)])
def test_elements_beside_contacts_follow_from_the_error_of_their_light(
    sensor: ff.Sensor, width: float, dead: float, follower: float
) -> None:
    """Loads that follow the surface turn with the ends of contacts, dead ones do not."""
    for loads, largest in (("dead", dead), ("follower", follower)):
        transducer = sensor.transducer.model_copy(update={"loads": loads})
        assert min(resolved_share(transducer, width, 4), 1) == largest


def test_follower_loads_on_narrow_contacts_shine_as_on_finer_elements(sensor: ff.Sensor) -> None:
    fine, own, coarse = (
        _light(sensor, "follower", 2e-4, order, share)
        for order, share in ((6, 1 / 32), (4, 1 / 4), (4, np.inf))
    )
    error = np.abs([own, coarse] - fine).max(axis=1) / np.abs(fine).max()
    assert error[0] < 5e-4
    assert error[1] > 4 * error[0]


def test_elements_grow_steeply_up_to_those_without_a_share(sensor: ff.Sensor) -> None:
    strip = finite_strip(sensor.transducer, [0.0], [4e-4], share=1 / 32, growth=STEEP)
    usual = finite_strip(sensor.transducer, [0.0], [4e-4])
    beyond = np.diff(strip.mesh.x[strip.mesh.x >= 2e-4 * (1 - 1e-9)])
    assert beyond[0] <= 4e-4 / 32
    assert np.all(beyond[1:3] / beyond[:2] <= STEEP * (1 + 1e-9))
    assert len(strip.mesh.x) - len(usual.mesh.x) <= 10
    same = finite_strip(sensor.transducer, [0.0], [4e-4], growth=STEEP)
    np.testing.assert_array_equal(same.mesh.x, usual.mesh.x)
