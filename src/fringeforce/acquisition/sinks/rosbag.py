"""Readings as a ROS 2 bag (MCAP), without ROS."""

from __future__ import annotations

import os
from pathlib import Path
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
from fringeforce.base.errors import FileFormatError
from fringeforce.base.optional_libraries import extra
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor

TOPIC = "/fringeforce"


class RosbagSink(Sink):
    """Writes the resultant as WrenchStamped and every tactel as Float64MultiArray.

    The arrays have a row for each tactel: (n, 2) of a strip, (n, 3) of a pad.  Of a skin there is
    one with a row for all contacts together and each of them, as in a table of contacts.

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
        except rosbag2.WriterError as error:
            raise FileFormatError(f"{str(error).rstrip('.')}; give another name.") from None
        except OSError as error:
            raise FileFormatError(f"{path} cannot be written: {error}.") from None
        self._connections = {
            topic: self._bag.add_connection(f"{TOPIC}/{topic}", kind, typestore=self._store)
            for topic, kind in (SKIN_TOPICS if is_skin(sensor) else TOPICS).items()
        }

    def write(self, readings: Readings) -> None:
        """Append a block."""
        forces, torques = wrenches_of(readings, self._sensor)
        types = self._store.types.__getitem__
        rows = [] if readings.resultants is None else list(contact_rows(readings))
        for i, time in enumerate(np.rint(readings.timestamps * 1e9).astype(int).tolist()):
            self._append("wrench", time, wrench_message(types, time, forces[i], torques[i]))
            if rows:
                values = np.array(rows[i])
                message = array_message(types, values, values.ravel(), CONTACT_AXES)
                self._append("contacts", time, message)
                continue
            for topic, values in (("forces", readings.forces[i]), ("std", readings.std[i])):
                data = np.ascontiguousarray(values).ravel()
                self._append(topic, time, array_message(types, values, data))

    def close(self) -> None:
        """Complete the bag with its index."""
        self._bag.close()

    def _append(self, topic: str, time: int, message: Any) -> None:
        connection = self._connections[topic]
        self._bag.write(connection, time, self._store.serialize_cdr(message, connection.msgtype))
