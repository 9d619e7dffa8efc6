"""Readings on their way to robots and laboratories."""

import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pylsl
import pytest

import fringeforce as ff
from fringeforce.acquisition.sinks.lsl import LslSink
from fringeforce.acquisition.sinks.ros import RosSink
from fringeforce.acquisition.sinks.sink import Readings

pytestmark = pytest.mark.slow


def test_a_lab_streaming_layer_inlet_gets_every_line(
    model: ff.SensorModel, blocks: list[Readings], whole: Readings
) -> None:
    sink = LslSink("fringeforce test", model.sensor)
    (info,) = pylsl.resolve_byprop("name", "fringeforce test", timeout=20)
    inlet = pylsl.StreamInlet(info)
    inlet.open_stream(timeout=10)
    for block in blocks:
        sink.write(block)
    samples: list[list[float]] = []
    stamps: list[float] = []
    while len(samples) < 20:
        chunk, times = inlet.pull_chunk(timeout=5)
        assert chunk is not None
        assert times
        samples += list(chunk)
        stamps += times
    sink.close()
    inlet.close_stream()
    np.testing.assert_array_equal(np.reshape(samples, (20, 11, 2)), whole.forces)
    np.testing.assert_allclose(np.diff(stamps), np.diff(whole.timestamps), atol=0.01)


class _Ros:
    """What rclpy offers of it all, as far as a publisher needs it."""

    def __init__(self) -> None:
        self.published: dict[str, list[Any]] = {}
        self.down = False

    def create_node(self, name: str, context: object) -> Any:
        def publisher(_: type, topic: str, depth: int) -> Any:
            return SimpleNamespace(publish=self.published.setdefault(f"{name}{topic}", []).append)

        return SimpleNamespace(create_publisher=publisher, destroy_node=lambda: None)

    def modules(self) -> dict[str, ModuleType]:
        def shutdown(context: object) -> None:
            self.down = True

        contents = {
            "rclpy": {
                "Context": object,
                "init": lambda context: None,
                "create_node": self.create_node,
                "shutdown": shutdown,
            },
            "builtin_interfaces.msg": {"Time": SimpleNamespace},
            "geometry_msgs.msg": dict.fromkeys(
                ("WrenchStamped", "Wrench", "Vector3"), SimpleNamespace
            ),
            "std_msgs.msg": dict.fromkeys(
                ("Header", "Float64MultiArray", "MultiArrayLayout", "MultiArrayDimension"),
                SimpleNamespace,
            ),
        }
        modules = {}
        for name, members in contents.items():
            modules[name] = ModuleType(name)
            modules[name].__dict__.update(members)
        return modules


def test_ros_gets_the_newest_reading_of_a_block(
    model: ff.SensorModel,
    blocks: list[Readings],
    whole: Readings,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ros = _Ros()
    for name, module in ros.modules().items():
        monkeypatch.setitem(sys.modules, name, module)
    sink = RosSink("skin", model.sensor)
    sink.write(blocks[1])
    sink.close()
    assert ros.down
    (wrench,) = ros.published["skin~/wrench"]
    (forces,) = ros.published["skin~/forces"]
    assert wrench.wrench.force.z == pytest.approx(-whole.forces[7, :, 0].sum())
    assert wrench.header.stamp.sec == int(whole.timestamps[7])
    assert np.reshape(forces.data, (11, 2)).tolist() == whole.forces[7].tolist()
    assert [dimension.size for dimension in forces.layout.dim] == [11, 2]
