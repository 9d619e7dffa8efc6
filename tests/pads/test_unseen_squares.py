"""Squares of pads that no light shows."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.models.pad import PadModel


@pytest.mark.parametrize("normal", [0.0, 0.5, 3.0])
def test_a_hidden_square_has_a_wide_deviation_and_a_name(model: PadModel, normal: float) -> None:
    sensor = model.sensor
    far = sensor.tactels.places[:, 0]
    forces = np.zeros((len(far), 3))
    hidden, beside = far.argmin(), far.argmax()
    forces[hidden, 0], forces[beside, 0] = normal, 1.0
    x = sensor.pixel_positions[0]
    mask = np.zeros(model.frame_shape, bool)
    mask[..., x < far.min() + 1.2 * sensor.transducer.photoelastic.thickness] = True
    reader = ff.Reader(model)
    reading = reader.search(model.expose(forces, rng=0), mask=mask)
    assert reading.ok
    assert reading.detail.startswith("No light shows what acts on tactel")
    assert abs(reading.forces[hidden, 0] - normal) < 2 * reading.std[hidden, 0]
    assert abs(reading.forces[beside, 0] - 1.0) < 4 * reading.std[beside, 0] < 0.2
    silent = reader.search(model.expose(0 * forces, rng=0), mask=mask)
    assert silent.status is ff.Status.OK
    assert reader.search(model.expose(0 * forces, rng=0)).status is ff.Status.NO_CONTACT


def test_a_skin_is_not_read_as_whole_where_a_part_is_hidden(small_skin: PadModel) -> None:
    reader = ff.Reader(small_skin)
    x, _ = small_skin.sensor.pixel_positions
    mask = np.zeros(small_skin.frame_shape, bool)
    mask[..., x < 0] = True
    frames = small_skin.expose([[], [ff.Press(x=2e-3, y=0.0, normal=1.0, radius=5e-3)]], rng=0)
    silent, reading = (reader.search(frame, mask=mask) for frame in frames)
    assert silent.status is reading.status is ff.Status.AMBIGUOUS
    assert reading.detail.startswith("No light shows what presses on ")
    assert silent.detail == reading.detail
    assert reading.total is not None
    assert abs(reading.total.force[0] - 1.0) < 0.1
    assert reader.search(frames[1]).detail == ""


@pytest.mark.parametrize("share", [0.6, 0.8])
def test_squares_that_are_hidden_take_nothing_from_the_residuals(
    model: PadModel, share: float
) -> None:
    """Reduced chi-squares of frames of noise are one, and not too large for the verdict."""
    mask = np.zeros(model.frame_shape, bool)
    mask[..., : int(share * model.frame_shape[-1])] = True
    reader, nothing = ff.Reader(model), np.zeros((20, 3))
    readings = [reader.search(model.expose(nothing, rng=k), mask=mask) for k in range(6)]
    assert all(reading.ok for reading in readings)
    assert abs(np.mean([reading.chi2 for reading in readings]) - 1) < 0.02
