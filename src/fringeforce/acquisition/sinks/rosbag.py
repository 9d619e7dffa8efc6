"""Readings as a ROS 2 bag (MCAP), without ROS."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.base.errors import FileFormatError
from fringeforce.base.optional_libraries import extra
from fringeforce.base.storage import FORCE_AXES
from fringeforce.contacts.resultant import wrenches
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor

FRAME_ID = "tactile_sensor"
WRENCH = "geometry_msgs/msg/WrenchStamped"
ARRAY = "std_msgs/msg/Float64MultiArray"
TOPIC = "/fringeforce"


class RosbagSink(Sink):
    """Writes the resultant as WrenchStamped and every tactel as Float64MultiArray.

    The arrays have a row for each tactel: (n, 2) of a strip, (n, 3) of a pad.

    Parameters
    ----------
    path : path
        Path of the bag, a folder that must not exist yet.
    sensor : Sensor or Pad
        Design of the sensor.

    Raises
    ------
    InputError
        If rosbags is missing.
    FileFormatError
        If the bag cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str], sensor: Sensor | Pad) -> None:
        rosbag2: Any = extra("rosbags.rosbag2", "robots")
        typesys: Any = extra("rosbags.typesys", "robots")
        self.name = f"ROS bag {os.fspath(path)}"
        self._sensor = sensor
        self._store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
        try:
            self._bag = rosbag2.Writer(
                Path(path), version=9, storage_plugin=rosbag2.StoragePlugin.MCAP
            )
            self._bag.open()
        except (OSError, rosbag2.WriterError) as error:
            raise FileFormatError(f"{path} cannot be written: {error}.") from None
        self._wrench, self._forces, self._std = (
            self._bag.add_connection(f"{TOPIC}/{topic}", kind, typestore=self._store)
            for topic, kind in (("wrench", WRENCH), ("forces", ARRAY), ("std", ARRAY))
        )

    def write(self, readings: Readings) -> None:
        """Append a block."""
        forces, torques = wrenches(readings.forces, self._sensor.tactels.places)
        for i, time in enumerate(np.rint(readings.timestamps * 1e9).astype(int).tolist()):
            wrench = self._wrench_message(time, forces[i], torques[i])
            self._append(self._wrench, time, wrench)
            self._append(self._forces, time, self._array_message(readings.forces[i]))
            self._append(self._std, time, self._array_message(readings.std[i]))

    def close(self) -> None:
        """Complete the bag with its index."""
        self._bag.close()

    def _append(self, connection: Any, time: int, message: Any) -> None:
        self._bag.write(connection, time, self._store.serialize_cdr(message, connection.msgtype))

    def _wrench_message(self, time: int, force: np.ndarray, torque: np.ndarray) -> Any:
        types = self._store.types
        seconds, nanoseconds = divmod(time, 10**9)
        stamp = types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds)
        vector = types["geometry_msgs/msg/Vector3"]
        return types[WRENCH](
            header=types["std_msgs/msg/Header"](stamp=stamp, frame_id=FRAME_ID),
            wrench=types["geometry_msgs/msg/Wrench"](
                force=vector(*force.tolist()), torque=vector(*torque.tolist())
            ),
        )

    def _array_message(self, values: np.ndarray) -> Any:
        types, (rows, columns) = self._store.types, values.shape
        outer, inner = FORCE_AXES
        dimension = types["std_msgs/msg/MultiArrayDimension"]
        layout = types["std_msgs/msg/MultiArrayLayout"](
            dim=[
                dimension(label=outer, size=rows, stride=rows * columns),
                dimension(label=inner, size=columns, stride=columns),
            ],
            data_offset=0,
        )
        return types[ARRAY](layout=layout, data=np.ascontiguousarray(values).ravel())
