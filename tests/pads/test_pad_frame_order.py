"""Images of pads that come mirrored or turned."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.models.pad import PadModel


@pytest.mark.parametrize("axis", [-1, -2])
def test_a_mirrored_image_is_named(model: PadModel, axis: int) -> None:
    """Half a turn of a pad is its own mirror image; a mirror turns the polarisation around."""
    forces = np.zeros((20, 3))
    forces[6], forces[13] = (1.0, 0.2, 0.1), (1.5, 0.0, -0.3)
    frame = model.expose(forces, rng=0)
    reader = ff.Reader(model)
    assert reader.search(frame).ok
    reading = reader.search(np.flip(frame, axis))
    assert reading.status is ff.Status.MODEL_MISMATCH
    (said,) = reading.findings
    assert said.startswith("The frame fits if it is mirrored, ")
