"""Contacts on tactels further along, which a shifted camera shows alike."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.design.strip import Sensor
from fringeforce.reading.tactel_aliases import TactelAlias

Array = np.ndarray
PITCH = 1e-3


@pytest.fixture(scope="module")
def drawn() -> Sensor:
    sensor = ff.load_sensor("saad").replace(**{"transducer.edges": "roller"})
    assert sensor.tactels.pitch == pytest.approx(PITCH)
    return sensor


@pytest.fixture(scope="module")
def reader(drawn: Sensor) -> ff.Reader:
    return ff.Reader(ff.characterize(drawn.replace(**{"camera.shift": "0 +/- 0.3 mm"})))


def frame(drawn: Sensor, shift: float, forces: Array, rng: np.random.Generator) -> Array:
    """Of a strip whose camera looks this far along [m]."""
    return ff.characterize(drawn.replace(**{"camera.shift": shift})).expose(forces, rng)


@pytest.mark.parametrize("shift", [-0.45e-3, 0.45e-3])
def test_a_contact_half_way_between_tactels_may_be_on_either(
    drawn: Sensor, reader: ff.Reader, shift: float
) -> None:
    """The shift to the one tactel is 1.5 deviations, and to the other 1.8."""
    forces, rng = np.zeros((11, 2)), np.random.default_rng(0)
    forces[5] = 1.0, 0.2
    reading = reader.search(frame(drawn, shift, forces, rng))
    assert reading.status is ff.Status.AMBIGUOUS
    both = np.array([reading.forces, *reading.alternatives])
    found = {int(np.argmax(one[:, 0])) for one in both}
    other = 5 + int(np.sign(shift)) * -1
    assert found == {5, other}
    for one in both:
        assert one[:, 0].max() == pytest.approx(1.0, abs=0.05)


def test_contacts_up_to_the_ends_tell_where_the_camera_looks(
    drawn: Sensor, reader: ff.Reader
) -> None:
    rng = np.random.default_rng(1)
    forces = ff.polar(rng.uniform(0.5, 1.5, 11), rng.uniform(-20, 20, 11))
    reading = reader.search(frame(drawn, 0.45e-3, forces, rng))
    assert reading.ok
    apart = (reading.forces - forces).ravel()
    assert apart @ np.linalg.solve(reading.covariance, apart) < 60  # 22 expected


def test_images_are_on_all_tactels_that_the_prior_leaves_weight() -> None:
    alias = TactelAlias(shift=6, pitch=2.0, count=(3, 2), axis=0)
    loads, unknowns = np.arange(1.0, 7.0), np.zeros(7)

    def loss(moved: Array) -> float:
        return float(moved[6] ** 2)

    found = {moved[6]: own for own, moved in alias.images(loads, unknowns, loss)}
    assert sorted(found) == [-4.0, -2.0, 2.0, 4.0]  # 4 squared is just what has weight
    np.testing.assert_array_equal(found[2.0], [0, 0, 1, 2, 3, 4])
    np.testing.assert_array_equal(found[-4.0], [5, 6, 0, 0, 0, 0])
    across = TactelAlias(shift=6, pitch=2.0, count=(3, 2), axis=1)
    found = {moved[6]: own for own, moved in across.images(loads, unknowns, loss)}
    np.testing.assert_array_equal(found[2.0], [0, 1, 0, 3, 0, 5])
    assert not list(TactelAlias(6, 5.0, (6,)).images(loads, unknowns, loss))
