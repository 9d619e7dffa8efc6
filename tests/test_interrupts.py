"""Ctrl-C ends a command with status 130, no traceback and no half-written file."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import fringeforce as ff
from fringeforce import cli

pytestmark = pytest.mark.slow
COMMAND = "import sys; from fringeforce.cli import main; sys.exit(main())"
SWEEP = Path(__file__).parents[1] / "examples/studies/thin-or-soft.toml"


def sweeping(folder: Path, **environment: str) -> subprocess.Popen[str]:
    """A sweep in a group of its own, whose processes have begun a while ago."""
    run = subprocess.Popen(
        [sys.executable, "-c", COMMAND, "sweep", str(SWEEP), "-o", "new.h5"],
        cwd=folder,
        env={**os.environ, **environment},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while not (folder / "new.h5").exists() and run.poll() is None:
        time.sleep(0.02)
    time.sleep(1.5)
    return run


def test_a_sweep_ends_with_its_processes(tmp_path: Path) -> None:
    run = sweeping(tmp_path)
    try:
        os.killpg(run.pid, signal.SIGINT)
        _, said = run.communicate(timeout=60.0)
    finally:
        run.kill()
        run.wait()
    assert run.returncode == 130
    assert "Traceback" not in said
    assert not list(tmp_path.glob(".*"))


def test_a_second_interrupt_neither_breaks_off_the_end_nor_waits(tmp_path: Path) -> None:
    run = sweeping(tmp_path)
    try:
        for _ in range(3):
            os.killpg(run.pid, signal.SIGINT)
            time.sleep(0.02)
        _, said = run.communicate(timeout=60.0)
    finally:
        run.kill()
        run.wait()
    assert run.returncode in (130, -signal.SIGINT)  # a shell calls both of them 130
    assert "Traceback" not in said
    assert not list(tmp_path.glob(".*"))


DESCENDING = """
from fringeforce.calibration.bench_search import BenchSearch
from fringeforce.cli import main

descend = BenchSearch.descend

def told(*given):
    print("descending", flush=True)
    return descend(*given)

BenchSearch.descend = told
main()
"""


def test_a_calibration_leaves_no_file(model: ff.SensorModel, tmp_path: Path) -> None:
    loads = np.random.default_rng(0).uniform(0.1, 1.5, (40, 11, 2)) * [1.0, 0.2]
    np.save(tmp_path / "frames.npy", model.expose(loads, rng=0))
    rows = (f"{k},{j + 1},{n},{t}" for k, one in enumerate(loads) for j, (n, t) in enumerate(one))
    header = "frame,tactel,normal_N,tangential_N"
    (tmp_path / "loads.csv").write_text("\n".join([header, *rows]), encoding="utf-8")
    before = {path.name for path in tmp_path.iterdir()}
    given = "--frames", "frames.npy", "--loads", "loads.csv", "-o", "new.h5"
    run = subprocess.Popen(
        [sys.executable, "-c", DESCENDING, "calibrate", "saad", *given],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert run.stdout is not None
    assert run.stdout.readline() == "descending\n"
    run.send_signal(signal.SIGINT)
    _, said = run.communicate(timeout=60.0)
    assert run.returncode == 130
    assert "Traceback" not in said
    assert {path.name for path in tmp_path.iterdir()} == before


def exploring(folder: Path, **environment: str) -> subprocess.Popen[str]:
    """A server in a group of its own, which has said where it is, with its processes."""
    run = subprocess.Popen(
        [sys.executable, "-c", COMMAND, "explore", "saad", "--no-browser"],
        cwd=folder,
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert run.stdout is not None
    assert "http://" in run.stdout.readline()
    return run


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs groups of processes")
@pytest.mark.parametrize("start", [sweeping, exploring])
def test_a_polite_kill_ends_a_command_as_an_interrupt_does(
    tmp_path: Path, start: Callable[..., subprocess.Popen[str]]
) -> None:
    scratch = tmp_path / "temporary"
    scratch.mkdir()
    run = start(tmp_path, TMPDIR=str(scratch))
    try:
        run.send_signal(signal.SIGTERM)
        _, said = run.communicate(timeout=60.0)
        assert "Traceback" not in said
        ended = start is exploring and run.returncode == 0  # its good end
        assert ended or run.returncode in (128 + signal.SIGTERM, -signal.SIGTERM)
        assert not list(scratch.iterdir()) or run.returncode < 0
        assert not list(tmp_path.glob(".*"))
        for _ in range(100):
            try:
                os.killpg(run.pid, 0)  # raises once no process of the command is left
            except ProcessLookupError:
                return
            time.sleep(0.1)
        pytest.fail("a process is left")
    finally:
        run.kill()
        run.wait()


LOST = """
import sys, time, weakref
from fringeforce import cli

class Gone:
    pass

def run(**_):
    one = Gone()
    kept = weakref.ref(one, lambda reference: time.sleep(2.0))
    print("ready", flush=True)
    del one  # an interrupt that comes in its callback raises nothing
    time.sleep(600.0)

cli.app = run
cli.main()
"""


def test_an_interrupt_in_a_callback_is_not_lost() -> None:
    run = subprocess.Popen(
        [sys.executable, "-c", LOST], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert run.stdout is not None
    assert run.stdout.readline() == "ready\n"
    time.sleep(0.5)
    run.send_signal(signal.SIGINT)
    _, said = run.communicate(timeout=60.0)
    assert run.returncode == 130
    assert said == "fringeforce: interrupted by SIGINT.\n"


HANDED_OVER = """
import signal, sys, threading
from typing import NamedTuple

import numba

from fringeforce import cli

class Inner(NamedTuple):
    value: float

class Outer(NamedTuple):
    inner: Inner

@numba.njit
def loop(value):
    return Outer(Inner(value))

def run(**_):
    main_thread = threading.main_thread().ident
    threading.Timer(0.01, signal.pthread_kill, (main_thread, signal.SIGINT)).start()
    while True:
        loop(1.0)

loop(1.0)
cli.app, cli.AGAIN_AFTER = run, 0.002
sys.setswitchinterval(0.0005)  # it comes again as often, in a fifth of the time
for _ in range(20):  # more than half of the time is spent on named tuples
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        cli.main()
    except SystemExit as end:
        assert end.code == 130
"""


def test_an_interrupt_while_a_loop_hands_over_its_results_does_not_crash() -> None:
    run = subprocess.run([sys.executable, "-c", HANDED_OVER], capture_output=True, text=True)
    assert run.returncode == 0
    assert run.stderr == 20 * "fringeforce: interrupted by SIGINT.\n"


def test_an_interrupted_loop_is_no_error_of_the_system(monkeypatch: pytest.MonkeyPatch) -> None:
    def loop(**_: object) -> None:
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    monkeypatch.setattr(cli, "app", loop)
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)
    before = signal.getsignal(signal.SIGINT)
    try:
        with pytest.raises(SystemExit) as ended:
            cli.main()
        assert ended.value.code == 130
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN  # nothing is left to end
    finally:
        signal.signal(signal.SIGINT, before)
