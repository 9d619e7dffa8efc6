"""How long a worker computes before another one has its turn on the processor."""

import ctypes
import os
import platform
import sys

TURN = 100_000_000
"""Nanoseconds of a turn.  Those of Linux take some 4 ms, after which more workers than cores find
the caches full of what another one computes: that costs a tenth of their processor time."""
CALLS = {"x86_64": 314, "aarch64": 274}
"""Numbers of the system call `sched_setattr`, which few versions of the C library have."""
NOT_INHERITED = 1
"""Flag by which threads and processes that a worker starts take turns as usual: cameras, servers
and browsers compute little, and Linux lets who asks for short turns go first."""


class _Manner(ctypes.Structure):
    """`struct sched_attr` of Linux."""

    _fields_ = [
        ("size", ctypes.c_uint32),
        ("policy", ctypes.c_uint32),
        ("flags", ctypes.c_uint64),
        ("nice", ctypes.c_int32),
        ("priority", ctypes.c_uint32),
        ("runtime", ctypes.c_uint64),
        ("deadline", ctypes.c_uint64),
        ("period", ctypes.c_uint64),
    ]


def take_long_turns() -> None:
    """Let this thread compute longer at a time, where Linux is 6.12 or newer."""
    number = CALLS.get(platform.machine())
    if sys.platform != "linux" or number is None:
        return
    manner = _Manner(
        size=ctypes.sizeof(_Manner),
        policy=os.SCHED_OTHER,
        flags=NOT_INHERITED,
        nice=os.getpriority(os.PRIO_PROCESS, 0),
        runtime=TURN,
    )
    # what the system refuses stays as it was
    ctypes.CDLL(None).syscall(number, 0, ctypes.byref(manner), 0)
