"""A full disk, two writers of one file, nowhere to keep loops: one clear error, or none at all."""

import os
import re
import resource
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

import fringeforce as ff
from fringeforce.base import loop_cache
from fringeforce.base.storage import new_file, whole_file
from fringeforce.io.frames import load_frames

FULL = """
import sys, fringeforce as ff
from fringeforce.models.strip import SensorModel
model = ff.load_model("whole.h5")
try:
    model.save("new.h5")
except ff.FringeforceError as error:
    print(error)
"""


LIVE = """
import resource, sys
from fringeforce.cli import main
for size, name in ((3_000_000, "new.h5"), (1_000_000, "none.h5"), (5_000, "small.h5")):
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    print("begins", name, file=sys.stderr)
    sys.argv[1:] = ["live", "whole.h5", "--camera", "file:frames.npy", "--record", name]
    try:
        main()
    except SystemExit as end:
        print(name, "ended with", end.code or 0)
"""


def full_disk(code: str, folder: Path, size: int | None = None) -> subprocess.CompletedProcess[str]:
    """Python code where no file may exceed a size [bytes], its own if none is given."""

    def bound() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        if size is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        capture_output=True,
        text=True,
        preexec_fn=bound,
        check=False,
    )


def test_a_full_disk_ends_in_one_message(model: ff.SensorModel, tmp_path: Path) -> None:
    model.save(tmp_path / "whole.h5")
    run = full_disk(FULL, tmp_path, 20_000)
    assert run.stdout == "new.h5 cannot be written: File too large.\n"
    assert run.stderr == ""
    assert [path.name for path in tmp_path.iterdir()] == ["whole.h5"]


@pytest.mark.slow
def test_a_recording_keeps_what_a_disk_took_until_it_was_full(
    model: ff.SensorModel, tmp_path: Path
) -> None:
    model.save(tmp_path / "whole.h5")
    frames = model.expose(np.tile(ff.polar(1.0, 10.0, 11), (2000, 1, 1)), rng=0)
    np.save(tmp_path / "frames.npy", frames)
    run = full_disk(LIVE, tmp_path)
    assert run.returncode == 0, run.stderr[-300:]
    assert re.findall(r"(\S+) ended with (\d)", run.stdout) == [
        ("new.h5", "0"), ("none.h5", "0"), ("small.h5", "2"),
    ]  # fmt: skip
    kept = load_frames(tmp_path / "new.h5")
    assert f"recording new.h5 stopped after {len(kept)} lines" in run.stdout
    np.testing.assert_array_equal(kept, frames[: len(kept)])
    assert 0 < len(kept) < len(frames)
    # with room for the description alone
    assert "recording none.h5 stopped after 0 lines" in run.stdout
    assert len(load_frames(tmp_path / "none.h5")) == 0
    _, _, said = run.stderr.partition("begins small.h5\n")
    assert said == "fringeforce: small.h5 cannot be written: File too large.\n"
    assert not (tmp_path / "small.h5").exists()


def test_a_file_that_another_made_meanwhile_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "one.h5"
    with new_file(path, "study", sealed=False, keep=True) as mine:
        mine["x"] = [1]
        with new_file(path, "study", sealed=False, keep=True) as theirs:
            theirs["x"] = [2]
    with h5py.File(path) as file:
        assert file["x"][0] == 2
    with whole_file(tmp_path / "plain") as place:
        place.write_text("new", encoding="utf-8")
    assert [one.name for one in sorted(tmp_path.iterdir())] == ["one.h5", "plain"]


def test_loops_have_a_folder_where_nothing_else_can_be_written(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv(loop_cache.VARIABLE, "")
    assert loop_cache.keep_loops() is None  # the package can be written here
    monkeypatch.setattr(loop_cache, "PACKAGE", tmp_path / "missing")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert loop_cache.keep_loops() is None
    monkeypatch.setenv("XDG_CACHE_HOME", os.devnull)
    config = sys.modules["numba"].config if "numba" in sys.modules else None
    if config is not None:
        monkeypatch.setattr(config, "CACHE_DIR", config.CACHE_DIR)
    folder = loop_cache.keep_loops()
    assert folder is not None
    assert os.environ[loop_cache.VARIABLE] == folder
    assert loop_cache.keep_loops() is None  # it has that one now
    loop_cache._remove(folder, os.getpid() + 1)
    assert Path(folder).is_dir()
    loop_cache._remove(folder, os.getpid())
    assert not Path(folder).exists()
