"""Readings as live ROS 2 messages, where a ROS installation brings rclpy."""

from __future__ import annotations

from dataclasses import replace
from importlib import import_module
from typing import Any

import numpy as np

from fringeforce.acquisition.sinks.contact_rows import contact_rows, is_skin, wrenches_of
from fringeforce.acquisition.sinks.ros_messages import (
    CONTACT_AXES,
    SKIN_TOPICS,
    TOPICS,
    array_message,
    wrench_message,
)
from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.base.errors import InputError
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor

QUEUE = 10


class RosSink(Sink):
    """Publishes the last reading of every block: resultant, forces and uncertainties.

    Of a skin they are the resultant and the rows of a table of contacts.

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
        topics = SKIN_TOPICS if is_skin(sensor) else TOPICS
        try:
            self._rclpy: Any = import_module("rclpy")
            kinds = {topic: _type(name) for topic, name in topics.items()}
        except ImportError as error:
            raise InputError(
                f"rclpy comes with ROS 2 and not from PyPI ({error}); source the setup file of a "
                "ROS installation first, or write a bag with rosbag:PATH."
            ) from None
        self.name = f"ROS node {node}"
        self._sensor = sensor
        self._context = self._rclpy.Context()
        self._rclpy.init(context=self._context)
        self._node = self._rclpy.create_node(node, context=self._context)
        self._publishers = {
            topic: self._node.create_publisher(kind, f"~/{topic}", QUEUE)
            for topic, kind in kinds.items()
        }

    def write(self, readings: Readings) -> None:
        """Publish the last reading of a block."""
        forces, torques = wrenches_of(readings, self._sensor)
        force, torque = forces[-1], torques[-1]
        nanoseconds = round(readings.timestamps[-1] * 1e9)
        self._publishers["wrench"].publish(wrench_message(_type, nanoseconds, force, torque))
        if readings.resultants is not None:
            (rows,) = contact_rows(replace(readings, resultants=readings.resultants[-1:]))
            values = np.array(rows)
            message = array_message(_type, values, values.ravel().tolist(), CONTACT_AXES)
            self._publishers["contacts"].publish(message)
            return
        for topic, values in (("forces", readings.forces[-1]), ("std", readings.std[-1])):
            message = array_message(_type, values, values.ravel().tolist())
            self._publishers[topic].publish(message)

    def close(self) -> None:
        """Take the node down."""
        self._node.destroy_node()
        self._rclpy.shutdown(context=self._context)


def _type(name: str) -> Any:
    package, _, kind = name.partition("/msg/")
    return getattr(import_module(f"{package}.msg"), kind)
