"""Pixels that the command line leaves out: stretches of a strip, and pictures of what hides it."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import fringeforce as ff
from fringeforce.base.errors import FringeforceError, InputError
from fringeforce.cli import app
from fringeforce.cli.arguments import stated_mask

HAIR = slice(1000, 1050)


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_stretches_and_pictures_add_up(sensor, place: Path) -> None:
    dirty = np.zeros(2048, np.uint8)
    dirty[7] = 255
    np.save("dirty.npy", dirty)
    mask = stated_mask(["-1 to -0.5 mm", "dirty.npy", "100 to 200 um"], sensor)
    at = 1e3 * sensor.pixel_positions
    wanted = ((at >= -1) & (at <= -0.5)) | ((at >= 0.1) & (at <= 0.2))
    wanted[7] = True
    assert (mask == wanted).all()
    assert stated_mask(None, sensor) is None


def test_a_mask_of_a_pad_holds_for_all_its_channels(place: Path) -> None:
    pad = ff.load_sensor("pad")
    dirty = np.zeros(pad.frame_shape[-2:], np.uint8)
    dirty[3, 5] = 1
    np.save("dirty.npy", dirty)
    mask = stated_mask(["dirty.npy"], pad)
    assert mask.shape == pad.frame_shape
    assert (np.argwhere(mask)[:, -2:] == (3, 5)).all()
    with pytest.raises(InputError, match="stretch of a strip"):
        stated_mask(["-1 to 1 mm"], pad)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0.5 to -0.5 mm", r"holds no pixel.*-12\.5 to 12\.5 mm"),
        ("-8 to 1 N", "-8 N"),
        ("three to 5 mm", "three mm"),
        ("-0.5 mm", "no file -0.5 mm"),
        ("short.npy", "5 pixels; a frame of this sensor has 2048"),
    ],
)
def test_what_is_no_mask_is_refused(sensor, place: Path, text: str, said: str) -> None:
    np.save("short.npy", np.zeros(5, np.uint8))
    with pytest.raises(FringeforceError, match=said):
        stated_mask([text], sensor)


def test_frames_under_a_hair_are_read_without_it(model, place: Path) -> None:
    frames = model.expose([ff.polar(0.8, angle=10, n=11)] * 3, rng=1)
    frames[:, HAIR] = 20
    np.save("hairy.npy", frames)
    model.save("m.h5")
    np.save("one.npy", frames[:1])
    refused = CliRunner().invoke(app, ["read", "m.h5", "one.npy", "-o", "r.csv"])
    assert refused.exit_code == 1
    assert "dirt, a hair, or light from elsewhere" in refused.output
    for command in (
        ["read", "m.h5", "hairy.npy", "-o", "r.csv"],
        ["live", "m.h5", "--camera", "file:hairy.npy"],
    ):
        read = CliRunner().invoke(app, [*command, "--mask", "-0.8 to 0.8 mm"])
        assert read.exit_code == 0, read.output
        assert "3 OK" in read.output
