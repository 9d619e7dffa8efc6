"""A pad read live: what the loop reads, counts and records, against the touch behind it."""

import csv
import threading
import time
from collections.abc import Iterator
from contextlib import chdir
from pathlib import Path

import h5py
import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner, Result

import fringeforce as ff
from fringeforce.acquisition import loop
from fringeforce.acquisition.cameras.camera import Block
from fringeforce.acquisition.cameras.simulator import SimulatedCamera
from fringeforce.acquisition.run_statistics import Statistics
from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.cli import app
from fringeforce.cli.display import full_scale, picture
from fringeforce.contacts.fingertip import PERIODS, fingertip_forces
from fringeforce.design.pad import Pad
from fringeforce.io.frames import load_frames, load_times
from fringeforce.io.tables import load_forces
from fringeforce.models.pad import PadModel

pytestmark = pytest.mark.slow

Array = np.ndarray


class Kept(Sink):
    """Keeps all that it is given."""

    name = "kept"

    def __init__(self) -> None:
        self.parts: list[Readings] = []

    def write(self, readings: Readings) -> None:
        self.parts.append(readings)

    def close(self) -> None:
        pass


@pytest.fixture(scope="module")
def small() -> PadModel:
    pad = ff.load_sensor("pad").replace(
        name="small",
        **{
            "transducer.length": "9 mm",
            "transducer.width": "9 mm",
            "tactels.count": [3, 3],
            "camera.pixels": [48, 48],
        },
    )
    return ff.characterize(pad)


@pytest.fixture(scope="module")
def saved(small: PadModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("live")
    small.save(folder / "m.h5")
    camera = SimulatedCamera(small)
    np.save(folder / "touch.npy", camera.lines[:30])
    return folder


def run(folder: Path, *arguments: str) -> Result:
    """A command, where its files are."""
    with chdir(folder):
        return CliRunner().invoke(app, arguments)


def test_a_simulated_touch_is_read_as_it_is(small: PadModel) -> None:
    camera, kept, stop = SimulatedCamera(small), Kept(), threading.Event()
    # later in the touch the finger is down
    camera._next = 30

    def report(statistics: Statistics, _: Readings | None) -> None:
        if statistics.lines >= 25:
            stop.set()

    reader = ff.Reader(small)
    found = ff.live(reader, camera, [kept], stop=stop, report=report, every=0.0)
    assert found.counted == "images"
    assert sum(map(len, kept.parts)) == found.lines >= 25
    for block in kept.parts:
        assert block.lines.shape == (1, 48, 48)
        truth = camera.true_forces(block.first + np.arange(len(block)))
        apart = np.abs(block.forces - truth) / block.std
        # nothing of this is silence: whatever is read is right, and said to be
        assert [status.name for status in block.status] == ["OK"]
        assert apart.max() < 6


def test_frames_that_come_are_read_as_a_stream_of_them_is(small: PadModel, saved: Path) -> None:
    images = np.load(saved / "touch.npy")
    kept = Kept()
    camera = ff.open_camera(f"file:{saved / 'touch.npy'}", small)
    assert ff.live(ff.Reader(small), camera, [kept]).lines == len(images)
    readings = list(ff.Reader(small).stream(images))
    for block, reading in zip(kept.parts, readings, strict=True):
        np.testing.assert_array_equal(block.forces[0], reading.forces)
        np.testing.assert_array_equal(block.std[0], reading.std)
        assert block.status[0] is reading.status


def test_a_pad_that_needs_a_start_is_refused_before_anything_is_read(small: PadModel) -> None:
    dark = PadModel(small.sensor.replace(**{"camera.kind": "ordinary"}), small.influence)
    with pytest.raises(ff.FringeforceError, match="polarisation camera"):
        ff.live(ff.Reader(dark), SimulatedCamera(dark), seconds=1)


def test_of_images_that_come_too_fast_the_newest_is_read_and_others_are_counted(
    small: PadModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, sent = loop.read_block, threading.Event()

    class Burst(SimulatedCamera):
        def __iter__(self) -> Iterator[Block]:
            for number in range(20):
                yield Block(self.lines[number : number + 1], np.array([time.time()]), 0, number)
            sent.set()

    def late(reader: ff.Reader, block: Block, *_: object) -> Readings:
        sent.wait(20)
        return whole(reader, block)

    monkeypatch.setattr(loop, "read_block", late)
    kept = Kept()
    found = ff.live(ff.Reader(small), Burst(small), [kept])
    # one that the reader held, if it was quick enough, and the last
    assert 1 <= found.lines <= 2
    assert found.lines + found.dropped_queue == 20
    assert kept.parts[-1].first == 19
    assert f"{found.dropped_queue} images came faster" in found.troubles[0]


def test_a_finger_on_a_pad_is_smooth_and_obeys_friction(small: PadModel) -> None:
    t = np.linspace(0, PERIODS[2], 6001)
    places = ff.load_sensor("pad").tactels.places
    forces = fingertip_forces(t, places, force=5.0, friction=0.3)
    np.testing.assert_allclose(forces[[0, -1]], 0, atol=1e-12)
    normal, shear = forces[:, :, 0], np.hypot(*np.moveaxis(forces[:, :, 1:], 2, 0))
    assert normal.sum(axis=1).max() == pytest.approx(5.0)
    assert (shear <= 0.3 * normal + 1e-12).all()
    assert np.abs(np.diff(forces, axis=0)).max() < 0.02
    # rolls across, then slides along
    start, rolled, slid = (normal[i] @ places / normal[i].sum() for i in (1000, 2300, 4000))
    assert rolled[1] - start[1] > 3e-3 > abs(rolled[0] - start[0])
    assert slid[0] - rolled[0] > 5e-3 > abs(slid[1] - rolled[1])


def test_a_loop_of_large_images_stays_small(small: PadModel) -> None:
    large = PadModel(small.sensor.replace(**{"camera.pixels": [1024, 1024]}), small.influence)
    camera = SimulatedCamera(large, period=0.5)
    assert len(camera.lines) == 8
    # neighbours are equal instead
    assert camera.true_forces(np.arange(10)).shape == (10, 9, 3)


def test_the_command_reads_records_and_reads_again(saved: Path) -> None:
    first = run(
        saved, "live", "m.h5", "--camera", "file:touch.npy", "--frame-rate", "15",
        "--record", "r.h5", "--to", "csv:r.csv",
    )  # fmt: skip
    assert first.exception is None
    count = int(first.stdout.split()[0])
    assert first.stdout.startswith(f"{count} images in")
    assert f"CSV r.csv: {count} images" in first.stdout
    with h5py.File(saved / "r.h5") as file:
        shown = np.asarray(file["frame"])
    images, times = load_frames(saved / "r.h5", 2), load_times(saved / "r.h5")
    assert times is not None
    assert len(images) == count > 5
    np.testing.assert_allclose(15 * np.diff(times), np.diff(shown), atol=1e-3)
    np.testing.assert_array_equal(images, np.load(saved / "touch.npy")[shown])
    assert run(saved, "read", "m.h5", "r.h5", "-o", "again.csv").exception is None
    live, again = _rows(saved / "r.csv"), _rows(saved / "again.csv")
    assert set(again[0]) < set(live[0])
    assert [row["status"] for row in live] == [row["status"] for row in again]
    forces = load_forces(saved / "r.csv", 9, Pad.components)[shown]
    np.testing.assert_allclose(forces, load_forces(saved / "again.csv", 9, Pad.components))


def test_a_recording_plays_at_the_speed_of_its_images(saved: Path, small: PadModel) -> None:
    sink = ff.open_sink(f"record:{saved / 'slow.h5'}", small)
    images = np.load(saved / "touch.npy")[:4]
    forces = np.zeros((4, 9, 3))
    times, statuses = 1.7e9 + 0.05 * np.arange(4), (ff.Status.OK,) * 4
    sink.write(Readings(0, times, forces, forces, np.ones(4), statuses, images))
    sink.close()
    with ff.open_camera(f"file:{saved / 'slow.h5'}", small) as camera:
        blocks = list(camera)
    assert not camera.patient
    np.testing.assert_array_equal(np.concatenate([block.lines for block in blocks]), images)
    assert [len(block.lines) for block in blocks] == [1, 1, 1, 1]
    played = np.concatenate([block.timestamps for block in blocks])
    np.testing.assert_allclose(np.diff(played), 0.05, atol=1e-6)


def _rows(path: Path) -> list[dict[str, str]]:
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--friction", "0.5"), "friction"),
        (("--tolerance", "camera.shift"), "has no '='"),
        (("--camera", "file:missing.npy"), "missing.npy"),
        (("--camera", "periscope"), "There is no camera"),
        (("--block", "0"), "block = 0"),
    ],
)
def test_what_a_pad_is_not_read_with_is_refused(
    saved: Path, arguments: tuple[str, str], words: str
) -> None:
    result = run(saved, "live", "m.h5", *arguments)
    assert isinstance(result.exception, ff.FringeforceError)
    assert words in str(result.exception)


def test_several_pictures_are_no_live_camera_s(small: PadModel) -> None:
    two = [{"arrangement": "analyser", "angle": angle} for angle in (0.0, 45.0)]
    pad = small.sensor.replace(**{"camera.kind": "ordinary", "polariscope.channels": two})
    with pytest.raises(ff.FringeforceError, match="one picture at a time"):
        ff.open_camera("aravis:", PadModel(pad, small.influence))


def _readings(pad: Pad, forces: Array, status: ff.Status = ff.Status.OK) -> Readings:
    std = np.full_like(forces, 0.01)
    blank = np.zeros((1, 4, 4))
    return Readings(0, np.zeros(1), forces[None], std[None], np.ones(1), (status,), blank)


def _text(pad: Pad, readings: Readings) -> list[str]:
    statistics = Statistics(1, 19.6, {}, 1, 0, 3, {"OK": 1}, 0, "", (), "images")
    console = Console(width=80, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    console.print(picture(pad, "cam", statistics, readings, full_scale(readings)))
    console.file.close()
    return console.export_text().splitlines()


@pytest.mark.parametrize("count", [[11, 11], [60, 40]])
def test_a_map_fits_the_screen_and_is_darkest_where_the_pad_is_pressed(count: list[int]) -> None:
    pad = ff.load_sensor("pad").replace(tactels={"count": count, "pitch": "0.3 mm"})
    forces = np.zeros((pad.tactels.total, 3))
    # the corner of largest x and smallest y, which is to the right and below
    forces[(count[0] - 1) * count[1]] = 2.0, 0.5, 0.0
    lines = _text(pad, _readings(pad, forces))
    rows = [line for line in lines if line.startswith("··")]
    assert len(rows) == min(count[1], 14 if count[1] == 40 else 11)
    (pressed,) = [row for row in rows if "██" in row]
    assert pressed == rows[-1]
    assert pressed.split()[0].endswith("██")
    assert max(map(len, lines)) <= 80
    text = " ".join(lines)
    x, y = 1e3 * pad.tactels.places[(count[0] - 1) * count[1]]
    for words in ("+2.000 N", "+0.500 N, +0.000 N", f"{x:+.2f} mm, {y:+.2f} mm", "19.6 images/s"):
        assert words in text


def test_a_bad_image_has_no_numbers() -> None:
    pad = ff.load_sensor("pad")
    text = "\n".join(_text(pad, _readings(pad, np.full((121, 3), np.nan), ff.Status.BAD_FRAME)))
    assert "nan" not in text
    assert "BAD_FRAME: The frame cannot be used" in text
