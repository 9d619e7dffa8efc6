"""Contacts that no light shows, for pixels are masked or the camera sees another part."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.reading.contact_prior import unseen_words


@pytest.fixture
def mask() -> np.ndarray:
    """Half of the strip, where the first five tactels are."""
    return np.arange(2048) < 1024


@pytest.mark.filterwarnings("ignore::fringeforce.base.errors.LargeStrainWarning")
@pytest.mark.parametrize("normal", [0.3, 2.0, 6.0])
@pytest.mark.parametrize("beside", [0.0, 1.0])
def test_a_force_on_a_hidden_tactel_lies_within_its_deviation(
    model: ff.SensorModel, mask: np.ndarray, normal: float, beside: float
) -> None:
    forces = np.zeros((11, 2))
    forces[0], forces[9] = (normal, 0.2 * normal), (beside, 0.0)
    reading = ff.Reader(model).search(model.expose(forces, rng=0), mask=mask)
    assert reading.status in (ff.Status.OK, ff.Status.AMBIGUOUS)
    assert reading.detail.startswith("No light shows what acts on tactels 1 to ")
    assert abs(reading.forces[0, 0] - normal) < 2 * reading.std[0, 0]
    if beside:
        assert reading.ok
        np.testing.assert_array_less(np.abs(reading.forces - forces)[6:], 4 * reading.std[6:])
        assert reading.std[9].max() < 0.05


def test_no_contact_is_only_said_of_what_is_seen(model: ff.SensorModel, mask: np.ndarray) -> None:
    reader, nothing = ff.Reader(model), np.zeros((11, 2))
    frames = model.expose([nothing] * 6, rng=0)
    batch = reader.read_on(frames, mask=mask)
    assert set(batch.status) == {ff.Status.OK}
    assert (batch.std[:, :4, 0] > 1.0).all()
    reader.reset()
    for frame in frames:
        reading = reader.read(frame, mask=mask)
        assert reading.status is ff.Status.OK
        assert "tactels 1 to 5; the others" in reading.detail
    reader.reset()
    reading = reader.read(frames[0])
    assert (reading.status, reading.detail) == (ff.Status.NO_CONTACT, "")
    assert reading.std.max() < 0.1 * batch.std[:, :4].min()


def test_a_camera_that_may_look_anywhere_tells_nothing(model: ff.SensorModel) -> None:
    shifted = model.sensor.replace(**{"camera.shift": "0 +/- 3.56 mm"})
    reading = ff.Reader(ff.characterize(shifted)).search(
        model.expose(ff.polar(1.0, angle=10, n=11), rng=0)
    )
    assert reading.status is ff.Status.AMBIGUOUS
    assert reading.detail == "No light shows what acts on any tactel."


@pytest.mark.parametrize("place", [-5e-3, 5e-3])
def test_a_skin_is_not_read_as_whole_where_a_part_is_hidden(mask: np.ndarray, place: float) -> None:
    model = ff.characterize(ff.load_sensor("skin"))
    frame = model.expose([ff.Press(x=place, normal=0.5, radius=3e-3)], rng=0)
    reader = ff.Reader(model)
    reading = reader.search(frame, mask=mask)
    assert reading.status is ff.Status.AMBIGUOUS
    assert reading.detail == "No light shows what presses from -6.5 to -3 mm."
    assert reader.search(frame).detail == ""
    # pixels here and there hide nothing
    assert reader.search(frame, mask=mask & (np.arange(2048) % 2 == 0)).ok


def test_tactels_are_named_by_their_numbers() -> None:
    dark = np.isin(np.arange(11), [0, 1, 2, 5, 9, 10])
    assert "tactels 1 to 3, 6, 10 to 11; the others" in unseen_words(dark)
    assert "tactel 4; the others" in unseen_words(np.arange(11) == 3)
