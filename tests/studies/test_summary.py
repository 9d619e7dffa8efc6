"""What `show` says of a strip."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.studies.summary import summary

LAMP = "a frame without lamp"


@pytest.mark.parametrize(
    ("changes", "noticed"),
    [
        ({}, False),
        ({"polariscope.visibility": 0.97}, True),
        ({"polariscope.visibility": "0.97 +/- 0.02"}, False),
        ({"polariscope.channels": [{"bias": 0}, {"bias": 90}]}, True),
    ],
)
def test_it_says_whether_a_lamp_that_is_off_is_noticed(
    sensor: ff.Sensor, changes: dict[str, object], noticed: bool
) -> None:
    model = ff.characterize(sensor.replace(**changes))
    assert dict(summary(model))[LAMP].startswith("good, refused" if noticed else "reads as NO_")
    # frames of darkness and noise, drawn anew
    dark = np.full(model.frame_shape, model.sensor.camera.offset)
    levels = np.round(dark + np.random.default_rng(1).uniform(-2.5, 2.5, dark.shape))
    assert (ff.Reader(model).search(levels).status is ff.Status.NO_CONTACT) == (not noticed)
