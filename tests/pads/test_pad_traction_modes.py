"""Tractions beside their tactels: functions that are like them, and readings within deviations."""

import numpy as np
import pytest
from scipy import stats

import fringeforce as ff
from fringeforce.design.pad import Pad
from fringeforce.mechanics.solid.block import Patches
from fringeforce.models.imaging import camera_response
from fringeforce.models.pad import PadModel
from fringeforce.models.pad_slices import slice_retardance
from fringeforce.models.pad_traction_modes import HIGHEST, MOST_FUNCTIONS, traction_modes
from fringeforce.models.pad_uncertainty import PadUncertainty
from fringeforce.optics import camera as camera_optics
from fringeforce.reading.reading import Status

Array = np.ndarray
RARE = 1e-5
STATED = {"tactels.placement": "0 +/- 0.1 mm", "tactels.size": "2 +/- 0.2 mm"}

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def beside(pad: Pad) -> PadModel:
    return ff.characterize(
        pad.replace(**{"tactels.size": "2 mm", "camera.amplitude": 240.0, **STATED})
    )


def test_few_functions_are_like_any_rectangle_beside_its_tactel(beside: PadModel) -> None:
    """Of a push of a newton, what least squares leave of the light is no more than noise."""
    pad, rng, known = beside.sensor, np.random.default_rng(4), PadUncertainty.of(beside)
    tactel, force = 6, np.zeros((20, 3))
    force[tactel] = [1.0, 0.3, -0.2]
    x, y = (places[::2] for places in pad.pixel_positions)
    whole = 2 * known.model.influence.profile.sum(axis=0)

    def seen(load: tuple[Patches, Array]) -> Array:
        return 2 * slice_retardance(pad, [load], x, y, 16).sum(axis=0).ravel()

    columns = np.concatenate(
        [
            np.einsum("k,fkpn->fpn", whole, influence.matrix(x, y)) @ force.ravel()
            for influence in (beside.influence, *(one for _, _, one in known.contacts))
        ]
    ).reshape(len(known.tractions) + 1, -1)
    response = camera_response(pad.camera)
    # light is half of the amplitude times one of two parts of the retardance, of one pixel in four
    unit = 4 * np.mean(response.amplitude**2 / response.variance) / 8
    left = []
    for _ in range(10):
        place = pad.tactels.places[tactel] + 0.1e-3 * rng.standard_normal(2)
        sides = 2e-3 + 0.2e-3 * rng.standard_normal(2)
        light = seen((Patches(place[None], sides[None]), force[tactel][None]))
        found = np.linalg.lstsq(columns.T, light, rcond=None)[0]
        left.append(unit * np.square(light - found @ columns).sum())
    # a function counts that adds as much as noise in one number, of which thousands are seen
    assert np.mean(left) < 3
    assert max(left) < 20


def test_readings_allow_for_rectangles_beside_their_tactels(beside: PadModel) -> None:
    pad, reader = beside.sensor, ff.Reader(beside)
    count, rng, distances, off = 4, np.random.default_rng(8), [], []
    for _ in range(count):
        forces = np.zeros((pad.tactels.total, 3))
        touched = rng.choice(len(forces), 2, replace=False)
        push, angle = rng.uniform(0.4, 2.0, 2), rng.uniform(0, 2 * np.pi, 2)
        shear = rng.uniform(0, 0.4, 2)
        forces[touched] = (push * [np.ones(2), shear * np.cos(angle), shear * np.sin(angle)]).T
        places = pad.tactels.places + 0.1e-3 * rng.standard_normal((len(forces), 2))
        sides = 1.9e-3 + 0.1e-3 * rng.standard_normal((len(forces), 2))
        slices = slice_retardance(pad, [(Patches(places, sides), forces)], *pad.pixel_positions, 16)
        light = beside.seen(slices).reshape(beside.frame_shape)
        reading = reader.search(camera_optics.expose(pad.camera, light, rng))
        assert reading.status is Status.OK
        apart = (reading.forces - forces).ravel()
        distances.append(apart @ np.linalg.solve(reading.covariance, apart))
        off.append(np.abs(reading.forces - forces)[touched] / reading.std[touched])
    low, high = stats.chi2(count * 60).ppf([RARE, 1 - RARE])
    assert low < np.sum(distances) < high
    # of six forces a frame
    assert np.max(off) < stats.norm.isf(RARE / 2)
    assert np.mean(np.square(off)) < stats.chi2(6 * count).isf(RARE) / (6 * count)


def test_tolerances_that_are_too_wide_leave_tractions_on_their_squares(beside: PadModel) -> None:
    wide = {"tactels.placement": "0 +/- 0.3 mm", "tactels.size": "2 +/- 0.4 mm"}
    profile = beside.influence.profile
    found = traction_modes(beside.sensor.replace(**wide), profile)
    assert len(found) == sum(order + 1 for order in range(1, HIGHEST + 1))
    assert len(found) < len(traction_modes(beside.sensor, profile)) <= MOST_FUNCTIONS


def test_functions_of_tactels_that_are_hardly_touched_do_not_show(beside: PadModel) -> None:
    known = PadUncertainty.of(beside)
    forces = np.zeros((beside.sensor.tactels.total, 3))
    forces[3], forces[7] = [1.0, 0, 0], [0.02, 0, 0]
    shown = known.shown(forces.ravel()).reshape(len(known.tractions), -1)
    assert shown[:, 3].all()
    assert 0 < shown[:, 7].sum() < len(known.tractions) / 2
    assert not np.delete(shown, [3, 7], axis=1).any()
