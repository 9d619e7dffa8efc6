"""Machines in trouble: full disks, taken ports, kills, nothing writable, no network."""

from __future__ import annotations

import os
import resource
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np

import fringeforce as ff
from damage.commands import COMMAND, EXAMPLES, bench
from damage.counting import Case
from fringeforce.io.frames import load_frames

SOURCES = Path(ff.__file__).parents[1]
SMALL = 5_000
"""Size that no file may exceed on a full disk [bytes]."""
LIMIT = 300


def _run(
    arguments: Sequence[str], folder: Path, size: int | None = None
) -> subprocess.CompletedProcess[str]:
    def bound() -> None:
        if size is not None:
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return subprocess.run(
        [*COMMAND, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=LIMIT,
        preexec_fn=bound,
        check=False,
    )


def _clear(run: subprocess.CompletedProcess[str]) -> None:
    """Raise the error of a command as a clear one, or say what is not clear."""
    assert "Traceback" not in run.stderr, run.stderr[-300:]
    assert "Usage:" not in run.stderr, f"the benchmark calls it wrongly: {run.stderr[-200:]}"
    assert run.returncode == 2, f"status {run.returncode}: {run.stderr[-200:]}"
    raise ff.FringeforceError(run.stderr)


def machines(model: ff.SensorModel, folder: Path) -> Iterator[Case]:
    """Each kind of trouble."""
    where = folder / "machines"
    bench(where, model, 16)
    yield from _full_disk(where)
    yield from _no_space(where)
    yield "a recording of live under kill -9", lambda: _killed(where)
    yield "two servers on one port", lambda: _one_port(where)
    yield "two live servers on one port", lambda: _one_live_port(where)
    yield "two sweeps into one file", lambda: _two_sweeps(where)
    yield "a sweep after its study changed", lambda: _changed_study(where)
    yield "nothing writable, no network", lambda: _sealed(where)
    yield "a home folder that cannot be written", lambda: _read_only_home(where)


def _full_disk(where: Path) -> Iterator[Case]:
    study = (EXAMPLES / "dataset/fingers.toml").read_text(encoding="utf-8")
    (where / "fingers.toml").write_text(study.replace("shard = 48", "shard = 96"), encoding="utf-8")
    frames = "--frames", "frames.h5", "--loads", "loads.csv", "--no-plot"
    commands = {
        "characterize": ["characterize", "saad", "-o", "new.h5"],
        "simulate": ["simulate", "model.h5", "loads.csv", "-o", "new.h5"],
        "read": ["read", "model.h5", "frames.h5", "-o", "new.csv"],
        "calibrate": ["calibrate", "saad", *frames, "-o", "new.h5"],
        "dataset": ["dataset", "fingers.toml", "-o", "new"],
        "plan": ["plan", "saad", "--presses", "200", "-o", "new.csv"],
        "study": ["study", "resolution", "saad", "--out", "new"],
        "sweep": ["sweep", str(EXAMPLES / "studies/thin-or-soft.toml"), "-o", "new.h5"],
        "live": ["live", "model.h5", "--camera", "sim", "--for", "2", "--record", "new.h5"],
        "live to CSV": ["live", "model.h5", "--camera", "sim", "--for", "2", "--to", "csv:new.csv"],
    }
    before = {path.name for path in where.iterdir()}
    for name, arguments in commands.items():

        def attempt(name: str = name, arguments: list[str] = arguments) -> None:
            try:
                run = _run(arguments, where, SMALL)
                if "live" in name:  # which goes on without what it cannot write
                    assert run.returncode in (0, 2), f"status {run.returncode}"
                    assert "Traceback" not in run.stderr, run.stderr[-300:]
                    assert "File too large" in run.stdout + run.stderr, "nothing is said of it"
                    raise ff.FringeforceError(run.stdout)
                _clear(run)
            finally:
                left = {path.name for path in where.iterdir()} - before
                for one in left:
                    place = where / one
                    shutil.rmtree(place) if place.is_dir() else place.unlink()
            assert not left - ({"new", "new.h5", "new.csv"} if "live" in name else {"new"}), left

        yield f"full disk: {name}", attempt


def _no_space(where: Path) -> Iterator[Case]:
    """A file system of its own that has some kilobytes, as of a memory card."""
    small = where / "small"
    small.mkdir()
    commands = {
        "characterize": "characterize saad -o small/new.h5",
        "read": "read model.h5 frames.h5 -o small/new.csv",
        "live": "live model.h5 --camera sim --for 2 --record small/new.h5",
        "sweep": f"sweep {EXAMPLES / 'studies/thin-or-soft.toml'} -o small/new.h5",
    }
    for name, words in commands.items():

        def attempt(words: str = words) -> None:
            command = " ".join(map(shlex.quote, [*COMMAND, *words.split()]))
            mount = "mount -t tmpfs -o size=4k none small"
            look = "status=$?; echo left: $(ls -A small) >&2; exit $status"
            run = subprocess.run(
                ["unshare", "-r", "-m", "bash", "-c", f"{mount} && {command}; {look}"],
                cwd=where,
                capture_output=True,
                text=True,
                timeout=LIMIT,
                check=False,
            )
            assert "No space left on device" in run.stderr, run.stderr[-300:]
            assert run.stderr.endswith("left:\n"), run.stderr[-100:]
            _clear(run)

        yield f"no space left: {name}", attempt


def _killed(where: Path) -> None:
    path = where / "killed.h5"
    arguments = ["live", "model.h5", "--camera", "sim", "--record", path.name]
    run = subprocess.Popen([*COMMAND, *arguments], cwd=where, stdout=subprocess.DEVNULL)
    try:
        for _ in range(200):
            time.sleep(0.1)
            if path.exists() and path.stat().st_size > 300_000:
                break
    finally:
        run.kill()
        run.wait()
    frames = load_frames(path)
    assert len(frames) > 10, f"only {len(frames)} frames"
    assert frames.any(axis=1).all(), "frames that nobody took"
    read = _run(["read", "model.h5", path.name, "-o", "killed.csv"], where)
    assert read.returncode == 0, read.stderr[-300:]


def _one_port(where: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        _clear(_run(["explore", "--no-browser", "--port", str(taken.getsockname()[1])], where))


def _one_live_port(where: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        target = f"ws://127.0.0.1:{taken.getsockname()[1]}"
        _clear(_run(["live", "model.h5", "--camera", "sim", "--for", "2", "--to", target], where))


PATIENCE = 120
"""Seconds for a sweep to begin, on a machine that is busy with other programs."""


def _study(where: Path, load: float) -> str:
    text = (EXAMPLES / "studies/thin-or-soft.toml").read_text(encoding="utf-8")
    lines = [
        f"working_load = {load}" if line.startswith("working_load") else line
        for line in text.splitlines()
    ]
    place = where / f"study-{load}.toml"
    place.write_text("\n".join(lines), encoding="utf-8")
    return place.name


def _two_sweeps(where: Path) -> None:
    """Whoever comes second is refused, and what the first one found is in the file."""
    arguments = [*COMMAND, "sweep", _study(where, 2.0), "-o", "two.h5"]
    runs = [
        subprocess.Popen(
            arguments, cwd=where, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        for _ in range(2)
    ]
    said, ended = "", []
    try:
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            time.sleep(0.1)
            ended = [run for run in runs if run.poll() is not None]
            if ended:
                said = ended[0].communicate()[1]
                break
        assert len(ended) == 1, "both go on"
        time.sleep(20)  # the other has found something by then
    finally:
        for run in runs:
            with suppress(ProcessLookupError):
                run.send_signal(signal.SIGINT)
        for run in runs:
            run.communicate(timeout=30)
    assert "Traceback" not in said, said[-300:]
    with h5py.File(where / "two.h5") as file:
        assert np.any(file["state"][()]), "nothing of the first sweep is kept"
    raise ff.FringeforceError(said)


def _changed_study(where: Path) -> None:
    run = subprocess.Popen(
        [*COMMAND, "sweep", _study(where, 2.0), "-o", "old.h5"],
        cwd=where,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    deadline = time.monotonic() + PATIENCE
    while not (where / "old.h5").exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    time.sleep(2)  # some designs are known
    run.send_signal(signal.SIGINT)
    run.wait()
    before = (where / "old.h5").read_bytes()
    try:
        _clear(_run(["sweep", _study(where, 3.0), "-o", "old.h5"], where))
    finally:
        assert (where / "old.h5").read_bytes() == before, "the old results were touched"


def _sealed(where: Path) -> None:
    """The package and the home folder cannot be written, and there is no network at all."""
    script = where / "sealed.py"
    script.write_text(
        "import numpy as np, fringeforce as ff\n"
        "from fringeforce.models.splines import _spread\n"
        "import fringeforce.reading.reader\n"
        "model = ff.load_model('model.h5')\n"
        "assert np.isfinite(model.phase(ff.polar(1.0, 10, n=11))).all()\n"
        "print('well')\n",
        encoding="utf-8",
    )
    command = (
        f"mount --bind {SOURCES} {SOURCES} && mount -o remount,bind,ro {SOURCES} && "
        f"! touch {SOURCES}/x 2>/dev/null && exec {sys.executable} {script}"
    )
    run = subprocess.run(
        ["unshare", "-r", "-m", "-n", "bash", "-c", command],
        cwd=where,
        env={**os.environ, "HOME": "/proc/nowhere"},
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
    )
    assert run.stdout == "well\n", run.stderr[-300:]


def _read_only_home(where: Path) -> None:
    """Commands that draw and compute, where the home folder takes no file."""
    home = where / "home"
    home.mkdir()
    arguments = "read", "model.h5", "frames.h5", "-o", "home.csv", "--plot"
    command = " ".join(map(shlex.quote, [*COMMAND, *arguments]))
    run = subprocess.run(
        [
            *("unshare", "-r", "-m", "-n", "bash", "-c"),
            f"mount --bind {home} {home} && mount -o remount,bind,ro {home} && exec {command}",
        ],
        cwd=where,
        env={name: value for name, value in os.environ.items() if not name.startswith("XDG")}
        | {"HOME": str(home)},
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
    )
    assert run.returncode == 0, run.stderr[-300:]
    for word in ("Traceback", "Error", "not a writable"):
        assert word not in run.stderr, run.stderr[-300:]
