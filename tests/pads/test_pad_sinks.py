"""Readings of a pad on their way to files, browsers and robots."""

import json
from pathlib import Path

import numpy as np
import pylsl
import pytest
import xarray
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

import fringeforce as ff
from fringeforce.acquisition.sinks.message import message
from fringeforce.acquisition.sinks.sink import Readings
from fringeforce.contacts.resultant import wrenches
from fringeforce.io.frames import load_frames
from fringeforce.models.pad import PadModel

Array = np.ndarray
START = 1_700_000_000.0


@pytest.fixture
def readings(model: PadModel) -> Readings:
    """Four images, of which the last is a bad one; every number can be told from its value."""
    n = model.sensor.tactels.total
    forces = np.arange(4.0 * n * 3).reshape(4, n, 3) / 1024
    forces[3] = np.nan
    images = np.arange(4)[:, None, None] + np.zeros((4, *model.frame_shape), np.uint8)
    status = (ff.Status.OK,) * 3 + (ff.Status.BAD_FRAME,)
    chi2 = np.where(np.arange(4) < 3, 1.0, np.nan)
    times = START + np.arange(4) / 16
    return Readings(5, times, forces, forces / 8, chi2, status, images.astype(np.uint8))


def _written(target: str, model: PadModel, readings: Readings) -> None:
    sink = ff.open_sink(target, model)
    sink.write(readings)
    sink.close()


def test_the_wrench_is_the_resultant_and_its_moment_by_hand() -> None:
    # 2 N at (1, 0) mm, and 1 N with shear (0.5, -0.25) N at (-3, 2) mm
    places = np.array([[1e-3, 0.0], [-3e-3, 2e-3]])
    forces = np.array([[[2.0, 0.0, 0.0], [1.0, 0.5, -0.25]]])
    (force,), (torque,) = wrenches(forces, places)
    np.testing.assert_allclose(force, [0.5, -0.25, -3.0])
    # r x f of (-3, 2, 0) mm and (0.5, -0.25, -1) N is (-2, -3, 0.75 - 1) mN m, and
    # of (1, 0, 0) mm and (0, 0, -2) N it is (0, 2, 0) mN m
    np.testing.assert_allclose(torque, [-2e-3, -1e-3, -0.25e-3])


def test_the_wrench_of_a_pad_pressed_on_a_line_is_that_of_a_strip() -> None:
    x = np.linspace(-5e-3, 5e-3, 11)
    loads = np.random.default_rng(0).random((3, 11, 2))
    flat = np.zeros((3, 11, 3))
    flat[..., :2] = loads
    places = np.column_stack([x, np.zeros(11)])
    for one, other in zip(wrenches(loads, x[:, None]), wrenches(flat, places), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-15)


def test_a_csv_has_the_columns_that_read_writes(
    model: PadModel, readings: Readings, tmp_path: Path
) -> None:
    _written(f"csv:{tmp_path / 'r.csv'}", model, readings)
    head, *rows = (tmp_path / "r.csv").read_text().splitlines()
    names = "normal", "tangential_x", "tangential_y"
    forces, std = ([f"{name}{kind}_N" for name in names] for kind in ("", "_std"))
    assert head.split(",") == ["frame", "tactel", "time_s", *forces, *std, "chi2", "status"]
    assert len(rows) == 4 * 20
    cells = rows[20 + 6].split(",")
    assert cells[:2] == ["6", "7"]
    numbers = np.concatenate([readings.forces[1, 6], readings.std[1, 6]])
    np.testing.assert_allclose(np.array(cells[3:9], float), numbers, rtol=1e-5)
    assert rows[-1].endswith("nan,BAD_FRAME")


def test_a_recording_opens_with_labels_and_is_read_again(
    model: PadModel, readings: Readings, tmp_path: Path
) -> None:
    path = tmp_path / "r.h5"
    _written(f"record:{path}", model, readings)
    np.testing.assert_array_equal(load_frames(path, 2), readings.lines)
    with xarray.open_dataset(path, engine="h5netcdf") as dataset:
        assert dataset["forces"].dims == ("frame", "tactel", "component")
        assert dataset["grey"].dims == ("frame", "y", "x")
        assert dataset["component"].values.tolist() == [
            b"normal", b"tangential_x", b"tangential_y",
        ]  # fmt: skip
        np.testing.assert_array_equal(dataset["frame"], [5, 6, 7, 8])
        np.testing.assert_array_equal(dataset["forces"], readings.forces)
        np.testing.assert_array_equal(dataset["std"], readings.std)
        np.testing.assert_array_equal(dataset["x"], model.sensor.pixel_positions[0])


def test_what_is_appended_to_a_recording_stays_small(
    model: PadModel, readings: Readings, tmp_path: Path
) -> None:
    """By the bytes that the system is asked to write, of this process alone (Linux)."""

    def written() -> int:
        lines = Path("/proc/self/io").read_text(encoding="ascii").splitlines()
        return int(dict(line.split(": ") for line in lines)["wchar"])

    sink = ff.open_sink(f"record:{tmp_path / 'r.h5'}", model)
    for _ in range(20):
        before = written()
        sink.write(readings)
        assert readings.lines.nbytes < written() - before < 2**17
    sink.close()


def test_images_of_several_pictures_are_recorded(
    model: PadModel, readings: Readings, tmp_path: Path
) -> None:
    two = [{"arrangement": "analyser", "angle": angle} for angle in (0.0, 45.0)]
    pad = model.sensor.replace(**{"camera.kind": "ordinary", "polariscope.channels": two})
    both = np.repeat(readings.lines[:, None], 2, axis=1)
    _written(
        f"record:{tmp_path / 'r.h5'}",
        PadModel(pad, model.influence),
        Readings(5, readings.timestamps, readings.forces, readings.std, readings.chi2,
                 readings.status, both),
    )  # fmt: skip
    np.testing.assert_array_equal(load_frames(tmp_path / "r.h5", 2), both)


def test_a_message_has_three_components_of_every_tactel(readings: Readings) -> None:
    got = json.loads(message(readings))
    np.testing.assert_allclose(got["forces"][:3], readings.forces[:3], atol=1e-6)
    assert got["forces"][3] == [[None] * 3] * 20
    assert got["status"][-1] == "BAD_FRAME"


def test_the_mcap_library_reads_components_and_resultant(
    model: PadModel, readings: Readings, tmp_path: Path
) -> None:
    _written(f"mcap:{tmp_path / 'r.mcap'}", model, readings)
    with open(tmp_path / "r.mcap", "rb") as file:
        found = [
            (json.loads(schema.data), json.loads(message.data))
            for schema, _, message in make_reader(file).iter_messages()
            if schema
        ]
    assert [one["line"] for _, one in found] == [5, 6, 7, 8]
    schema, first = found[0]
    assert list(schema["properties"]) == list(first)
    names = "normal", "tangential_x", "tangential_y"
    for column, name in enumerate(names):
        np.testing.assert_allclose(first[name], readings.forces[0, :, column], atol=1e-6)
        np.testing.assert_allclose(first[f"{name}_std"], readings.std[0, :, column], atol=1e-6)
    normal, along, across = readings.forces[0].sum(axis=0)
    np.testing.assert_allclose(first["force"], [along, across, -normal], atol=1e-6)
    assert found[3][1]["force"] == [None] * 3


def test_ros_tools_find_force_and_moment_in_a_bag(
    model: PadModel, readings: Readings, tmp_path: Path
) -> None:
    _written(f"rosbag:{tmp_path / 'bag'}", model, readings)
    found: dict[str, list] = {}
    with AnyReader([tmp_path / "bag"]) as reader:
        for connection, _, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            found.setdefault(connection.topic, []).append(message)
    array, wrench = found["/fringeforce/forces"][1], found["/fringeforce/wrench"][1].wrench
    assert [(one.label, one.size) for one in array.layout.dim] == [("tactel", 20), ("component", 3)]
    np.testing.assert_array_equal(array.data.reshape(20, 3), readings.forces[1])
    normal, along, across = readings.forces[1].T
    arms = np.column_stack([model.sensor.tactels.places, np.zeros(20)])
    moment = np.cross(arms, np.column_stack([along, across, -normal])).sum(axis=0)
    for vector, values in (
        (wrench.force, [along.sum(), across.sum(), -normal.sum()]),
        (wrench.torque, moment),
    ):
        assert (vector.x, vector.y, vector.z) == pytest.approx(values)


def test_a_laboratory_stream_names_every_channel(model: PadModel, readings: Readings) -> None:
    sink = ff.open_sink("lsl:fringeforce pad test", model)
    (info,) = pylsl.resolve_byprop("name", "fringeforce pad test", timeout=20)
    inlet = pylsl.StreamInlet(info)
    inlet.open_stream(timeout=10)
    channel = inlet.info().desc().child("channels").first_child()
    labels = []
    for _ in range(60):
        labels.append(channel.child_value("label"))
        channel = channel.next_sibling()
    sink.write(readings)
    sample, _ = inlet.pull_sample(timeout=10)
    assert sample is not None
    sink.close()
    inlet.close_stream()
    names = "normal", "tangential_x", "tangential_y"
    assert labels == [f"{name}_{tactel}" for tactel in range(1, 21) for name in names]
    assert labels[:4] == ["normal_1", "tangential_x_1", "tangential_y_1", "normal_2"]
    np.testing.assert_array_equal(sample, readings.forces[0].ravel())
