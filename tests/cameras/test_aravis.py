"""A real GigE Vision camera on loopback, from its packets to readings."""

import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from fake_camera import ADDRESS, FakeCamera

import fringeforce as ff
from fringeforce.acquisition.cameras import gobject
from fringeforce.acquisition.cameras.aravis import AravisCamera
from fringeforce.acquisition.cameras.camera import Camera, Settings
from fringeforce.acquisition.cameras.simulator import SimulatedCamera
from fringeforce.acquisition.run_statistics import Statistics
from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.base.errors import CameraLost, InputError

# one camera at a time has the address
pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("aravis")]

BLOCK = 64
SETTINGS = Settings(line_rate=2000, block=BLOCK)


@pytest.fixture(scope="module", autouse=True)
def _installed() -> None:
    try:
        gobject.aravis()
    except InputError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def shown(model: ff.SensorModel) -> np.ndarray:
    """A touch in 8 blocks, whose first pixels hold the number of the line."""
    lines = SimulatedCamera(model, Settings(line_rate=8 * BLOCK), period=1.0).lines.copy()
    lines[:, 0] = np.arange(len(lines)) % 256
    lines[:, 1] = np.arange(len(lines)) // 256
    return lines


@pytest.fixture
def fake(shown: np.ndarray, tmp_path: Path) -> Iterator[FakeCamera]:
    camera = FakeCamera(shown, tmp_path, BLOCK)
    yield camera
    camera.kill()


def test_blocks_arrive_as_they_were_shown(fake: FakeCamera, shown: np.ndarray) -> None:
    camera = AravisCamera(ADDRESS, 2048, settings=SETTINGS)
    with camera:
        assert camera.line_rate == pytest.approx(2000, rel=1e-3)
        blocks = [block for block, _ in zip(camera, range(20), strict=False)]
    seen = 0
    for block in blocks:
        seen += block.dropped
        assert block.first == seen
        number = int(block.lines[0, 0]) + 256 * int(block.lines[0, 1])
        np.testing.assert_array_equal(block.lines, shown[number : number + BLOCK])
        assert (np.diff(block.timestamps) > 0).all()
        seen += BLOCK
    assert blocks[-1].timestamps[-1] > blocks[0].timestamps[-1]


def _greeted(camera: Camera) -> None:
    """Connect once; a very busy machine may miss the first greetings."""
    for _ in range(5):
        with suppress(CameraLost), camera:
            return


def test_reading_goes_on_when_the_camera_was_gone(
    fake: FakeCamera, model: ff.SensorModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    # every 64th line is enough here
    from fringeforce.acquisition import loop
    from fringeforce.acquisition.cameras.camera import Block

    whole = loop.read_block

    def first_line(reader: ff.Reader, block: Block, *_: object) -> Readings:
        return whole(reader, Block(block.lines[:1], block.timestamps[:1], 0, block.first))

    monkeypatch.setattr(loop, "read_block", first_line)
    stop, before = threading.Event(), 0

    def watch(statistics: Statistics, readings: Readings | None) -> None:
        nonlocal before
        if statistics.reconnects == 0 and statistics.lines > 10 and not before:
            fake.kill()
            before = statistics.lines
        if statistics.camera_trouble and not watch_restarted:
            fake.start()
            watch_restarted.append(statistics.camera_trouble)
        if statistics.reconnects and readings is not None and readings.first > 2 * before * BLOCK:
            stop.set()

    watch_restarted: list[str] = []
    camera = ff.open_camera(f"aravis:{ADDRESS}", model, SETTINGS)
    _greeted(camera)
    found = ff.live(ff.Reader(model), camera, stop=stop, seconds=180, report=watch, every=0.05)
    assert stop.is_set()
    assert found.reconnects == 1
    assert "nothing for" in watch_restarted[0]
    assert found.camera_trouble == ""
    assert found.lines > before


def test_a_camera_that_was_never_there_is_said_to_be_missing(model: ff.SensorModel) -> None:
    camera = ff.open_camera("aravis:127.0.0.9", model)
    with pytest.raises(CameraLost, match="does not answer"):
        ff.live(ff.Reader(model), camera, seconds=5)


def test_a_size_that_the_camera_cannot_deliver_is_refused(fake: FakeCamera) -> None:
    camera = AravisCamera(ADDRESS, 4096, settings=SETTINGS)
    with pytest.raises(InputError, match="64 lines of 4096 pixels"):
        camera.__enter__()


def test_images_of_a_pad_arrive_as_they_were_shown(tmp_path: Path) -> None:
    images = np.random.default_rng(0).integers(0, 256, (8, 48, 64), dtype=np.uint8)
    images[:, 0, 0] = np.arange(8)
    fake = FakeCamera(images.reshape(-1, 64), tmp_path, 48)
    try:
        camera = AravisCamera(ADDRESS, (64, 48), settings=Settings(line_rate=50))
        with camera:
            assert camera.line_rate == pytest.approx(50, rel=1e-3)
            blocks = [block for block, _ in zip(camera, range(5), strict=False)]
    finally:
        fake.kill()
    seen = 0
    for block in blocks:
        seen += block.dropped
        assert block.first == seen
        (image,) = block.lines
        np.testing.assert_array_equal(image, images[image[0, 0]])
        seen += 1


def test_a_camera_delivers_images_one_by_one() -> None:
    with pytest.raises(InputError, match="one by one"):
        AravisCamera(ADDRESS, (64, 48), settings=Settings(block=2))


@pytest.mark.parametrize("mosaic", ["", "RGGB"])
def test_lines_come_from_the_region_of_an_area_camera(
    model: ff.SensorModel, tmp_path: Path, mosaic: str
) -> None:
    columns, steps = np.arange(128), np.arange(8)[:, None, None]
    pictures = np.broadcast_to(4 * steps + columns, (8, 48, 128)).astype(np.uint8)
    small = ff.characterize(model.sensor.replace(**{"camera.pixels": 40}))
    region = ff.Region([(10, 8), (109, 8), (109, 39), (10, 39)], (128, 48), mosaic=mosaic)
    fake = FakeCamera(np.ascontiguousarray(pictures).reshape(-1, 128), tmp_path, 48)
    try:
        with ff.open_camera(f"aravis:{ADDRESS}", small, Settings(line_rate=50), region) as camera:
            blocks = [block for block, _ in zip(camera, range(5), strict=False)]
    finally:
        fake.kill()
    places = 10 + 99 * (np.arange(40) + 0.5) / 40
    for block in blocks:
        (line,) = block.lines
        step = np.rint((line - places).mean() / 4)  # which of the eight pictures this is
        off = np.abs(line - places - 4 * step)
        assert off[1:-1].max() < 0.51  # levels are rounded
        assert off.max() < 1.01  # at the ends one column of a mosaic has no neighbour
    assert len({block.lines.tobytes() for block in blocks}) > 1
