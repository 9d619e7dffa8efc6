"""Pictures of a video device, for which a video stands here, to the lines of a strip."""

from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest

import fringeforce as ff
from fringeforce.acquisition.cameras import webcam
from fringeforce.acquisition.cameras.camera import Settings
from fringeforce.base.errors import CameraLost, InputError

SIZE = 640, 96
REGION = ff.Region([(20, 30), (619, 30), (619, 69), (20, 69)], size=SIZE)
RATE = 25


@pytest.fixture(scope="module")
def slim(sensor: ff.Sensor) -> ff.SensorModel:
    """A strip that 600 columns of a picture show."""
    camera = {"pixels": 300, "noise": 2.0}
    return ff.characterize(
        sensor.replace(**{f"camera.{key}": value for key, value in camera.items()})
    )


@pytest.fixture(scope="module")
def loads() -> np.ndarray:
    return np.array([ff.polar(size, 5.0, 11) for size in (0.3, 0.5, 0.7)])


@pytest.fixture(scope="module")
def film(slim: ff.SensorModel, loads: np.ndarray, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The strip drawn out to two columns a pixel, in red, without loss."""
    path = tmp_path_factory.mktemp("film") / "film.mkv"
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream("ffv1", rate=RATE)
        stream.width, stream.height, stream.pix_fmt = *SIZE, "bgr0"
        for line in slim.expose(loads, rng=0):
            picture = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
            picture[30:70, 20:620, 0] = np.repeat(line, 2)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, "rgb24")))
        container.mux(stream.encode())
    return path


@pytest.fixture
def plugged(film: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """A device that plays the film, and what it was asked for."""
    asked: dict[str, Any] = {}
    real = av.open

    def opened(source: str, **wanted: Any) -> Any:
        asked.update(source=source, **wanted)
        return real(str(film))

    monkeypatch.setattr(av, "open", opened)
    monkeypatch.setattr(webcam.sys, "platform", "linux")
    return asked


@pytest.mark.parametrize("name", ["webcam:2", "opencv:2"])
def test_pictures_become_lines_and_forces(
    plugged: dict[str, Any], slim: ff.SensorModel, loads: np.ndarray, name: str
) -> None:
    blur = ff.Sampler(REGION, 300).spread * slim.sensor.transducer.length / 300
    seen = ff.characterize(slim.sensor.replace(**{"camera.blur": blur}))
    with ff.open_camera(name, seen, Settings(line_rate=RATE), REGION) as camera:
        blocks = [block for _, block in zip(loads, camera, strict=False)]
    assert plugged["source"] == "/dev/video2"
    assert plugged["format"] == "v4l2"
    assert plugged["options"] == {"video_size": "640x96", "framerate": "25"}
    assert [block.first for block in blocks] == [0, 1, 2]
    assert all(block.lines.shape == (1, 300) for block in blocks)
    reader = ff.Reader(seen)
    for block, load in zip(blocks, loads, strict=True):
        reading = reader.read(block.lines[0])
        off = (reading.forces - load).ravel()
        assert off @ np.linalg.solve(reading.covariance, off) < 60  # chi-square, 22, 2e-5
    assert np.diff([block.timestamps[0] for block in blocks]).min() >= 0


@pytest.mark.usefixtures("plugged")
def test_a_device_that_ends_is_lost(slim: ff.SensorModel) -> None:
    camera = ff.open_camera("webcam:", slim, None, REGION)
    with pytest.raises(CameraLost, match="sends no more pictures"), camera:
        list(camera)


def test_a_device_that_is_not_there_is_said_to_be_missing(slim: ff.SensorModel) -> None:
    camera = ff.open_camera("webcam:/dev/no-such-device", slim, None, REGION)
    with pytest.raises(CameraLost, match=r"no-such-device, pictures of 640x96.*plugged in"):
        camera.__enter__()


def test_pictures_need_a_region_and_lines_need_none(slim: ff.SensorModel) -> None:
    with pytest.raises(InputError, match="fringeforce extract"):
        ff.open_camera("webcam:0", slim)
    with pytest.raises(InputError, match="sim delivers what the sensor shows"):
        ff.open_camera("sim", slim, None, REGION)
