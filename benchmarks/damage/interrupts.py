"""Commands that are interrupted, at moments all over their run.

As by Ctrl-C in a terminal and by a system that shuts down, which reach all processes of a command,
and as by a polite `kill`, which reaches the first.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np

import fringeforce as ff
from damage.commands import COMMAND, EXAMPLES, bench
from damage.counting import Case
from fringeforce.io.frames import save_frames
from fringeforce.io.tables import save_forces

WAYS = (
    ("Ctrl-C", signal.SIGINT, os.killpg),
    ("SIGTERM", signal.SIGTERM, os.kill),
    ("SIGTERM to all", signal.SIGTERM, os.killpg),
)
"""Signals, and whether all processes of a command get them."""
PATIENCE = 20
"""Seconds within which an interrupted command, and each process that it began, has to end."""


def interrupts(model: ff.SensorModel, folder: Path, tries: int) -> Iterator[Case]:
    """Each command is interrupted at some moments: its status, one line, nothing half or left."""
    where = folder / "interrupted"
    loads = bench(where, model, 8)
    many = model.expose(np.tile(loads, (3000, 1, 1)), rng=0)
    np.save(where / "many.npy", many)
    study = (EXAMPLES / "dataset/fingers.toml").read_text(encoding="utf-8")
    (where / "fingers.toml").write_text(study.replace("= 96", "= 9600"), encoding="utf-8")
    shots = np.random.default_rng(0).integers(0, 256, (1500, 40, 2200), dtype=np.uint8)
    np.save(where / "many-shots.npy", shots)
    corners = "--corners", "5,5 2194,5 2194,35 5,35"
    save_forces(where / "many.csv", np.tile(loads, (3000, 1, 1)))
    held = np.zeros((60, 11, 2))
    held[5:40, ::2, 0] = 1.0
    save_forces(where / "held.csv", held)
    relaxing = ff.characterize(model.sensor.replace(**{"transducer.relaxation": [(0.06, 0.4)]}))
    when = np.arange(60) / 10
    creeping = relaxing.expose(held, rng=0, times=when)
    save_frames(where / "held.h5", creeping, relaxing.pixel_positions, times=when)
    sweep = str(EXAMPLES / "studies/thin-or-soft.toml")
    commands = {
        "characterize": ["characterize", "wide-pad", "-o", "new.h5"],
        "calibrate": [
            *("calibrate", "saad", "--frames", "frames.h5", "--loads", "loads.csv"),
            *("-o", "new.h5"),
        ],
        "plan": ["plan", "saad", "--presses", "40", "-o", "new.csv"],
        "study": ["study", "resolution", "saad", "--out", "new"],
        "optimise": ["optimise", sweep, "-o", "new.h5"],
        "extract": [*("extract", "saad", "many-shots.npy", "-o", "new.h5"), *corners],
        "live": ["live", "model.h5", "--camera", "sim", "--for", "600", "--record", "new.h5"],
        "simulate": ["simulate", "model.h5", "many.csv", "-o", "new.h5"],
        "check": ["check", "model.h5", "frames.h5", "loads.csv"],
        "read": ["read", "model.h5", "many.npy", "-o", "new.csv"],
        "sweep": ["sweep", sweep, "-o", "new.h5"],
        "dataset": ["dataset", "fingers.toml", "-o", "new"],
        "update": ["update", "model.h5", "frames.h5", "-o", "new.h5"],
        "creep": ["creep", "model.h5", "held.h5", "held.csv", "-o", "new.h5"],
        "explore": ["explore", "--no-browser"],
        "explore a pad": ["explore", "pad", "--no-browser"],
    }
    before = {path.name for path in where.iterdir()}
    for number in range(tries):
        for turn, (name, arguments) in enumerate(commands.items()):
            delay = 0.2 + 9.0 * (number + 0.5) / tries
            words, signalled, send = WAYS[(number + turn) % len(WAYS)]

            def attempt(
                arguments: list[str] = arguments,
                delay: float = delay,
                signalled: signal.Signals = signalled,
                send: Callable[[int, int], None] = send,
            ) -> None:
                interrupt(arguments, where, delay, signalled, send)
                left = {path.name for path in where.iterdir()} - before
                # what is finished is kept: sweeps and data sets go on there
                hidden = [one for one in left if one.startswith(".")]
                assert not hidden, f"left {hidden}"
                for one in left:
                    usable(where / one)

            yield f"{name}, {words} after {delay:.1f} s", attempt


def interrupt(
    arguments: list[str],
    folder: Path,
    delay: float,
    signalled: signal.Signals,
    send: Callable[[int, int], None],
) -> None:
    """Run a command, interrupt it after some seconds, and look at how it ends."""
    # of the folder, so that what is left of temporary files is seen
    scratch = folder / "temporary"
    scratch.mkdir()
    run = subprocess.Popen(
        [*COMMAND, *arguments],
        cwd=folder,
        env={**os.environ, "TMPDIR": str(scratch)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        try:
            run.wait(delay)
        except subprocess.TimeoutExpired:
            send(run.pid, signalled)
        _, said = run.communicate(timeout=PATIENCE)
        assert "Traceback" not in said, said[-400:]
        ends = (128 + signalled, -signalled, 0)  # one line, Python not yet ours, done by then
        assert run.returncode in ends, f"status {run.returncode}: {said[-200:]}"
        if run.returncode == ends[0]:
            last = said.strip().splitlines()[-1:]
            assert last == [f"fringeforce: interrupted by {signalled.name}."], said[-200:]
        assert ended(run.pid), "processes are left"
        names = [path.name for path in scratch.iterdir()]
        assert run.returncode == -signalled or not names, f"temporary files are left: {names}"
    finally:
        with suppress(ProcessLookupError):
            os.killpg(run.pid, signal.SIGKILL)
        run.wait()
        shutil.rmtree(scratch)


def ended(group: int) -> bool:
    """Whether all processes of a group end soon."""
    for _ in range(10 * PATIENCE):
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


def usable(path: Path) -> None:
    """Raise unless a file can be read, or a folder be gone on with; then remove it."""
    if path.is_dir():
        assert not list(path.glob(".part-*")), f"left {list(path.glob('.part-*'))}"
        shutil.rmtree(path)
        return
    if path.suffix == ".h5":
        with h5py.File(path) as file:
            assert list(file)
    path.unlink()
