"""Readings over the network: JSON that anyone parses, a token beyond this computer, no stalls."""

import json
import re
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
import zmq
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

import fringeforce as ff
from conftest import make_readings
from fringeforce.acquisition.sinks.foxglove import FoxgloveSink
from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.acquisition.sinks.websocket import WAITING, WebSocketSink
from fringeforce.acquisition.sinks.zeromq import ZmqSink


@pytest.fixture
def server() -> Iterator[WebSocketSink]:
    sink = WebSocketSink("ws://127.0.0.1:0")
    yield sink
    sink.close()


def _parsed(text: str | bytes) -> dict[str, Any]:
    def refuse(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    return json.loads(text, parse_constant=refuse)


def _until(condition: Any) -> None:
    deadline = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_a_client_gets_every_block_as_json(
    server: WebSocketSink, blocks: list[Readings], whole: Readings
) -> None:
    with connect(f"ws://127.0.0.1:{server.port}") as client:
        _until(lambda: server.remark.startswith("1 client"))
        for block in blocks:
            server.write(block)
        messages = [_parsed(client.recv(timeout=10)) for _ in blocks]
    forces = np.concatenate([np.array(one["forces"], dtype=float) for one in messages])
    np.testing.assert_allclose(forces, whole.forces, atol=1e-6)
    assert [one["first"] for one in messages] == [0, 4, 8, 12, 16]
    assert messages[0]["status"] == ["OK", "OK", "OK", "BAD_FRAME"]
    assert messages[0]["chi2"] == [1.0, 1.0, 1.0, None]


def test_a_client_that_does_not_listen_stalls_nobody_and_loses_the_oldest(
    server: WebSocketSink,
) -> None:
    count = 450
    url = f"ws://127.0.0.1:{server.port}"
    narrow = socket.socket()
    narrow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    narrow.connect(("127.0.0.1", server.port))
    with (
        connect(url, max_queue=1, sock=narrow) as slow,
        connect(url, max_queue=None) as quick,
    ):
        _until(lambda: server.remark.startswith("2 clients"))
        for number in range(count):
            server.write(make_readings(64 * number, 64, pixels=1))
            # the quick one is up to date
            assert str(quick.recv(timeout=10)).startswith(f'{{"first":{64 * number},')
        assert "messages lost by slow clients" in server.remark
        lost = int(server.remark.split(", ")[1].split()[0])
        heads = [slow.recv(timeout=10)[:20] for _ in range(count - lost)]
        got = [int(re.findall(r"\d+", str(head))[0]) // 64 for head in heads]
    # the first ones were on their way already; the last ones are complete
    assert got[-1] == count - 1
    assert got[-WAITING:] == list(range(count - WAITING, count))


def test_without_the_token_nobody_gets_in() -> None:
    sink = WebSocketSink("ws://127.0.0.1:0", token="secret")
    url = f"ws://127.0.0.1:{sink.port}"
    try:
        for refused in (url, f"{url}/?token=other"):
            with pytest.raises(InvalidStatus, match="401"), connect(refused):
                pass
        with connect(f"{url}/?token=secret"):
            pass
        with connect(url, additional_headers={"Authorization": "Bearer secret"}):
            pass
    finally:
        sink.close()


def test_pages_of_other_sites_cannot_read_along(server: WebSocketSink) -> None:
    url = f"ws://127.0.0.1:{server.port}"
    foreign, local = Origin("https://example.org"), Origin("http://localhost:3000")
    with pytest.raises(InvalidStatus, match="403"), connect(url, origin=foreign):
        pass
    with connect(url, origin=local):
        pass


@pytest.mark.parametrize("target", ["ws://0.0.0.0:0", "zmq:tcp://0.0.0.0:0", "ws://[::]:0"])
def test_beyond_this_computer_a_token_is_needed(model: ff.SensorModel, target: str) -> None:
    with pytest.raises(ff.FringeforceError, match="--token"):
        ff.open_sink(target, model)
    ff.open_sink(target.replace("[::]", "0.0.0.0"), model, token="secret").close()


def test_a_host_for_all_servers_needs_a_token_too(model: ff.SensorModel) -> None:
    with pytest.raises(ff.FringeforceError, match="--token"):
        ff.open_sink("ws:", model, bind="0.0.0.0")


def test_foxglove_stays_on_this_computer(model: ff.SensorModel) -> None:
    with pytest.raises(ff.FringeforceError, match="SSH tunnel"):
        ff.open_sink("foxglove://0.0.0.0:0", model, token="secret")


@pytest.mark.parametrize("scheme", ["ws", "zmq:tcp", "foxglove"])
def test_a_port_that_is_taken_is_named(model: ff.SensorModel, scheme: str) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ff.FringeforceError, match="cannot be served"):
            ff.open_sink(f"{scheme}://127.0.0.1:{port}", model)


def test_foxglove_is_told_what_is_sent(
    model: ff.SensorModel, blocks: list[Readings], whole: Readings
) -> None:
    sink = FoxgloveSink(model.sensor, "foxglove://127.0.0.1:0")
    try:
        with connect(
            f"ws://127.0.0.1:{sink.port}",
            subprotocols=[Subprotocol("foxglove.sdk.v1")],
        ) as client:
            channel = next(
                one["channels"][0]
                for one in (json.loads(client.recv(timeout=10)) for _ in range(10))
                if one["op"] == "advertise"
            )
            assert channel["topic"] == "/fringeforce/reading"
            wanted = {"id": 7, "channelId": channel["id"]}
            client.send(json.dumps({"op": "subscribe", "subscriptions": [wanted]}))
            data: list[bytes] = []
            while len(data) < 4:
                sink.write(blocks[1])
                with suppress(TimeoutError):
                    message = client.recv(timeout=0.1)
                    data += [message] if isinstance(message, bytes) else []
    finally:
        sink.close()
    # operation 1, subscription 7, time, then the message
    assert data[0][:5] == b"\x01\x07\x00\x00\x00"
    reading = json.loads(data[0][13:])
    np.testing.assert_allclose(reading["normal"], whole.forces[reading["line"], :, 0], atol=1e-6)


@pytest.mark.parametrize("token", [None, "secret"])
def test_a_zeromq_subscriber_gets_blocks(blocks: list[Readings], token: str | None) -> None:
    sink = ZmqSink("tcp://127.0.0.1:0", token=token)
    context = zmq.Context()
    client = context.socket(zmq.SUB)
    client.subscribe("")
    if token:
        client.plain_username, client.plain_password = b"fringeforce", token.encode()
    client.connect(sink.name)
    try:
        deadline = time.monotonic() + 10
        while not client.poll(50):
            sink.write(blocks[1])
            assert time.monotonic() < deadline
        assert _parsed(client.recv())["first"] == 4
    finally:
        client.close(0)
        context.term()
        sink.close()


def test_a_zeromq_subscriber_with_the_wrong_token_gets_nothing(blocks: list[Readings]) -> None:
    sink = ZmqSink("tcp://127.0.0.1:0", token="secret")
    context = zmq.Context()
    client = context.socket(zmq.SUB)
    client.subscribe("")
    client.plain_username, client.plain_password = b"fringeforce", b"other"
    client.connect(sink.name)
    try:
        for _ in range(10):
            sink.write(blocks[0])
            assert not client.poll(50)
    finally:
        client.close(0)
        context.term()
        sink.close()


@pytest.mark.parametrize("kind", ["tape:x", "csv:", "", "wss://127.0.0.1:0"])
def test_an_unknown_sink_is_refused_with_those_there_are(model: ff.SensorModel, kind: str) -> None:
    with pytest.raises(ff.FringeforceError, match="csv:PATH, h5:PATH"):
        ff.open_sink(kind, model)


@pytest.mark.parametrize(
    ("target", "module", "words"),
    [
        ("foxglove:", "foxglove", r"pip install '\.\[robots\]'"),
        ("mcap:r", "foxglove", r"pip install '\.\[robots\]'"),
        ("rosbag:r", "rosbags.rosbag2", r"pip install '\.\[robots\]'"),
        ("zmq:", "zmq", r"pip install '\.\[robots\]'"),
        ("lsl:r", "pylsl", r"pip install '\.\[robots\]'"),
        ("ws:", "websockets", r"pip install '\.\[web\]'"),
        ("ros:r", "rclpy", "source the setup file of a ROS"),
    ],
)
def test_what_is_not_installed_is_named_with_its_remedy(
    model: ff.SensorModel,
    monkeypatch: pytest.MonkeyPatch,
    target: str,
    module: str,
    words: str,
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ff.FringeforceError, match=words):
        ff.open_sink(target, model)
