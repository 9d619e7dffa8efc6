"""A small pad whose tests take a second."""

import pytest

import fringeforce as ff
from fringeforce.design.pad import Pad
from fringeforce.models.pad import PadModel, characterize_pad


@pytest.fixture(scope="session")
def pad() -> Pad:
    return ff.load_sensor("pad").replace(
        name="small",
        **{
            "transducer.length": "13 mm",
            "transducer.width": "11 mm",
            "tactels.count": [5, 4],
            "camera.pixels": [96, 80],
        },
    )


@pytest.fixture(scope="session")
def model(pad: Pad) -> PadModel:
    return characterize_pad(pad, samples=48, slices=6)
