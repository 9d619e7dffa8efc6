"""Files of readings: other programs read them, and a crash loses nothing that was acknowledged."""

import csv
import errno
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

import fringeforce as ff
from conftest import make_readings
from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.base.storage import dataset
from fringeforce.base.unclosed_files import UnclosedFile
from fringeforce.io.frames import load_frames, load_times

pytestmark = pytest.mark.slow

GROWTH = 50
"""Blocks of twenty frames after which new parts of the index stand behind the first ones."""
RECORDER = str(Path(__file__).with_name("recorder.py"))


def _written(target: str, model: ff.SensorModel, blocks: list[Readings]) -> None:
    sink = ff.open_sink(target, model)
    for block in blocks:
        sink.write(block)
    sink.close()


def test_a_csv_holds_a_row_for_each_tactel(
    model: ff.SensorModel, blocks: list[Readings], whole: Readings, tmp_path: Path
) -> None:
    _written(f"csv:{tmp_path / 'r.csv'}", model, blocks)
    with open(tmp_path / "r.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 20 * 11
    for row, (line, tactel) in zip(rows, np.ndindex(20, 11), strict=True):
        assert (int(row["frame"]), int(row["tactel"])) == (line, tactel + 1)
        normal, tangential = whole.forces[line, tactel]
        assert float(row["normal_N"]) == pytest.approx(normal, rel=1e-5, nan_ok=True)
        assert float(row["tangential_N"]) == pytest.approx(tangential, rel=1e-5, nan_ok=True)
        size = np.hypot(normal, tangential)
        assert float(row["magnitude_N"]) == pytest.approx(size, rel=1e-5, nan_ok=True)
        assert float(row["time_s"]) == pytest.approx(whole.timestamps[line], abs=1e-6)
        assert row["status"] == whole.status[line].name


def test_xarray_opens_a_recording_with_labels(
    model: ff.SensorModel, blocks: list[Readings], whole: Readings, tmp_path: Path
) -> None:
    path = tmp_path / "r.h5"
    _written(f"record:{path}", model, blocks)
    with xarray.open_dataset(path, engine="h5netcdf") as dataset:
        assert dataset["forces"].dims == ("frame", "tactel", "component")
        assert dataset["grey"].dims == ("frame", "x")
        np.testing.assert_array_equal(dataset["frame"], np.arange(20))
        np.testing.assert_array_equal(dataset["forces"], whole.forces)
        np.testing.assert_array_equal(dataset["std"], whole.std)
        np.testing.assert_array_equal(dataset["grey"], whole.lines)
        meanings = dataset["status"].attrs["flag_meanings"].split()
        names = [meanings[code] for code in dataset["status"].values]
        assert names == [status.name for status in whole.status]
        seconds = dataset["time"].values.astype("datetime64[us]").astype(float) / 1e6
        np.testing.assert_allclose(seconds, whole.timestamps, atol=1e-5)


def test_a_recording_can_be_read_again(
    model: ff.SensorModel, blocks: list[Readings], whole: Readings, tmp_path: Path
) -> None:
    _written(f"record:{tmp_path / 'r.h5'}", model, blocks)
    np.testing.assert_array_equal(load_frames(tmp_path / "r.h5"), whole.lines)
    np.testing.assert_array_equal(load_times(tmp_path / "r.h5"), whole.timestamps)
    camera = ff.open_camera(f"file:{tmp_path / 'r.h5'}", model)
    with camera:
        (block,) = camera
    np.testing.assert_allclose(np.diff(block.timestamps), np.diff(whole.timestamps), atol=1e-6)


@pytest.mark.parametrize(("what", "load"), [("lines", load_frames), ("timestamps", load_times)])
def test_a_flipped_bit_in_a_recording_is_reported_with_its_frame(
    model: ff.SensorModel,
    blocks: list[Readings],
    whole: Readings,
    tmp_path: Path,
    what: str,
    load: Callable[[Path], np.ndarray],
) -> None:
    path = tmp_path / "r.h5"
    _written(f"record:{path}", model, blocks)
    row = getattr(whole, what)[7].astype(load(path).dtype).tobytes()
    content = path.read_bytes()
    place, rng = content.index(row), np.random.default_rng(21)
    for _ in range(20):
        damaged = bytearray(content)
        damaged[place + rng.integers(len(row))] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        with pytest.raises(ff.FringeforceError, match=r"r\.h5.* 1 of 20 frames.* number 7 "):
            load(path)


def test_recordings_of_earlier_versions_are_read(
    model: ff.SensorModel, blocks: list[Readings], whole: Readings, tmp_path: Path
) -> None:
    path, old = tmp_path / "r.h5", tmp_path / "old.h5"
    _written(f"record:{path}", model, blocks)
    # blocks of rows with HDF5's own checksum, and none of the rows
    with h5py.File(path) as file, h5py.File(old, "w", libver="latest") as earlier:
        earlier.attrs.update(file.attrs)
        for name in ("frame", "time", "forces", "std", "chi2", "status", "grey", "x"):
            values = dataset(file, name)[()]
            chunks = (8, *values.shape[1:])
            earlier.create_dataset(name, data=values, chunks=chunks, fletcher32=True)
    np.testing.assert_array_equal(load_frames(old), whole.lines)
    np.testing.assert_array_equal(load_times(old), whole.timestamps)


@pytest.mark.parametrize("closed", [True, False])
def test_a_recording_that_was_cut_before_the_end_of_its_frames_is_refused(
    model: ff.SensorModel, blocks: list[Readings], whole: Readings, tmp_path: Path, closed: bool
) -> None:
    path = tmp_path / "r.h5"
    sink = ff.open_sink(f"record:{path}", model)
    for block in blocks:
        sink.write(block)
    content = path.read_bytes()
    sink.close()
    content = path.read_bytes() if closed else content
    assert len(load_frames(path)) == 20
    last = np.asarray(whole.lines)[-1].tobytes()
    for length in np.linspace(0, content.index(last) + len(last) - 1, 40).astype(int):
        path.write_bytes(content[:length])
        with pytest.raises(ff.FringeforceError):  # the library itself may wait without end
            load_frames(path)


def test_a_recording_can_be_read_while_it_grows(
    model: ff.SensorModel, blocks: list[Readings], tmp_path: Path
) -> None:
    sink = ff.open_sink(f"record:{tmp_path / 'r.h5'}", model)
    for done, block in enumerate(blocks, start=1):
        sink.write(block)
        assert len(load_frames(tmp_path / "r.h5")) == 4 * done
    sink.close()


def test_a_recording_may_grow_between_its_opening_and_its_reading(
    model: ff.SensorModel, blocks: list[Readings], whole: Readings, tmp_path: Path
) -> None:
    path = tmp_path / "r.h5"
    sink = ff.open_sink(f"record:{path}", model)
    sink.write(blocks[0])
    # as another process opens it: the library shares what one process has opened
    with UnclosedFile(path) as content, h5py.File(content, "r") as file:
        for _ in range(GROWTH):
            sink.write(whole)
        np.testing.assert_array_equal(file["grey"][4:], np.tile(whole.lines, (GROWTH, 1)))
    sink.close()


@pytest.fixture(scope="module")
def saved(model: ff.SensorModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("model") / "m.h5"
    model.save(path)
    return path


@pytest.mark.parametrize("kind", ["record", "h5", "csv"])
@pytest.mark.parametrize("blocks_before", [1, 60])
def test_a_killed_recorder_loses_nothing_that_it_acknowledged(
    saved: Path, tmp_path: Path, kind: str, blocks_before: int
) -> None:
    path = tmp_path / "killed.h5"
    process = subprocess.Popen(
        [sys.executable, RECORDER, str(saved), f"{kind}:{path}"], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout
    for _ in range(blocks_before):
        process.stdout.readline()
    process.kill()
    said = process.communicate()[0].splitlines()
    acknowledged = int(said[-1]) if said and said[-1].isdigit() else 8 * blocks_before
    expected = make_readings(0, acknowledged)
    if kind == "csv":
        # the row that was being written may be cut
        rows = path.read_text().splitlines()[1 : 11 * acknowledged + 1]
        assert [int(row.split(",")[0]) for row in rows[::11]] == list(range(acknowledged))
        return
    with h5py.File(path, "r", swmr=True) as file:
        for name, values in (("forces", expected.forces), ("std", expected.std)):
            dataset = file[name]
            assert isinstance(dataset, h5py.Dataset)
            np.testing.assert_array_equal(dataset[:acknowledged], values)
    if kind == "record":
        np.testing.assert_array_equal(load_frames(path)[:acknowledged], expected.lines)


@pytest.mark.parametrize("kind", ["record", "h5", "csv"])
def test_a_full_disk_keeps_what_was_acknowledged(saved: Path, tmp_path: Path, kind: str) -> None:
    path = tmp_path / "full.h5"
    run = subprocess.run(
        [sys.executable, RECORDER, str(saved), f"{kind}:{path}", "3000000"],
        capture_output=True,
        text=True,
        check=False,
    )
    # here a file that may not grow stands for a disk without room
    assert f"OSError: [Errno {errno.EFBIG}]" in run.stderr
    acknowledged = int(run.stdout.split()[-1])
    if kind == "record":
        frames = load_frames(path)
        assert len(frames) >= acknowledged > 50
        np.testing.assert_array_equal(frames[:acknowledged, 0], np.arange(acknowledged) % 251)


def test_the_mcap_library_reads_every_line(
    model: ff.SensorModel, blocks: list[Readings], whole: Readings, tmp_path: Path
) -> None:
    _written(f"mcap:{tmp_path / 'r.mcap'}", model, blocks)
    with open(tmp_path / "r.mcap", "rb") as file:
        messages = [
            (channel.topic, message.log_time, json.loads(message.data))
            for _, channel, message in make_reader(file).iter_messages()
        ]
    assert [topic for topic, _, _ in messages] == ["/fringeforce/reading"] * 20
    assert [one["line"] for _, _, one in messages] == list(range(20))
    for (_, time, one), forces, stamp in zip(messages, whole.forces, whole.timestamps, strict=True):
        assert time == pytest.approx(stamp * 1e9, abs=1e3)
        got = np.array([one["normal"], one["tangential"]], dtype=float).T
        np.testing.assert_allclose(got, forces, atol=1e-6)
    assert messages[3][2]["normal"] == [None] * 11


def test_ros_tools_read_a_bag_and_find_the_resultant(
    model: ff.SensorModel, blocks: list[Readings], whole: Readings, tmp_path: Path
) -> None:
    _written(f"rosbag:{tmp_path / 'bag'}", model, blocks)
    found: dict[str, list] = {}
    with AnyReader([tmp_path / "bag"]) as reader:
        for connection, _, raw in reader.messages():
            found.setdefault(connection.topic, []).append(
                reader.deserialize(raw, connection.msgtype)
            )
    assert {topic: len(messages) for topic, messages in found.items()} == {
        "/fringeforce/wrench": 20, "/fringeforce/forces": 20, "/fringeforce/std": 20,
    }  # fmt: skip
    array, wrench = found["/fringeforce/forces"][7], found["/fringeforce/wrench"][7]
    assert [dimension.size for dimension in array.layout.dim] == [11, 2]
    np.testing.assert_array_equal(array.data.reshape(11, 2), whole.forces[7])
    normal, tangential = whole.forces[7].T
    assert wrench.wrench.force.z == pytest.approx(-normal.sum())
    assert wrench.wrench.force.x == pytest.approx(tangential.sum())
    # moment of forces (T, 0, -N) at (x, 0, 0), from the cross product
    places = np.zeros((11, 3))
    places[:, 0] = model.sensor.tactels.positions
    moment = np.cross(places, np.stack([tangential, 0 * normal, -normal], axis=1)).sum(axis=0)
    assert wrench.wrench.torque.y == pytest.approx(moment[1])
    stamp = wrench.header.stamp
    assert stamp.sec + stamp.nanosec / 1e9 == pytest.approx(whole.timestamps[7])


@pytest.mark.parametrize("target", ["csv", "h5", "record", "mcap", "rosbag"])
def test_a_place_that_cannot_be_written_is_named(
    model: ff.SensorModel, tmp_path: Path, target: str
) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ff.FringeforceError, match="cannot be written"):
        ff.open_sink(f"{target}:{tmp_path / 'file' / 'r'}", model)
