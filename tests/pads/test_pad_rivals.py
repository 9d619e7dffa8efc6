"""Loads of several fringes found cold, and frames that more than one load explains."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.estimation.likelihood import Misfit
from fringeforce.models.pad import PadModel
from fringeforce.reading.pads.fit import Curvature, Place, Top
from fringeforce.reading.pads.mirror_images import Mirror, weighed
from fringeforce.reading.pads.sampling import lattice
from fringeforce.reading.reading import Status

Array = np.ndarray


@pytest.fixture(scope="module")
def noisy(model: PadModel) -> PadModel:
    """A third of the light is noise, on few pixels."""
    camera = {"pixels": [48, 40], "noise": 70, "noise_model": "gaussian", "bits": 10, "offset": 380}
    return PadModel(model.sensor.replace(camera=camera), model.influence)


def contact(model: PadModel, rng: np.random.Generator, peak: float) -> Array:
    """One to three pressed tactels with some shear, of a given largest retardance."""
    forces = np.zeros((model.sensor.tactels.total, 3))
    for _ in range(rng.integers(1, 4)):
        push = rng.uniform(0.5, 3)
        shear = rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4)
        forces[rng.integers(len(forces))] = push * np.array([1, *shear])
    return forces * peak / np.hypot(*model.retardance(forces)).max()


@pytest.mark.parametrize("peak", [5.0, 8.0, 11.0])
def test_loads_of_several_half_waves_are_found_without_an_earlier_state(
    model: PadModel, peak: float
) -> None:
    reader = ff.Reader(model)
    for seed in range(2):
        rng = np.random.default_rng(seed)
        forces = contact(model, rng, peak)
        reading = reader.search(model.expose(forces, rng))
        assert reading.status is Status.OK
        assert (np.abs(reading.forces - forces) < 5.5 * reading.std).all()


def test_a_mirror_image_turns_back_at_the_fold(model: PadModel) -> None:
    forces = np.zeros((model.sensor.tactels.total, 3))
    forces[9, 0] = 1.0
    places = lattice(model, 40)
    loads = forces * (np.pi / 2 + 0.2) / np.hypot(*model.retardance(forces)).max()
    before = np.hypot(*model.retardance(loads))
    images = [image.reshape(-1, 3) for image in Mirror(places, (1.0,)).images(loads.ravel())]
    after = [np.hypot(*model.retardance(image)) for image in images]
    assert min(size.max() for size in after) < before.max() - 0.05
    # what is seen hardly changes
    assert min(np.abs(np.sin(size) - np.sin(before)).max() for size in after) < 0.1


def test_spots_of_a_pad_are_never_read_wrong_without_a_doubt(model: PadModel) -> None:
    forces = contact(model, np.random.default_rng(4), 4.0)
    reader, frame = ff.Reader(model), model.expose(forces, 0)
    for row, column in ((30, 40), (44, 40), (40, 30)):
        mask = np.ones(model.frame_shape, dtype=bool)
        mask[row : row + 20, column : column + 20] = False
        reading = reader.search(frame, mask=mask)
        apart = np.abs(reading.forces - forces) / reading.std
        assert reading.status is not Status.OK or apart.max() < 6


def test_a_frame_that_two_loads_explain_names_both(noisy: PadModel) -> None:
    rng = np.random.default_rng(1023)
    forces = contact(noisy, rng, 1.0) * rng.uniform(1.3, 4)
    frame = noisy.expose(forces, rng)
    reading = ff.Reader(noisy).search(frame)
    assert reading.status is Status.AMBIGUOUS
    assert reading.alternatives.shape[1:] == forces.shape
    camera = noisy.sensor.camera
    for other in reading.alternatives:
        apart = (other - reading.forces).ravel()
        assert apart @ np.linalg.solve(reading.covariance, apart) > forces.size
        left = [
            ((frame - camera.offset - camera.amplitude * noisy.intensity(loads)) ** 2).sum()
            for loads in (reading.forces, other)
        ]
        # neither is ruled out by the grey levels
        assert abs(left[1] - left[0]) < 25 * camera.noise**2


def top(forces: list[float], loss: float) -> Top:
    one = np.zeros(1)
    place = Place(np.array(forces), np.zeros((2, 1, 1, 1), np.float32), [], one)
    return Top(np.array(forces), Curvature(np.eye(3)), place, Misfit(loss, one, one))


def test_rivals_are_weighed_by_their_likelihoods() -> None:
    information = 100 * np.eye(3)
    likely, far = top([2.0, 0, 0], 1000.0), top([3.0, 0, 0], 1001.0)
    both = weighed([likely, far], information)
    np.testing.assert_array_equal(both.forces, likely.forces)
    np.testing.assert_array_equal(both.others, [far.forces])
    ruled_out = weighed([likely, top([3.0, 0, 0], 1020.0)], information)
    assert not len(ruled_out.others)
    np.testing.assert_array_equal(ruled_out.information, information)
    # two that are near to each other are one, with the covariance of their mixture
    near = weighed([likely, top([2.2, 0, 0], 1000.0)], information)
    assert not len(near.others)
    np.testing.assert_allclose(near.forces, [2.1, 0, 0])
    np.testing.assert_allclose(np.linalg.inv(near.information)[0, 0], 0.01 + 0.01)
    # contact pushes
    pulls = weighed([top([-2.0, 0, 0], 1000.0), likely], information)
    np.testing.assert_array_equal(pulls.forces, likely.forces)
