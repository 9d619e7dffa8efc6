"""ROS 2 messages of readings, whichever library makes their types."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fringeforce.base.arrays import Array
from fringeforce.base.storage import FORCE_AXES

FRAME_ID = "tactile_sensor"
WRENCH = "geometry_msgs/msg/WrenchStamped"
ARRAY = "std_msgs/msg/Float64MultiArray"
TOPICS = {"wrench": WRENCH, "forces": ARRAY, "std": ARRAY}
"""Types of the messages, by the topics that they go to."""
SKIN_TOPICS = {"wrench": WRENCH, "contacts": ARRAY}
"""The same of a skin."""
CONTACT_AXES = ("contact", "number")
Types = Callable[[str], Any]
"""From the full name of a type to what makes such messages."""


def wrench_message(types: Types, nanoseconds: int, force: Array, torque: Array) -> Any:
    """WrenchStamped of a resultant [N], [N m], at a time since 1970 [ns]."""
    seconds, rest = divmod(nanoseconds, 10**9)
    stamp = types("builtin_interfaces/msg/Time")(sec=seconds, nanosec=rest)
    vectors = [
        types("geometry_msgs/msg/Vector3")(**dict(zip("xyz", values.tolist(), strict=True)))
        for values in (force, torque)
    ]
    return types(WRENCH)(
        header=types("std_msgs/msg/Header")(stamp=stamp, frame_id=FRAME_ID),
        wrench=types("geometry_msgs/msg/Wrench")(force=vectors[0], torque=vectors[1]),
    )


def array_message(
    types: Types, values: Array, data: Any, axes: tuple[str, str] = FORCE_AXES
) -> Any:
    """Float64MultiArray of values (n, components), whose elements in order are `data`."""
    rows, columns = values.shape
    strides = zip(axes, values.shape, (rows * columns, columns), strict=True)
    dimension = types("std_msgs/msg/MultiArrayDimension")
    dim = [dimension(label=label, size=size, stride=stride) for label, size, stride in strides]
    return types(ARRAY)(
        layout=types("std_msgs/msg/MultiArrayLayout")(dim=dim, data_offset=0), data=data
    )
