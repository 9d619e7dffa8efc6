"""A skin read live: contacts that come and go, in the sinks, on the terminal, in recordings."""

import csv
import json
import threading
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from mcap.reader import make_reader
from rich.console import Console
from rosbags.highlevel import AnyReader

import fringeforce as ff
from fringeforce.acquisition.cameras.camera import Settings
from fringeforce.acquisition.cameras.simulator import SimulatedCamera
from fringeforce.acquisition.loop import read_block
from fringeforce.acquisition.run_statistics import Statistics
from fringeforce.acquisition.sinks.contact_rows import ROWS
from fringeforce.acquisition.sinks.message import message
from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.cli.display import full_scale, picture, summary
from fringeforce.io.frames import load_frames
from fringeforce.io.tables import contact_columns

FAR = 5.0
"""Deviations: beyond them lies one in two million."""
LINES = 24
SLID = 120
"""Lines after which the simulated fingertip has slid."""
START = 1_700_000_000.0
COLUMNS = contact_columns()


@pytest.fixture(scope="module")
def skin() -> ff.SensorModel:
    return ff.characterize(ff.load_sensor("skin"))


def presses(times: np.ndarray) -> list[list[ff.Press]]:
    """Nothing, then one contact, then another beside it, then the first one alone."""
    one = ff.Press(x=-2e-3, normal=1.5, tangential=0.3, width=0.8e-3)
    other = ff.Press(x=2.5e-3, normal=0.8, width=0.5e-3)
    steps = [[], [one], [one, other], [one]]
    return [steps[min(int(4 * share), 3)] for share in times]


@pytest.fixture(scope="module")
def readings(skin: ff.SensorModel) -> Readings:
    """Of a camera that shows these."""
    camera = SimulatedCamera(skin, Settings(LINES, block=LINES), presses, period=1.0, rng=1)
    reader = ff.Reader(skin)
    reader.prepare()
    with camera:
        return read_block(reader, next(iter(camera)))


@pytest.fixture(scope="module")
def truth() -> list[list[ff.Press]]:
    return presses(np.arange(LINES) / LINES)


def _written(target: str, model: ff.SensorModel, readings: Readings) -> None:
    sink = ff.open_sink(target, model)
    sink.write(readings)
    sink.close()


def _check(row: dict[str, float], press: ff.Press) -> None:
    for name, value in (("x", press.x * 1e3), ("normal", press.normal)):
        unit = "mm" if name == "x" else "N"
        assert abs(row[f"{name}_{unit}"] - value) < FAR * row[f"{name}_std_{unit}"]
    assert row["normal_std_N"] < 0.05


def test_contacts_come_and_go(readings: Readings, truth: list[list[ff.Press]]) -> None:
    assert readings.resultants is not None
    for felt, touching in zip(readings.resultants, truth, strict=True):
        total, *contacts = felt
        assert len(contacts) == len(touching)
        assert abs(total.force[0] - sum(press.normal for press in touching)) < FAR * total.std[0]


def test_a_table_has_a_row_for_each_contact(
    skin: ff.SensorModel, readings: Readings, truth: list[list[ff.Press]], tmp_path: Path
) -> None:
    _written(f"csv:{tmp_path / 'r.csv'}", skin, readings)
    with open(tmp_path / "r.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    numbers = [(int(row["frame"]) - readings.first, int(row["contact"])) for row in rows]
    assert numbers == [(k, c) for k, one in enumerate(truth) for c in range(len(one) + 1)]
    for row, (line, contact) in zip(rows, numbers, strict=True):
        assert row["status"] == readings.status[line].name
        assert float(row["time_s"]) == pytest.approx(readings.timestamps[line], abs=1e-5)
        if contact:
            strongest = sorted(truth[line], key=lambda press: -press.normal)
            cells = {name: float(row[name]) for name in COLUMNS}
            _check(cells, strongest[contact - 1])


def test_messages_hold_the_contacts_of_every_line(
    skin: ff.SensorModel, readings: Readings, truth: list[list[ff.Press]], tmp_path: Path
) -> None:
    _written(f"mcap:{tmp_path / 'r.mcap'}", skin, readings)
    with open(tmp_path / "r.mcap", "rb") as file:
        logged = [json.loads(item.data) for _, _, item in make_reader(file).iter_messages()]
    sent = json.loads(message(readings))["contacts"]
    assert sent == [one["contacts"] for one in logged]
    for rows, one, touching in zip(sent, logged, truth, strict=True):
        assert [*rows[0]] == [*COLUMNS]
        assert len(rows) == len(touching) + 1
        assert one["force"][2] == pytest.approx(-rows[0]["normal_N"], abs=1e-5)
        strongest = sorted(touching, key=lambda press: -press.normal)
        for row, press in zip(rows[1:], strongest, strict=True):
            _check(row, press)


def test_bags_hold_wrenches_and_contacts(
    skin: ff.SensorModel, readings: Readings, truth: list[list[ff.Press]], tmp_path: Path
) -> None:
    _written(f"rosbag:{tmp_path / 'bag'}", skin, readings)
    found: dict[str, list[Any]] = {}
    with AnyReader([tmp_path / "bag"]) as bag:
        for connection, _, raw in bag.messages():
            one = bag.deserialize(raw, connection.msgtype)
            found.setdefault(connection.topic.rpartition("/")[2], []).append(one)
    assert sorted(found) == ["contacts", "wrench"]
    assert len(found["wrench"]) == len(found["contacts"]) == LINES
    for wrench, contacts, touching in zip(found["wrench"], found["contacts"], truth, strict=True):
        sizes = [dimension.size for dimension in contacts.layout.dim]
        rows = contacts.data.reshape(sizes)
        assert rows.shape == (len(touching) + 1, len(COLUMNS))
        assert wrench.wrench.force.z == pytest.approx(-rows[0, 2], abs=1e-5)
        # the moment of the contacts about the middle, from places in millimetres
        moment = rows[1:, 2] @ rows[1:, 0] * 1e-3
        if touching:
            assert wrench.wrench.torque.y == pytest.approx(moment, abs=2e-5)


def test_a_recording_holds_contacts_and_is_read_again(
    skin: ff.SensorModel, readings: Readings, truth: list[list[ff.Press]], tmp_path: Path
) -> None:
    path = tmp_path / "r.h5"
    _written(f"record:{path}", skin, readings)
    with h5py.File(path) as file:
        normal = np.asarray(file["contact_normal"])
        place = np.asarray(file["contact_x"])
        assert file["contact_x_std"].attrs["units"] == "m"
    assert normal.shape == (LINES, ROWS)
    for line, where, touching in zip(normal, place, truth, strict=True):
        assert np.isfinite(line).sum() == len(touching) + 1
        strongest = sorted(touching, key=lambda press: -press.normal)
        np.testing.assert_allclose(
            where[1 : 1 + len(touching)], [press.x for press in strongest], atol=0.05e-3
        )
    again = ff.Reader(skin).read_on(load_frames(path, 1))
    np.testing.assert_allclose(again.forces, readings.forces, atol=1e-6)


def test_an_outlet_has_channels_for_as_many_contacts_as_there_may_be(
    skin: ff.SensorModel, readings: Readings
) -> None:
    pylsl = pytest.importorskip("pylsl")
    from fringeforce.acquisition.sinks.lsl import LslSink

    sink = LslSink("fringeforce skin", skin.sensor)
    (info,) = pylsl.resolve_byprop("name", "fringeforce skin", timeout=20)
    inlet = pylsl.StreamInlet(info)
    inlet.open_stream(timeout=10)
    sink.write(readings)
    samples, _ = inlet.pull_chunk(timeout=5)
    described = inlet.info().desc().child("channels").child("channel")
    assert described.child_value("label") == "x_mm_0"
    assert described.child_value("unit") == "millimeters"
    sink.close()
    inlet.close_stream()
    table = np.reshape(samples, (-1, ROWS, len(COLUMNS)))
    assert (np.isfinite(table[:, 1:, 2]).sum(axis=1) <= 2).all()


def test_the_terminal_shows_contacts(readings: Readings, skin: ff.SensorModel) -> None:
    from test_live_command import STATISTICS

    assert readings.resultants is not None
    scale = full_scale(readings)
    assert scale == 2.0  # of 1.5 N
    with open("/dev/null", "w") as nowhere:
        console = Console(width=120, record=True, file=nowhere)
        console.print(picture(skin.sensor, "a camera", STATISTICS, readings, scale))
    lines = console.export_text().splitlines()
    (head,) = [line for line in lines if "contact" in line]
    assert "x / mm" in head
    (row,) = [line for line in lines if line.lstrip().startswith("1 ")]
    assert "-2.0" in row or "-1.9" in row
    assert row.count("█") == pytest.approx(15 + 1.5, abs=1)  # of 20 and 10 letters
    assert any(line.lstrip().startswith("all ") for line in lines)


def test_a_simulated_fingertip_presses_slides_and_lets_go(
    skin: ff.SensorModel, tmp_path: Path
) -> None:
    camera = SimulatedCamera(skin, Settings(40.0, block=20), period=4.0, memory=10.0)
    path = tmp_path / "touch.csv"
    reader = ff.Reader(skin)
    enough = threading.Event()

    def seen(statistics: Statistics, last: object) -> None:
        if statistics.lines >= SLID:
            enough.set()

    sinks = [ff.open_sink(f"csv:{path}", skin)]
    statistics = ff.live(reader, camera, sinks, seconds=60.0, stop=enough, report=seen)
    assert statistics.lines >= SLID
    assert {"OK", "NO_CONTACT"} <= set(statistics.statuses)
    assert sum(statistics.statuses.get(name, 0) for name in ("OK", "NO_CONTACT")) >= 0.95 * (
        statistics.lines
    )
    assert "lines" in summary(statistics)[0]
    with open(path, newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["contact"] == "1"]
    for row in (row for row in rows if row["status"] == "OK"):
        (press,) = camera.true_forces(np.array([int(row["frame"])]))[0]
        off = abs(float(row["normal_N"]) - press.normal)
        assert off < FAR * float(row["normal_std_N"])
    slip = [float(row["tangential_N"]) / float(row["normal_N"]) for row in rows]
    assert max(slip) == pytest.approx(0.3, abs=0.03)
