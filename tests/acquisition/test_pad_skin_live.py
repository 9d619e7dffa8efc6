"""The skin of a pad read live: its contacts in the sinks, on the terminal, in recordings."""

import csv
import json
from dataclasses import replace
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
from fringeforce.acquisition.sinks.contact_rows import ROWS
from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.cli.display import full_scale, picture
from fringeforce.contacts.contact import EventKind
from fringeforce.contacts.fingertip import bearable
from fringeforce.io.frames import load_frames
from fringeforce.io.tables import contact_columns
from fringeforce.models.pad import PadModel

pytestmark = pytest.mark.slow

FAR = 5.0
"""Deviations: beyond them lies one in two million."""
IMAGES = 4
STRONG = ff.Press(x=-2.3e-3, y=1e-3, normal=0.6, tangential=(0.2, 0.0), width=2e-3)
WEAK = ff.Press(x=2.4e-3, y=-1.5e-3, normal=0.3, tangential=(0.0, -0.1), width=(2e-3, 1e-3))
TRUTH = [[], [STRONG], [STRONG, WEAK], [STRONG]]
COLUMNS = contact_columns(("normal", "tangential_x", "tangential_y"))


@pytest.fixture(scope="module")
def tip() -> PadModel:
    found = ff.characterize(ff.load_sensor("fingertip").replace(**{"camera.pixels": [96, 96]}))
    assert isinstance(found, PadModel)
    return found


@pytest.fixture(scope="module")
def readings(tip: PadModel) -> Readings:
    camera = SimulatedCamera(
        tip, Settings(IMAGES, block=IMAGES), lambda times: TRUTH[: len(times)], 1.0, rng=1
    )
    reader = ff.Reader(tip)
    reader.prepare()
    with camera:
        return read_block(reader, next(iter(camera)))


def _written(target: str, model: PadModel, readings: Readings) -> None:
    sink = ff.open_sink(target, model)
    sink.write(readings)
    sink.close()


def _check(row: dict[str, float], press: ff.Press) -> None:
    truth = {"x_mm": press.x * 1e3, "y_mm": (press.y or 0) * 1e3, "normal_N": press.normal}
    truth |= dict(zip(("tangential_x_N", "tangential_y_N"), press.shear, strict=True))
    for name, value in truth.items():
        what, _, unit = name.rpartition("_")
        assert abs(row[name] - value) < FAR * row[f"{what}_std_{unit}"]
    assert row["normal_std_N"] < 0.02


def test_a_table_and_messages_have_a_row_for_each_contact(
    tip: PadModel, readings: Readings, tmp_path: Path
) -> None:
    _written(f"csv:{tmp_path / 'r.csv'}", tip, readings)
    _written(f"mcap:{tmp_path / 'r.mcap'}", tip, readings)
    with open(tmp_path / "r.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    with open(tmp_path / "r.mcap", "rb") as file:
        logged = [json.loads(item.data) for _, _, item in make_reader(file).iter_messages()]
    numbers = [(int(row["frame"]) - readings.first, int(row["contact"])) for row in rows]
    assert numbers == [(k, c) for k, one in enumerate(TRUTH) for c in range(len(one) + 1)]
    for row, (image, contact) in zip(rows, numbers, strict=True):
        cells = {name: float(row[name]) for name in COLUMNS}
        sent = logged[image]["contacts"][contact]
        assert [*sent] == [*COLUMNS]
        assert sent["normal_N"] == pytest.approx(cells["normal_N"], abs=1e-5)
        if contact:
            _check(cells, TRUTH[image][contact - 1])


def test_wrenches_are_of_the_contacts_where_they_are(
    tip: PadModel, readings: Readings, tmp_path: Path
) -> None:
    _written(f"rosbag:{tmp_path / 'bag'}", tip, readings)
    with AnyReader([tmp_path / "bag"]) as bag:
        own = [c for c in bag.connections if c.topic.endswith("wrench")]
        messages: list[Any] = [bag.deserialize(raw, c.msgtype) for c, _, raw in bag.messages(own)]
    for wrench, presses in zip((one.wrench for one in messages), TRUTH, strict=True):
        force, moment = np.zeros((2, 3))
        for press in presses:
            one = np.array([*press.shear, -press.normal])
            force += one
            moment += np.cross([press.x, press.y or 0.0, 0.0], one)
        found = [[getattr(part, axis) for axis in "xyz"] for part in (wrench.force, wrench.torque)]
        np.testing.assert_allclose(found[0], force, atol=5e-3)
        # squares of 2 mm alone would be off by 0.2 mN m
        np.testing.assert_allclose(found[1], moment, atol=3e-5)


def test_a_recording_holds_contacts_and_is_read_again(
    tip: PadModel, readings: Readings, tmp_path: Path
) -> None:
    path = tmp_path / "r.h5"
    _written(f"record:{path}", tip, readings)
    with h5py.File(path) as file:
        columns = {name: np.asarray(file[f"contact_{name}"]) for name in ("x", "y", "long", "spin")}
        units = {name: file[f"contact_{name}"].attrs["units"] for name in (*columns, "orientation")}
        orientation = np.asarray(file["contact_orientation"])
    assert units == {"x": "m", "y": "m", "long": "m", "spin": "N m", "orientation": "rad"}
    assert columns["x"].shape == (IMAGES, ROWS)
    assert np.isfinite(columns["y"][:, 1:]).sum(axis=1).tolist() == [0, 1, 2, 1]
    np.testing.assert_allclose(columns["y"][2, 1:3], [1e-3, -1.5e-3], atol=0.02e-3)
    assert columns["long"][2, 2] == pytest.approx(2e-3, abs=0.2e-3)
    assert abs(orientation[2, 2]) < 0.2
    again = ff.Reader(tip).read_on(load_frames(path, 2))
    np.testing.assert_allclose(again.forces, readings.forces, atol=1e-6)


def test_an_outlet_has_channels_for_all_numbers_of_contacts(
    tip: PadModel, readings: Readings
) -> None:
    pylsl = pytest.importorskip("pylsl")
    from fringeforce.acquisition.sinks.lsl import LslSink

    sink = LslSink("fringeforce fingertip", tip.sensor)
    (info,) = pylsl.resolve_byprop("name", "fringeforce fingertip", timeout=20)
    inlet = pylsl.StreamInlet(info)
    inlet.open_stream(timeout=10)
    sink.write(readings)
    samples, _ = inlet.pull_chunk(timeout=5)
    channel = inlet.info().desc().child("channels").child("channel")
    units = {}
    while channel.name():
        units[channel.child_value("label")] = channel.child_value("unit")
        channel = channel.next_sibling()
    sink.close()
    inlet.close_stream()
    assert len(units) == ROWS * len(COLUMNS)
    assert units["y_mm_1"] == "millimeters"
    assert units["spin_std_Nmm_0"] == "newton millimeters"
    assert np.shape(samples) == (IMAGES, len(units))


def test_the_terminal_shows_a_map_and_the_contacts(tip: PadModel, readings: Readings) -> None:
    from test_live_command import STATISTICS

    arrays = {name: value[:3] for name, value in vars(readings).items() if np.ndim(value)}
    first = replace(readings, **arrays)
    with open("/dev/null", "w") as nowhere:
        console = Console(width=120, record=True, file=nowhere)
        console.print(picture(tip.sensor, "a camera", STATISTICS, first, full_scale(first)))
    lines = console.export_text().splitlines()
    (strong,) = [line for line in lines if " 1  " in line]
    assert "-2.30" in strong
    assert "+1.00" in strong
    (weak,) = [line for line in lines if " 2  " in line]
    assert "+2.40" in weak
    assert "2.0" in weak
    assert sum("░" in line or "▒" in line or "▓" in line for line in lines) >= 2


@pytest.mark.parametrize("noise", range(3))
def test_a_simulated_fingertip_presses_rolls_slides_and_lets_go(tip: PadModel, noise: int) -> None:
    camera = SimulatedCamera(tip, Settings(5.0, block=1), period=6.0, memory=60.0, rng=noise)
    # a tenth of the cover's modulus over a quarter of the skin
    most = 0.1 * 0.99e6 * np.pi / 4 * (10.5e-3 / 4) ** 2
    assert bearable((10.5e-3, 10.5e-3), 0.99e6) == pytest.approx(most)
    truth = [presses[0] if presses else None for presses in camera.true_forces(np.arange(30))]
    touching = [press for press in truth if press is not None]
    assert max(press.normal for press in touching) == pytest.approx(most)
    way = np.ptp([(press.x, press.y) for press in touching], axis=0)
    np.testing.assert_allclose(way, [0.5 * 10.5e-3, 0.3 * 10.5e-3], rtol=0.1)
    reader, seen = ff.Reader(tip), list[EventKind]()
    contacts = ff.SkinContacts(friction=ff.Friction(coefficient=0.3, variance=1e-6))
    for image, press in zip(camera.lines, truth, strict=True):
        reading = reader.read(image)
        assert reading.status in (ff.Status.OK, ff.Status.NO_CONTACT)
        if press is not None and reading.ok:
            (one,) = reading.contacts
            off = np.abs(one.force - [press.normal, *press.shear])
            assert (off < FAR * one.std[:3]).all()
        contacts, events = contacts.follow(reading)
        seen += [event.kind for event in events]
    # it slides with a friction of 0.3 and rolls with half of it
    assert seen == [EventKind.TOUCH, EventKind.SLIP, EventKind.STICK, EventKind.RELEASE]
