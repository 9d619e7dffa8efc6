"""The explorer in a process of its own, for browsers."""

import multiprocessing
import shutil
import socket
from contextlib import AbstractContextManager, nullcontext
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from unittest.mock import patch

from fringeforce.base.child_process import end_with_parent
from fringeforce.design.files import load_sensor
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.explorer.live import Source
from fringeforce.explorer.server import serve
from fringeforce.explorer.session import FirstDesign
from fringeforce.explorer.workers import Workers

TOKEN = "token-of-the-tests"
BROWSERS = "chromium-headless-shell", "chromium", "chromium-browser"
CHROMIUM = next(filter(None, map(shutil.which, BROWSERS)), None)
"""The first needs a third less of the processor than the others, which have windows as well."""
FLAGS = [
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update",
    "--renderer-process-limit=1",
]  # fmt: skip


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def _serve(
    port: int, ready: Connection, sensor: Sensor | Pad, camera: Source | None, warmed: bool
) -> None:
    end_with_parent()
    with nullcontext() if warmed else unwarmed():
        serve(FirstDesign(sensor), TOKEN, "127.0.0.1", port, ready.send, camera)


class LocalServer:
    """The explorer in a process of its own, which can be killed and started again.

    Not warmed, it loads libraries when somebody asks for what needs them.
    """

    def __init__(
        self,
        camera: Source | None = None,
        sensor: Sensor | Pad | None = None,
        warmed: bool = True,
    ) -> None:
        self.camera, self.warmed = camera, warmed
        self.sensor = sensor or load_sensor("saad")
        self.port = free_port()
        self.address = f"http://127.0.0.1:{self.port}/{TOKEN}/"
        self.process: BaseProcess | None = None

    def start(self) -> None:
        context = multiprocessing.get_context("spawn")
        told, tell = context.Pipe(duplex=False)
        self.process = context.Process(
            target=_serve, args=(self.port, tell, self.sensor, self.camera, self.warmed)
        )
        self.process.start()
        assert told.poll(60), "the server did not start"
        assert told.recv() == self.address

    def stop(self) -> None:
        if self.process is not None:
            self.process.terminate()
            self.process.join(20)


async def _at_rest(*_: object) -> None:
    """Load nothing."""


def unwarmed() -> AbstractContextManager[object]:
    """Servers in this process whose other processes load no libraries that nobody asks for."""
    return patch.object(Workers, "warm", _at_rest)
