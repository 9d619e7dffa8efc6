"""A file plays as a camera: every line, in order, when it was recorded."""

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from PIL import Image

import fringeforce as ff
from fringeforce.acquisition.cameras.camera import Block, Settings
from fringeforce.acquisition.cameras.replay import ReplayCamera
from fringeforce.io import frames as files

LINES = np.random.default_rng(0).integers(0, 256, (10, 2048), dtype=np.uint8)


def _played(camera: ReplayCamera) -> list[Block]:
    with camera:
        return list(camera)


@pytest.mark.parametrize("ending", [".h5", ".npy", ".png", ".tiff"])
def test_every_kind_of_file_plays_in_order(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"frames{ending}"
    if ending == ".h5":
        files.save_frames(path, LINES, np.arange(2048.0))
    elif ending == ".npy":
        np.save(path, LINES)
    elif ending == ".png":
        Image.fromarray(LINES).save(path)
    else:
        tifffile.imwrite(path, LINES)
    blocks = _played(ReplayCamera(path, Settings(block=4)))
    assert [(block.first, len(block.lines), block.dropped) for block in blocks] == [
        (0, 4, 0), (4, 4, 0), (8, 2, 0),
    ]  # fmt: skip
    np.testing.assert_array_equal(np.concatenate([block.lines for block in blocks]), LINES)


def test_lines_come_at_the_rate_that_is_asked_for(tmp_path: Path) -> None:
    np.save(tmp_path / "f.npy", LINES)
    camera = ReplayCamera(tmp_path / "f.npy", Settings(line_rate=100, block=3))
    assert not camera.patient
    with camera:
        arrivals = [(block, time.time()) for block in camera]
    times = np.concatenate([block.timestamps for block, _ in arrivals])
    np.testing.assert_allclose(np.diff(times), 0.01, atol=1e-6)
    # no block comes before its last line was exposed
    assert all(arrival >= block.timestamps[-1] for block, arrival in arrivals)


def test_a_file_without_times_waits_for_its_reader(tmp_path: Path) -> None:
    np.save(tmp_path / "f.npy", LINES)
    assert ReplayCamera(tmp_path / "f.npy").patient


def test_a_camera_that_was_left_goes_on_where_it_was(tmp_path: Path) -> None:
    np.save(tmp_path / "f.npy", LINES)
    camera = ReplayCamera(tmp_path / "f.npy", Settings(line_rate=1e4, block=4))
    with camera:
        assert next(iter(camera)).first == 0
    assert [block.first for block in _played(camera)] == [4, 8]


def test_closing_ends_a_camera_that_waits_for_its_next_line(tmp_path: Path) -> None:
    np.save(tmp_path / "f.npy", LINES)
    camera = ReplayCamera(tmp_path / "f.npy", Settings(line_rate=0.001, block=4))
    with camera:
        blocks = iter(camera)
        camera.close()
        assert list(blocks) == []


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"line_rate": 0.0}, "line_rate = 0"),
        ({"exposure": -1.0}, "exposure = -1"),
        ({"block": 0}, "block = 0"),
        ({"line_rate": 1000.0, "exposure": 0.002}, "at most 0.001 s"),
    ],
)
def test_settings_that_no_camera_can_follow_are_refused(
    settings: dict[str, Any], words: str
) -> None:
    with pytest.raises(ff.FringeforceError, match=words):
        Settings(**settings)


@pytest.mark.parametrize("name", ["usb", "file:", "sim2", ""])
def test_an_unknown_camera_is_refused_with_those_there_are(
    model: ff.SensorModel, name: str
) -> None:
    with pytest.raises(ff.FringeforceError, match="sim, file:PATH"):
        ff.open_camera(name, model)
