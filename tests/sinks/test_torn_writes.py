"""A kill may end each write of a recorder between two pages of memory: all such files are read."""

import io
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest

import fringeforce as ff
from conftest import make_readings
from fringeforce.acquisition.sinks import hdf5
from fringeforce.base.storage import existing_file
from fringeforce.io.frames import KINDS, load_frames, load_times
from fringeforce.io.row_checksums import read_rows

pytestmark = pytest.mark.slow

PAGE = 4096
"""Bytes that the system copies before it looks for a signal that ends the process."""


class _Disk(io.BytesIO):
    """A file that remembers what was written to it, and when rows were acknowledged."""

    def __init__(self) -> None:
        super().__init__()
        self.acknowledged = 0
        self.writes: list[tuple[int, int, bytes]] = []

    def write(self, data) -> int:
        self.writes.append((self.acknowledged, self.tell(), bytes(data)))
        return super().write(data)

    def after_kills(self, path: Path) -> Iterator[int]:
        """Rows acknowledged, with the file as it is, at ends of every write between two pages.

        Of a long write at its first and its last such ends.
        """
        with open(path, "wb", buffering=0) as file:
            for acknowledged, start, data in self.writes:
                ends = [*range(PAGE - start % PAGE, len(data), PAGE), len(data)]
                for end in ends if len(ends) < 6 else [*ends[:3], *ends[-2:]]:
                    file.seek(start)
                    file.write(data[:end])
                    yield acknowledged


@pytest.mark.parametrize(
    ("room", "sizes"),
    [
        # as shipped: rows join others in their chunks, and chunks begin
        (None, [1, 8, 3, 40, 5, 600, 2]),
        # a chunk for every other row or so: the index of chunks grows in all its parts
        (4096, [3] * 60),
    ],
)
def test_what_was_acknowledged_is_read_wherever_a_write_ended(
    model: ff.SensorModel,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    room: int | None,
    sizes: list[int],
) -> None:
    disk, opened = _Disk(), h5py.File
    if room:
        monkeypatch.setattr(hdf5, "CHUNK_BYTES", room)
        monkeypatch.setattr(hdf5, "FRAME_CHUNK_BYTES", room)
    with monkeypatch.context() as patch:
        patch.setattr(h5py, "File", lambda _, mode, **given: opened(disk, mode, **given))
        sink = ff.open_sink(f"record:{tmp_path / 'none.h5'}", model)
    for size in sizes:
        sink.write(make_readings(disk.acknowledged, size))
        disk.acknowledged += size
    sink.close()
    expected = make_readings(0, disk.acknowledged)
    path, states, latest = tmp_path / "killed.h5", 0, 0
    for acknowledged in disk.after_kills(path):
        if not acknowledged:
            continue
        # what `load_frames` and `load_times` do, with the file opened once
        with existing_file(path, *KINDS) as recording:
            assert "y" not in recording
            found = read_rows(recording, "grey", path), read_rows(recording, "time", path)
            for name in ("forces", "std", "chi2"):
                np.testing.assert_array_equal(
                    recording[name][:acknowledged], getattr(expected, name)[:acknowledged]
                )
        if acknowledged > latest:
            times, latest = load_times(path), acknowledged
            assert times is not None
            np.testing.assert_array_equal(times, found[1])
            np.testing.assert_array_equal(load_frames(path), found[0])
        for rows, wanted in zip(found, (expected.lines, expected.timestamps), strict=True):
            np.testing.assert_array_equal(rows[:acknowledged], wanted[:acknowledged])
        states += 1
    # for each block the rows of nine columns and more are written, and then their lengths
    assert states >= 18 * len(sizes)
