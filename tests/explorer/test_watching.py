"""A running sensor as a page hears of it."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from local_server import unwarmed
from pressed_camera import BLOCK, SHARE, simulated
from starlette.testclient import TestClient

import fringeforce as ff
from fringeforce.acquisition.cameras.camera import Camera, Settings
from fringeforce.acquisition.cameras.choice import open_camera
from fringeforce.acquisition.cameras.simulator import SimulatedCamera
from fringeforce.base.errors import CameraLost
from fringeforce.explorer.live import Source
from fringeforce.explorer.protocol import decoded, encoded
from fringeforce.explorer.server import application
from fringeforce.explorer.session import FirstDesign

pytestmark = pytest.mark.slow

TOKEN = "t" * 32
HOST = "http://127.0.0.1:8000"
SOCKET = f"ws://127.0.0.1:8000/{TOKEN}/socket"
Message = tuple[dict[str, Any], dict[str, np.ndarray]]
Look = Callable[..., Message]


@contextmanager
def served(sensor: ff.Sensor, source: Source | None) -> Iterator[TestClient]:
    app = application(FirstDesign(sensor), TOKEN, camera=source)
    with unwarmed(), TestClient(app, base_url=HOST) as client:
        yield client


@contextmanager
def page(client: TestClient) -> Iterator[Look]:
    """A page that asks for what is new and gets it."""
    with client.websocket_connect(SOCKET, headers={"Origin": HOST}) as socket:
        assert decoded(socket.receive_bytes())[0]["type"] == "hello"
        count = 0

        def look(**more: object) -> Message:
            nonlocal count
            count += 1
            socket.send_bytes(encoded({"type": "live", "id": count, **more}))
            answer = decoded(socket.receive_bytes())
            assert answer[0].get("id") == count or answer[0]["type"] == "refused"
            return answer

        yield look


def seen(look: Look, enough: Callable[[Message], bool], **more: object) -> list[Message]:
    """Messages with numbers up to the first that is enough."""
    found = []
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        message = look(**more)
        if message[1]:
            found.append(message)
        if enough(message):
            return found
    raise AssertionError("what was waited for did not come within a minute")


@pytest.fixture(scope="module")
def simulator(sensor: ff.Sensor) -> Iterator[TestClient]:
    with served(sensor, Source(simulated)) as client:
        yield client


def test_a_page_sees_the_simulated_camera_as_it_is(
    simulator: TestClient, model: ff.SensorModel
) -> None:
    camera = simulated(model)
    with page(simulator) as look:
        messages = seen(look, lambda m: m[0].get("time", 0) > 2.2)
    assert len(messages) > 20
    for header, blocks in messages:
        number = header["line"]
        np.testing.assert_array_equal(blocks["frame"], camera.lines[number % len(camera.lines)])
        phase = model.phase(blocks["forces"].astype(float))
        np.testing.assert_allclose(blocks["phase"], phase, atol=1e-5)
        if header["status"] == "OK":
            truth = camera.true_forces(np.array([number]))[0]
            assert (np.abs(blocks["forces"] - truth) < 6 * blocks["std"]).all()
    times = [header["time"] for header, _ in messages]
    lines = [header["line"] for header, _ in messages]
    np.testing.assert_allclose(np.diff(lines), np.diff(times) * 1000, atol=1e-3)
    assert messages[-1][0]["status"] == "OK"


def test_touch_and_slip_follow_the_friction_that_the_page_assumes(simulator: TestClient) -> None:
    everywhere = list(range(11))
    with page(simulator) as look:
        for friction, slipping in ((0.5 * SHARE, everywhere), (3 * SHARE, [])):
            messages = seen(look, lambda m: m[0].get("status") == "OK", friction=friction)
            assert messages[-1][0]["touching"] == everywhere
            assert messages[-1][0]["slipping"] == slipping
        # from the end of one press to the end of the next
        for _ in range(2):
            seen(look, lambda m: m[0].get("status") == "OK", friction=1.0)
            messages = seen(look, lambda m: m[0].get("touching") == [], friction=1.0)
    events = [tuple(event) for header, _ in messages for event in header["events"]]
    assert {tactel for kind, tactel in events if kind == "release"} == set(everywhere)
    assert "slip" not in {kind for kind, _ in events}


@pytest.fixture(scope="module")
def recording(model: ff.SensorModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("live") / "touch.npy"
    np.save(path, simulated(model).lines[2600:3100])
    return path


def replayed(path: Path, model: ff.SensorModel) -> Camera:
    # slow enough that a busy machine drops no line
    return open_camera(f"file:{path}", model, Settings(200, None, BLOCK))


def test_a_recording_reads_as_the_reader_reads_it_and_says_when_it_has_ended(
    sensor: ff.Sensor, model: ff.SensorModel, recording: Path
) -> None:
    expected = ff.Reader(model).read_on(np.load(recording))
    with served(sensor, Source(partial(replayed, recording), True)) as client, page(client) as look:
        for run in (1, 2):
            first = look(again=run == 2)
            messages = [m for m in [first] if m[1]] + seen(look, lambda m: bool(m[0]["ended"]))
            assert messages[-1][0]["line"] == 499
            for header, blocks in messages:
                assert (header["run"], header["recorded"]) == (run, True)
                line = header["line"]
                np.testing.assert_allclose(blocks["forces"], expected.forces[line], atol=1e-6)
                np.testing.assert_allclose(blocks["std"], expected.std[line], rtol=1e-5)
                assert header["status"] == expected.status.tolist()[line].name
            header, blocks = look()
            assert header["ended"] == "The recording has ended."
            assert not blocks
            assert (header["lines"], header["dropped"]) == (500, 0)


def test_a_page_that_looks_away_stalls_nobody_and_then_sees_the_newest(
    simulator: TestClient,
) -> None:
    with page(simulator) as slow, page(simulator) as quick:
        newest = seen(slow, lambda m: bool(m[1]))[-1][0]["line"]
        for _ in range(12):
            newest = seen(quick, lambda m, last=newest: m[0]["line"] > last + 100)[-1][0]["line"]
        assert slow()[0]["line"] >= newest


def test_a_camera_rests_while_no_page_asks_and_is_there_for_the_next(
    sensor: ff.Sensor, monkeypatch: pytest.MonkeyPatch
) -> None:
    rest, cameras = "fringeforce.explorer.live.REST", list[Closing]()
    monkeypatch.setattr(rest, 600.0)  # however busy the machine is

    def opened(model: ff.SensorModel) -> Camera:
        cameras.append(Closing(model, Settings(1000, None, BLOCK)))
        return cameras[-1]

    with served(sensor, Source(opened)) as client, page(client) as look:
        first = seen(look, lambda m: bool(m[1]))[-1][0]
        monkeypatch.setattr(rest, 0.3)
        deadline = time.monotonic() + 60
        while not cameras[0].closed and time.monotonic() < deadline:
            time.sleep(0.05)
        assert cameras[0].closed
        monkeypatch.setattr(rest, 600.0)
        # what a page has not seen yet of the last run comes first
        again = seen(look, lambda m: bool(m[1]) and m[0]["run"] > first["run"])[-1][0]
    assert (first["run"], again["run"], len(cameras)) == (1, 2, 2)


class Closing(SimulatedCamera):
    closed = False

    def close(self) -> None:
        self.closed = True
        super().close()


class Unplugged(SimulatedCamera):
    def __enter__(self) -> "Unplugged":
        raise CameraLost("Nobody answers at this address.")


def test_a_camera_that_is_not_there_is_told_and_can_be_tried_again(sensor: ff.Sensor) -> None:
    tries: list[int] = []

    def opened(model: ff.SensorModel) -> Camera:
        tries.append(1)
        return Unplugged(model) if len(tries) == 1 else simulated(model)

    with served(sensor, Source(opened)) as client, page(client) as look:
        messages = seen(look, lambda m: bool(m[0]["ended"]))
        assert messages == []
        assert look()[0]["ended"] == "Nobody answers at this address."
        look(again=True)
        assert seen(look, lambda m: bool(m[1]))


def test_without_a_camera_there_is_nothing_to_watch(sensor: ff.Sensor) -> None:
    with served(sensor, None) as client, page(client) as look:
        header, _ = look()
        assert header["type"] == "refused"
        assert "--camera" in header["text"]


def test_a_file_that_is_missing_is_told(sensor: ff.Sensor, tmp_path: Path) -> None:
    source = Source(partial(replayed, tmp_path / "none.npy"), True)
    with served(sensor, source) as client, page(client) as look:
        seen(look, lambda m: "none.npy" in m[0]["ended"])
