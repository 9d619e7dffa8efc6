"""Designs of pads: they read back, and say what is wrong with them."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.design.files import load_strip, parse_sensor
from fringeforce.design.pad import Pad
from fringeforce.design.shipped import shipped_pads


@pytest.mark.parametrize("name", shipped_pads())
def test_a_shipped_pad_reads_back_from_its_own_text(name: str) -> None:
    pad = ff.load_sensor(name)
    assert isinstance(pad, Pad)
    assert parse_sensor(pad.to_toml()) == pad


def test_every_optional_value_reads_back(pad: Pad) -> None:
    full = pad.replace(
        **{
            "tactels.size": "1.5 mm",
            "camera.kind": "ordinary",
            "camera.blur": "30 um",
            "polariscope.plates": {"retardance_error": 3.0},
            "polariscope.channels": [
                {"arrangement": "analyser", "angle": 45.0},
                {"arrangement": "plane", "wavelength": "450 nm"},
            ],
        }
    )
    assert parse_sensor(full.to_toml()) == full


def test_tactels_count_along_y_first(pad: Pad) -> None:
    places = pad.tactels.places
    assert len(places) == 20
    np.testing.assert_allclose(places[1] - places[0], [0, 2e-3], atol=1e-12)
    np.testing.assert_allclose(places.mean(axis=0), 0, atol=1e-12)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"tactels.pitch": "3 mm"}, "beyond the pad's 13 mm"),
        ({"tactels.size": "3 mm"}, "overlap"),
        ({"tactels.count": [5]}, "two whole numbers"),
        ({"camera.pixels": [96, 0.5]}, "two whole numbers"),
        ({"camera.amplitude": 300}, "exceeds the converter's"),
        ({"polariscope.channels": [{"arrangement": "plane"}]}, "brings its own analysers"),
        ({"transducer.sides": "glued"}, "must be 'free'"),
        ({"transducer.compliant.thickness": "0.5 m"}, "500 mm is more than 10 times the longest"),
        ({"transducer.compliant.thickness": "0.5 um"}, "less than 1/500 of the longest side, 13"),
    ],
)
def test_a_wrong_design_is_refused_with_its_remedy(pad: Pad, changes: dict, said: str) -> None:
    with pytest.raises(ff.FringeforceError, match=said):
        pad.replace(**changes)


def test_what_works_on_strips_only_says_so() -> None:
    with pytest.raises(ff.FringeforceError, match="is a planar pad"):
        load_strip("pad")
    with pytest.raises(ff.FringeforceError, match="no kind of sensor"):
        parse_sensor('kind = "glove"')


def test_a_skin_takes_the_place_of_tactels() -> None:
    skin = ff.load_sensor("pad-skin")
    assert skin.tactels.count == (11, 11)
    assert "[tactels]" not in skin.to_toml()
    assert parse_sensor(skin.to_toml()) == skin
    assert skin.replace(**{"skin.resolution": "1 mm"}).tactels.count == (22, 22)
    long = skin.replace(**{"skin.extent": ["20 mm", "10 mm"]})
    assert (long.tactels.count, long.tactels.pitch) == ((10, 5), 2e-3)
    pins = skin.replace(tactels={"count": [3, 3], "pitch": "2 mm"})
    assert pins.skin is None
    assert pins.replace(skin={"extent": ["22 mm", "22 mm"]}).tactels == skin.tactels


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"skin.extent": ["30 mm", "22 mm"]}, "beyond the pad's 25 mm"),
        ({"skin.extent": ["22 mm"]}, "must be two lengths"),
        ({"skin.extent": "22 mm"}, "must be two lengths"),
        ({"skin.friction": 0.0}, "skin.friction"),
        ({"transducer.sides": "free"}, 'sides = "roller"'),
    ],
)
def test_a_skin_that_cannot_be_is_told(change: dict, words: str) -> None:
    with pytest.raises(ff.FringeforceError, match=words):
        ff.load_sensor("pad-skin").replace(**change)
