"""Readings as a Lab Streaming Layer stream, beside other instruments on one clock."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from fringeforce.acquisition.sinks.contact_rows import ROWS, contact_table, is_skin
from fringeforce.acquisition.sinks.sink import Readings, Sink
from fringeforce.base.optional_libraries import extra
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.io.tables import contact_columns

UNITS = {"mm": "millimeters", "N": "newtons", "deg": "degrees", "Nmm": "newton millimeters"}
"""Units of the columns of a table of contacts, by how their names end."""


class LslSink(Sink):
    """An outlet with a channel for each component of each tactel, named after both [N].

    They come tactel by tactel: normal_1, tangential_1, normal_2, ...  Of a skin they come contact
    by contact, with the columns of a table of contacts and 0 for all together: x_mm_0, ...  What
    there is none of is not a number.

    Lab Streaming Layer announces streams on the local network and knows no token.

    Parameters
    ----------
    name : str
        Name of the stream.
    sensor : Sensor or Pad
        Design of the sensor.

    Raises
    ------
    InputError
        If pylsl is missing.
    """

    def __init__(self, name: str, sensor: Sensor | Pad) -> None:
        self._lsl: Any = extra("pylsl", "robots")
        # its log would run through what a person watches; warnings and errors still appear
        self._lsl.set_config_content("[log]\nlevel = -1\n")
        tactels = range(1, sensor.tactels.total + 1)
        labels = [f"{name}_{tactel}" for tactel in tactels for name in sensor.components]
        units = ["newtons"] * len(labels)
        if is_skin(sensor):
            columns = contact_columns(sensor.components)
            labels = [f"{name}_{contact}" for contact in range(ROWS) for name in columns]
            units = ROWS * [UNITS[name.rpartition("_")[2]] for name in columns]
        info = self._lsl.StreamInfo(
            name, "Force", len(labels), self._lsl.IRREGULAR_RATE, self._lsl.cf_double64, name
        )
        channels = info.desc().append_child("channels")
        for label, unit in zip(labels, units, strict=True):
            channel = channels.append_child("channel")
            channel.append_child_value("label", label)
            channel.append_child_value("unit", unit)
        self._outlet: Any = self._lsl.StreamOutlet(info)
        self.name = f"LSL stream {name}"

    def write(self, readings: Readings) -> None:
        """Push a block with the time of every line on the clock of the Lab Streaming Layer."""
        ahead = self._lsl.local_clock() - time.time()
        skin = readings.resultants is not None
        values = contact_table(readings) if skin else readings.forces
        rows = values.reshape(len(readings), -1)
        self._outlet.push_chunk(np.ascontiguousarray(rows), (readings.timestamps + ahead).tolist())

    def close(self) -> None:
        """Withdraw the stream."""
        self._outlet = None
