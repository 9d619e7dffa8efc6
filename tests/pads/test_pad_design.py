"""Designs of pads: they read back, and say what is wrong with them."""

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.design.files import load_strip, parse_sensor, shipped_pads
from fringeforce.design.pad import Pad


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
