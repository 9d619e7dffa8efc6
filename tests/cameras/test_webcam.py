"""Pictures of a webcam to lines; a recorded video stands in for the device."""

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fringeforce as ff
from fringeforce.acquisition.cameras.camera import Camera, Settings
from fringeforce.acquisition.cameras.webcam import WebcamCamera
from fringeforce.base.errors import CameraLost, InputError

av = pytest.importorskip("av")
SIZE, COUNT = (320, 60), 6
REGION = ff.Region([(20, 10), (299, 10), (299, 49), (20, 49)], SIZE)


def _level(number: int, column: Any) -> Any:
    """What the device shows: a ramp that rises from picture to picture."""
    return 40 + 10 * number + column / 4


@pytest.fixture
def asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, dict[str, Any]]]:
    """What FFmpeg was asked to open; it opens a lossless video instead."""
    path, columns = tmp_path / "seen.mkv", np.arange(SIZE[0])
    with av.open(str(path), "w") as container:
        stream = container.add_stream("ffv1", rate=30)
        stream.width, stream.height, stream.pix_fmt = *SIZE, "gray"
        for number in range(COUNT):
            picture = np.tile(np.rint(_level(number, columns)).astype(np.uint8), (SIZE[1], 1))
            frame = av.VideoFrame.from_ndarray(picture, format="gray")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    seen: list[tuple[str, dict[str, Any]]] = []
    opened = av.open

    def stand_in(device: str, **how: Any) -> Any:
        seen.append((device, how))
        return opened(str(path))

    monkeypatch.setattr(av, "open", stand_in)
    return seen


@pytest.fixture
def small(model: ff.SensorModel) -> ff.SensorModel:
    return ff.characterize(model.sensor.replace(**{"camera.pixels": 200}))


def _blocks(camera: Camera) -> list[Any]:
    found = []
    with pytest.raises(CameraLost, match="no more pictures"), camera:
        found.extend(camera)
    return found


@pytest.mark.parametrize("name", ["webcam:2", "opencv:2", "webcam:/dev/video2"])
def test_lines_come_from_the_region_of_every_picture(
    asked: list[Any], small: ff.SensorModel, name: str
) -> None:
    before = time.time()
    camera = ff.open_camera(name, small, Settings(line_rate=30), REGION)
    blocks = _blocks(camera)
    assert [block.first for block in blocks] == list(range(COUNT))
    columns = 20 + 279 * (np.arange(200) + 0.5) / 200
    for number, block in enumerate(blocks):
        assert block.lines.shape == (1, 200)
        # the levels of the picture and of the line are whole numbers
        assert np.abs(block.lines[0] - _level(number, columns)).max() < 1.1
        assert before <= block.timestamps[0] <= time.time()
    device, how = asked[0]
    assert device == "/dev/video2"
    assert how["format"] == "v4l2"
    assert how["options"]["video_size"] == "320x60"
    assert how["options"]["framerate"] == "30"


def test_a_webcam_that_was_left_goes_on_counting(asked: list[Any], small: ff.SensorModel) -> None:
    camera = ff.open_camera("webcam:0", small, region=REGION)
    assert len(_blocks(camera)) == COUNT
    assert _blocks(camera)[0].first == COUNT
    assert len(asked) == 2


def test_closing_ends_a_webcam(asked: list[Any], small: ff.SensorModel) -> None:
    with ff.open_camera("webcam:0", small, region=REGION) as camera:
        blocks = iter(camera)
        next(blocks)
        camera.close()
        assert list(blocks) == []


def test_pictures_of_another_size_are_refused(asked: list[Any], small: ff.SensorModel) -> None:
    other = ff.Region(REGION.corners, (640, 480))
    with (
        pytest.raises(InputError, match="640 columns and 480 rows"),
        ff.open_camera("webcam:0", small, region=other) as camera,
    ):
        next(iter(camera))


def test_a_device_that_is_not_there_is_named(model: ff.SensorModel) -> None:
    camera = ff.open_camera("webcam:973", model, region=REGION)
    with pytest.raises(CameraLost, match=r"/dev/video973 does not open.*list-devices"):
        camera.__enter__()


def test_what_a_webcam_cannot_do_is_said(
    model: ff.SensorModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("webcam:0", "opencv:0"):
        with pytest.raises(InputError, match=r"a line of 2048 pixels.*--region"):
            ff.open_camera(name, model)
    with pytest.raises(InputError, match="exposure_time_absolute=20"):
        WebcamCamera("0", SIZE, Settings(exposure=2e-3))
    with pytest.raises(InputError, match="one by one"):
        WebcamCamera("0", SIZE, Settings(block=2))
    monkeypatch.setattr(sys, "platform", "darwin")
    with pytest.raises(InputError, match="file:PATH"):
        WebcamCamera("0", SIZE)
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(InputError, match=r"pip install '\.\[pictures\]'"):
        WebcamCamera("0", SIZE)
