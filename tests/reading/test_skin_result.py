"""What is stated of contacts on a skin, beside numerical derivatives, and where none push."""

from dataclasses import replace

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.models.skin import GEOMETRY, PLACE, WIDTH, Contacts
from fringeforce.reading.skin_following import SkinFollower
from fringeforce.reading.skin_reader import SkinReader
from fringeforce.reading.skin_result import SkinResult

TWO = [
    ff.Press(x=-2e-3, normal=1.5, tangential=0.4, width=0.8e-3),
    ff.Press(x=2.5e-3, normal=0.7, width=0.5e-3),
]


@pytest.fixture(scope="module")
def single() -> SkinReader:
    return SkinReader(ff.characterize(ff.load_sensor("skin")))


@pytest.fixture(scope="module")
def result(single: SkinReader) -> SkinResult:
    """Of two contacts."""
    frame = single.model.expose(TWO, rng=0)
    _, one = single.followed(frame, np.ones(frame.size, bool), None)
    assert one is not None
    return SkinResult(single.skin, one)


def changed(result: SkinResult, contacts: Contacts) -> SkinResult:
    """The same of other contacts, as sure of them."""
    return SkinResult(result.skin, replace(result.one, contacts=contacts), result)


@pytest.mark.parametrize("which", ["total", "single"])
def test_covariances_are_those_of_numerical_derivatives(result: SkinResult, which: str) -> None:
    def stated(result: SkinResult) -> ff.Resultant:
        return result.total() if which == "total" else result.contacts()[0]

    contacts, columns = result.one.contacts, list[np.ndarray]()
    for k in range(len(contacts.forces)):
        lengths = [2 + PLACE, 2 + WIDTH]
        for number in range(2 + GEOMETRY):
            forces, geometry = contacts.forces.copy(), contacts.geometry.copy()
            step = 1e-9 if number in lengths else 1e-6
            if number < 2:
                forces[k, number] += step
            else:
                geometry[k, number - 2] += step
            moved = stated(changed(result, Contacts(forces, geometry))).values
            columns.append((moved - stated(result).values) / step)
    slopes = np.column_stack(columns)
    std = np.sqrt(np.diag(slopes @ result.joint @ slopes.T))
    np.testing.assert_allclose(stated(result).std, std, rtol=1e-3, atol=1e-12)


def test_a_contact_is_where_it_is_however_little_it_presses(result: SkinResult) -> None:
    forces, geometry = result.one.contacts
    for size in (1e-9, 0.0, -0.01):
        weak = forces.copy()
        weak[1] = size, 0.0
        found = changed(result, Contacts(weak, geometry)).contacts()[-1]
        assert found.force[0] == size
        assert found.centre[0] == geometry[1, PLACE]
        apart = result.skin.places - geometry[1, PLACE]
        pressure = result.skin.shares(geometry)[1, 0]
        assert found.width == pytest.approx(4 * np.sqrt(pressure @ np.square(apart)))
        assert np.isfinite(found.covariance).all()


def test_contacts_that_do_not_push_together_have_no_centre(result: SkinResult) -> None:
    forces, geometry = result.one.contacts
    for opposite in (-forces, forces * [[1, 1], [0, 0]] - forces[0] * [[0, 0], [1, 1]]):
        total = changed(result, Contacts(opposite, geometry)).total()
        assert total.width is not None
        assert np.isnan([total.centre[0], total.width]).all()
        assert np.isfinite([*total.force, *total.std[:5]]).all()


def test_nothing_has_a_centre_on_the_skin(single: SkinReader) -> None:
    for seed in range(4):
        nothing = np.zeros((single.model.sensor.tactels.count, 2))
        frame = single.model.expose(nothing, rng=seed)
        reading = single.alone(frame, np.ones(frame.size, bool))
        assert reading.status is ff.Status.NO_CONTACT
        assert reading.total is not None
        assert reading.total.width is not None
        assert abs(reading.total.centre[0]) < single.skin.half
        assert 0 < reading.total.width < 2 * single.skin.half


def test_frames_that_are_followed_keep_their_probability(single: SkinReader) -> None:
    frames = single.model.expose([TWO, TWO, [replace(TWO[0], x=-1.95e-3), TWO[1]]], rng=1)
    used, follower = np.ones(frames.shape[1], bool), SkinFollower(single)
    readings = [follower.read(frame, used) for frame in frames]
    assert [reading.tracked for reading in readings] == [False, True, True]
    assert [reading.probability for reading in readings] == [readings[0].probability] * 3
    _, last = single.followed(frames[0], used, None)
    assert last is not None
    reading, _ = single.followed(frames[2], used, (last, 0.9995))
    assert reading.tracked
    assert reading.probability == 0.9995
