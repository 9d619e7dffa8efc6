"""The live loop: nothing is lost that is not counted, and no part stalls another."""

import threading
import time
import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scripted import Full, Notes, Scripted, Silent, Stuck

import fringeforce as ff
from fringeforce.acquisition import loop
from fringeforce.acquisition.cameras.camera import Block, Settings
from fringeforce.acquisition.cameras.simulator import SimulatedCamera
from fringeforce.acquisition.run_statistics import Statistics
from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.base.errors import CameraLost

pytestmark = pytest.mark.slow


@pytest.fixture
def reader(model: ff.SensorModel) -> ff.Reader:
    return ff.Reader(model)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reading in no time, for tests of everything around it."""
    monkeypatch.setattr(loop, "read_block", _nothing_read)


def _nothing_read(reader: ff.Reader, block: Block, *_: object) -> Readings:
    k = len(block.lines)
    forces = np.zeros((k, 11, 2))
    status = (ff.Status.OK,) * k
    return Readings(
        block.first, block.timestamps, forces, forces, np.ones(k), status, block.lines
    )  # fmt: skip


def test_a_file_is_read_whole_and_as_the_reader_reads_it(
    model: ff.SensorModel, reader: ff.Reader, tmp_path: Path
) -> None:
    forces = np.multiply.outer(np.linspace(0, 1, 6), ff.polar(1.0, 10, n=11))
    frames = model.expose(forces, rng=0)
    np.save(tmp_path / "f.npy", frames)
    camera = ff.open_camera(f"file:{tmp_path / 'f.npy'}", model, Settings(block=4))
    found: list[Readings] = []
    sink = Notes()
    sink.write = found.append  # pyrefly: ignore[bad-assignment]
    statistics = ff.live(reader, camera, [sink])
    assert statistics.lines == 6
    assert sum(statistics.statuses.values()) == 6
    got = np.concatenate([one.forces for one in found])
    std = np.concatenate([one.std for one in found])
    expected = [reader.read(frame) for frame in frames]
    # a reader may use the last reading, so equal within a small part of the deviations
    np.testing.assert_allclose(got, [one.forces for one in expected], atol=0.05 * std.max())
    assert [one.name for block in found for one in block.status] == [
        one.status.name for one in expected
    ]


@pytest.mark.usefixtures("quick")
def test_a_patient_camera_loses_nothing_to_a_slow_sink(reader: ff.Reader) -> None:
    sink = Stuck()
    threading.Timer(0.5, sink.go.set).start()
    found = ff.live(reader, Scripted([4] * 50, patient=True), [sink], queue=3)
    assert found.lines == 200
    assert sink.lines == list(range(200))
    assert found.troubles == ()


def test_a_slow_reader_drops_whole_blocks_and_counts_them(
    reader: ff.Reader, model: ff.SensorModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    def slow(reader: ff.Reader, block: Block, *_: object) -> Readings:
        time.sleep(0.02)
        return _nothing_read(reader, block)

    monkeypatch.setattr(loop, "read_block", slow)
    camera = SimulatedCamera(model, Settings(line_rate=5000, block=10), period=0.1)
    sink = Notes()
    found = ff.live(reader, camera, [sink], seconds=1, queue=4)
    assert found.dropped_queue > 0
    assert found.dropped_queue % 10 == 0
    assert any("came faster" in trouble for trouble in found.troubles)
    assert sink.lines == sorted(sink.lines)
    assert len(sink.lines) == found.lines
    # read and dropped are all that the camera numbered
    with camera:
        ahead = next(iter(camera))
    assert found.lines + found.dropped_queue + found.dropped_camera == ahead.first - ahead.dropped


def test_what_a_slow_reader_reads_comes_in_runs_of_whole_queues(
    reader: ff.Reader, monkeypatch: pytest.MonkeyPatch
) -> None:
    held, ended = threading.Event(), threading.Event()
    firsts: list[int] = []

    def slow(reader: ff.Reader, block: Block, *_: object) -> Readings:
        firsts.append(block.first)
        held.set()
        assert ended.wait(60)
        return _nothing_read(reader, block)

    class Fast(Scripted):
        """Sends all but its first block while the reader holds that one."""

        def __iter__(self) -> Iterator[Block]:
            blocks = super().__iter__()
            yield next(blocks)
            assert held.wait(60)
            yield from blocks
            ended.set()

    monkeypatch.setattr(loop, "read_block", slow)
    # the queue of eight fills five times, and drops what it held four times
    found = ff.live(reader, Fast([10] * 41), queue=8)
    assert (found.lines, found.dropped_queue) == (90, 320)
    assert firsts == [0, *range(330, 410, 10)]


def test_a_sink_that_gathers_gets_all_lines_in_order_and_in_fewer_pieces(
    reader: ff.Reader, quick: None
) -> None:
    sizes: list[int] = []

    class Gathering(Notes):
        interval = 0.05

        def write(self, readings: Readings) -> None:
            sizes.append(len(readings))
            assert len(readings.status) == len(readings.lines) == len(readings)
            super().write(readings)

    sink = Gathering()
    found = ff.live(reader, Scripted([4] * 100, patient=True), [sink], queue=16)
    assert sink.lines == list(range(found.lines))
    assert len(sizes) < 60


@pytest.mark.usefixtures("quick")
def test_a_sink_that_hangs_stalls_neither_reading_nor_other_sinks(reader: ff.Reader) -> None:
    stuck, notes = Stuck(), Notes()

    class InStep(Scripted):
        """Sends a block when the last one was read and written by the sink that works."""

        def __iter__(self) -> Iterator[Block]:
            for block in super().__iter__():
                yield block
                deadline = time.monotonic() + 60
                while len(notes.lines) < self.sent:
                    assert time.monotonic() < deadline
                    time.sleep(0.001)
            stuck.go.set()

    found = ff.live(reader, InStep([10] * 50), [stuck, notes], queue=8)
    assert found.dropped_queue == 0
    assert notes.lines == list(range(500))
    hung, worked = found.deliveries
    # eight blocks waited, and one was being written
    assert (hung.written, hung.dropped) == (90, 410)
    assert (worked.written, worked.dropped) == (500, 0)
    assert any("stuck was too slow" in trouble for trouble in found.troubles)


@pytest.mark.usefixtures("quick")
def test_a_full_disk_ends_that_recording_only(reader: ff.Reader) -> None:
    full, notes = Full(), Notes()
    # a queue so short that no two blocks are read together
    found = ff.live(reader, Scripted([4] * 10, patient=True), [full, notes], queue=8)
    assert notes.lines == list(range(40))
    assert full.lines == list(range(4))
    assert full.closed == notes.closed == 1
    assert [(one.written, one.dropped) for one in found.deliveries] == [(4, 36), (40, 0)]
    assert found.troubles == (
        "full stopped after 4 lines: The disk is full. What was written before is kept.",
    )


@pytest.mark.usefixtures("quick")
def test_a_vanished_camera_is_looked_for_at_growing_intervals(reader: ff.Reader) -> None:
    gone = CameraLost("It is gone.")
    camera = Scripted([4, gone, gone, gone, 4])
    found = ff.live(reader, camera)
    assert found.lines == 8
    assert found.reconnects == 1
    assert found.camera_trouble == ""
    pauses = np.diff(camera.entered)
    assert len(pauses) == 3
    assert (np.diff(pauses) > 0).all()


@pytest.mark.usefixtures("quick")
def test_a_camera_that_never_answers_is_an_error_and_sinks_are_closed(reader: ff.Reader) -> None:
    sink = Notes()
    with pytest.raises(CameraLost, match="nobody there"):
        ff.live(reader, Scripted([CameraLost("nobody there")]), [sink])
    assert sink.closed == 1


@pytest.mark.usefixtures("quick")
def test_whatever_breaks_a_camera_reaches_the_caller(reader: ff.Reader) -> None:
    camera = Scripted([4])
    camera.script.append("nonsense")  # pyrefly: ignore[bad-argument-type]
    with pytest.raises(TypeError):
        ff.live(reader, camera)


@pytest.mark.usefixtures("quick")
def test_statistics_agree_with_what_happened(reader: ff.Reader, model: ff.SensorModel) -> None:
    camera = SimulatedCamera(model, Settings(line_rate=2000, block=20), period=0.1)
    stop, reports = threading.Event(), []

    def report(statistics: Statistics, readings: Readings | None) -> None:
        reports.append(statistics.lines)
        if statistics.lines >= 400:
            stop.set()

    found = ff.live(reader, camera, stop=stop, report=report, every=0.0)
    assert reports == sorted(reports)
    assert found.statuses == {"OK": found.lines}
    # the oldest line of a block waits for the others: no reading is younger than zero
    low, middle, high = (found.latency[q] for q in (50, 95, 99))
    assert 0 < low <= middle <= high
    assert high >= 19 / 2000


@pytest.mark.usefixtures("quick")
def test_memory_stays_flat_over_a_long_run(reader: ff.Reader) -> None:
    sizes: list[int] = []

    def report(statistics: Statistics, _: Readings | None) -> None:
        if statistics.lines > 4000 and not tracemalloc.is_tracing():
            tracemalloc.start()
        if tracemalloc.is_tracing():
            sizes.append(tracemalloc.get_traced_memory()[0])

    camera = Scripted([64] * 1000, patient=True)
    ff.live(reader, camera, [Silent()], report=report, every=0.0, queue=8)
    tracemalloc.stop()
    # two queues of 8 blocks and those in hand; all lines together would be 1,000 blocks
    assert len(sizes) > 100
    assert max(sizes) < 24 * 64 * 2048
