"""Readings as live ROS 2 messages, where a ROS installation brings rclpy."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.base.errors import InputError
from fringeforce.base.storage import FORCE_AXES
from fringeforce.contacts.resultant import wrenches
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor

QUEUE = 10
FRAME_ID = "tactile_sensor"


class RosSink(Sink):
    """Publishes the last reading of every block: resultant, forces and uncertainties.

    Robots' controllers take the newest value; every line is for recordings.

    Parameters
    ----------
    node : str
        Name of the node; the topics are below it.
    sensor : Sensor or Pad
        Design of the sensor.

    Raises
    ------
    InputError
        If there is no ROS in this environment.
    """

    def __init__(self, node: str, sensor: Sensor | Pad) -> None:
        try:
            self._rclpy: Any = import_module("rclpy")
            geometry: Any = import_module("geometry_msgs.msg")
            standard: Any = import_module("std_msgs.msg")
        except ImportError as error:
            raise InputError(
                f"rclpy comes with ROS 2 and not from PyPI ({error}); source the setup file of a "
                "ROS installation first, or write a bag with rosbag:PATH."
            ) from None
        self.name = f"ROS node {node}"
        self._sensor = sensor
        self._wrench, self._array = geometry.WrenchStamped, standard.Float64MultiArray
        self._dimension = standard.MultiArrayDimension
        self._context = self._rclpy.Context()
        self._rclpy.init(context=self._context)
        self._node = self._rclpy.create_node(node, context=self._context)
        self._wrenches, self._forces, self._std = (
            self._node.create_publisher(kind, f"~/{topic}", QUEUE)
            for topic, kind in (
                ("wrench", self._wrench), ("forces", self._array), ("std", self._array)
            )
        )  # fmt: skip

    def write(self, readings: Readings) -> None:
        """Publish the last reading of a block."""
        (force,), (torque,) = wrenches(readings.forces[-1:], self._sensor.tactels.places)
        stamped = self._wrench()
        stamped.header.frame_id = FRAME_ID
        nanoseconds = round(readings.timestamps[-1] * 1e9)
        stamped.header.stamp.sec, stamped.header.stamp.nanosec = divmod(nanoseconds, 10**9)
        for vector, values in ((stamped.wrench.force, force), (stamped.wrench.torque, torque)):
            vector.x, vector.y, vector.z = values.tolist()
        self._wrenches.publish(stamped)
        self._forces.publish(self._array_message(readings.forces[-1]))
        self._std.publish(self._array_message(readings.std[-1]))

    def close(self) -> None:
        """Take the node down."""
        self._node.destroy_node()
        self._rclpy.shutdown(context=self._context)

    def _array_message(self, values: np.ndarray) -> Any:
        (outer, inner), (rows, columns) = FORCE_AXES, values.shape
        array = self._array()
        array.layout.dim = [
            self._dimension(label=outer, size=rows, stride=rows * columns),
            self._dimension(label=inner, size=columns, stride=columns),
        ]
        array.data = values.ravel().tolist()
        return array
