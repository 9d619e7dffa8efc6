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


@pytest.fixture(scope="session")
def small_skin() -> PadModel:
    """A pad of 16 x 14 mm with a skin."""
    drawn = ff.load_sensor("pad-skin").replace(
        **{"camera.pixels": [96, 96], "transducer.length": "16 mm", "transducer.width": "14 mm"},
        skin={"extent": ["14 mm", "12 mm"]},
    )
    found = ff.characterize(drawn)
    assert isinstance(found, PadModel)
    return found
