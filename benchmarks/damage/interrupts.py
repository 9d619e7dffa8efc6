"""Commands that are interrupted as by Ctrl-C, at moments all over their run."""

from __future__ import annotations

import shutil
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

import fringeforce as ff
from damage.commands import COMMAND, EXAMPLES, bench
from damage.counting import Case
from fringeforce.io.tables import save_forces

ENDS = 130, -signal.SIGINT, 0
"""Of a command, of a Python that was ending, and of what was done at that moment."""
PATIENCE = 20
"""Seconds within which an interrupted command has to end."""


def interrupts(model: ff.SensorModel, folder: Path, tries: int) -> Iterator[Case]:
    """Each command is interrupted at some moments: status 130, no traceback, nothing half."""
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
    }
    before = {path.name for path in where.iterdir()}
    for number in range(tries):
        for name, arguments in commands.items():
            delay = 0.2 + 9.0 * (number + 0.5) / tries

            def attempt(arguments: list[str] = arguments, delay: float = delay) -> None:
                interrupt(arguments, where, delay)
                left = {path.name for path in where.iterdir()} - before
                # what is finished is kept: sweeps and data sets go on there
                hidden = [one for one in left if one.startswith(".")]
                assert not hidden, f"left {hidden}"
                for one in left:
                    usable(where / one)

            yield f"{name} after {delay:.1f} s", attempt


def interrupt(arguments: list[str], folder: Path, delay: float) -> None:
    """Run a command, press Ctrl-C after some seconds, and look at how it ends."""
    limits = "--preserve-status", "--signal=INT", f"--kill-after={PATIENCE}", str(delay)
    run = subprocess.run(
        ["timeout", *limits, *COMMAND, *arguments], cwd=folder, capture_output=True, text=True
    )
    assert "Traceback" not in run.stderr, run.stderr[-400:]
    assert run.returncode in ENDS, f"status {run.returncode}: {run.stderr[-200:]}"


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
