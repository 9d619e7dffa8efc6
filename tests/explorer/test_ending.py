"""When a server ends, for whatever reason, nothing of it stays."""

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from local_server import LocalServer
from small_pad import small_pad

from fringeforce.design.files import load_sensor
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor

PROCESSES = Path("/proc")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not PROCESSES.is_dir(), reason="looks for processes where Linux lists them"),
]
PATIENCE = 60.0
"""A process that was told to end does so at once, but a busy machine may be slow to let it [s]."""


def parents() -> dict[int, int]:
    """Parent of every process that runs; those that have ended and were not buried do not count."""
    found = {}
    for path in PROCESSES.glob("[0-9]*/stat"):
        try:
            state, parent = path.read_text().rpartition(")")[2].split()[:2]
        except OSError:  # it has ended meanwhile
            continue
        if state != "Z":
            found[int(path.parent.name)] = int(parent)
    return found


def children(process: int) -> set[int]:
    return {child for child, parent in parents().items() if parent == process}


def becomes(true: Callable[[], bool]) -> bool:
    deadline = time.monotonic() + PATIENCE
    while not true() and time.monotonic() < deadline:
        time.sleep(0.05)
    return true()


@pytest.mark.parametrize(
    ("sensor", "end"),
    [
        (load_sensor("saad"), signal.SIGKILL),
        (load_sensor("saad"), signal.SIGTERM),
        (load_sensor("saad"), signal.SIGINT),
        (small_pad(), signal.SIGKILL),
    ],
    ids=["strip killed", "strip ended", "strip interrupted", "pad killed"],
)
def test_workers_and_their_files_end_with_the_server(
    sensor: Sensor | Pad,
    end: signal.Signals,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    local = LocalServer(sensor=sensor)
    local.start()
    assert local.process is not None
    server = local.process.pid
    assert server is not None
    # workers that compute at this moment, for the server warms up
    workers = children(server)
    assert workers
    os.kill(server, end)
    assert becomes(lambda: not workers & parents().keys())
    local.process.join(PATIENCE)
    assert local.process.exitcode is not None
    assert becomes(lambda: not list(tmp_path.glob("fringeforce-*")))
