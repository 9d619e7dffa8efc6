"""Pictures of results, written to files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from fringeforce.base.storage import writing
from fringeforce.contacts.resultant import touch
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.models.strip import SensorModel
from fringeforce.plotting.axes import (
    figure,
    forces,
    history,
    pad_forces,
    pressures,
    residuals,
    tractions,
)
from fringeforce.reading.reading import Reading


def draw_readings(sensor: Sensor | Pad, readings: Sequence[Reading], path: Path) -> None:
    """Write a picture of one reading's forces, or of those of many.

    Of many readings the normal forces of a strip are drawn, the pressure on a skin as a map, and
    the sums of all forces of a pad.

    Parameters
    ----------
    sensor : Sensor or Pad
        The design.
    readings : sequence of Reading
        One for each frame.
    path : Path
        Path of the picture.

    Raises
    ------
    FileFormatError
        If the picture cannot be written.
    """
    skin = isinstance(sensor, Sensor) and sensor.skin is not None
    draw_one, draw_many, size = _DRAWN["skin" if skin else sensor.kind]
    with _picture(path, *(size if len(readings) == 1 else ())) as ax:
        if len(readings) == 1:
            draw_one(ax, sensor, readings[0])
        else:
            draw_many(ax, sensor, readings)


def _strip_forces(ax: Axes, _: Sensor, reading: Reading) -> None:
    forces(ax, reading.forces, reading.std)


def _strip_history(ax: Axes, _: Sensor, readings: Sequence[Reading]) -> None:
    normal = np.array([reading.forces[:, 0] for reading in readings])
    count = normal.shape[1]
    ax.set_prop_cycle(color=mpl.colormaps["viridis"](np.linspace(0, 0.9, count)))
    shown = {1: "tactel 1", count: f"tactel {count}"}
    history(ax, normal, [shown.get(k + 1, "_") for k in range(count)], "normal force [N]")


def _skin_traction(ax: Axes, sensor: Sensor, reading: Reading) -> None:
    if reading.traction is None:
        return _strip_forces(ax, sensor, reading)
    traction = reading.traction
    return tractions(ax, traction.places, traction.values, traction.std)


def _skin_history(ax: Axes, sensor: Sensor, readings: Sequence[Reading]) -> None:
    places = sensor.tactels.positions
    nothing = np.full(len(places), np.nan)
    rows = [
        nothing if r.traction is None or not r.trusted else r.traction.values[:, 0]
        for r in readings
    ]
    pressures(ax, places, np.array(rows))


def _pad_forces(ax: Axes, pad: Pad, reading: Reading) -> None:
    pad_forces(ax, pad, reading.forces)


def _pad_history(ax: Axes, pad: Pad, readings: Sequence[Reading]) -> None:
    nothing = np.full(3, np.nan)
    sums = [touch(pad, r).total.force if np.isfinite(r.forces).all() else nothing for r in readings]
    history(ax, np.array(sums), ("normal", "along x", "along y"), "force on all tactels [N]")


_DRAWN: Mapping[str, Any] = {
    "strip": (_strip_forces, _strip_history, ()),
    "skin": (_skin_traction, _skin_history, ()),
    "pad": (_pad_forces, _pad_history, (5.4, 4.4)),
}
"""What draws one reading and what draws many, by the kind of sensor, and the size for one."""


def draw_residuals(model: SensorModel, frames: ArrayLike, loads: ArrayLike, path: Path) -> None:
    """Write a picture of what a calibrated model leaves of the frames that it was fitted to.

    Parameters
    ----------
    model : SensorModel
        Calibrated.
    frames : array_like, shape (F, n_pixels)
        Grey levels.
    loads : array_like, shape (F, n, 2)
        Known forces [N].
    path : Path
        Path of the picture.

    Raises
    ------
    FileFormatError
        If the picture cannot be written.
    """
    found = model.calibration
    left = model.residuals(frames, loads)
    with _picture(path) as ax:
        residuals(ax, left, found.outliers if found else (), found.dead if found else ())


def draw_plan(ratio: ArrayLike, path: Path) -> None:
    """Write a picture of what calibration errors add to readings, over the number of loads.

    Parameters
    ----------
    ratio : array_like, shape (k + 1,)
        Error of readings over that of a perfectly known sensor, from no calibration load on.

    Raises
    ------
    FileFormatError
        If the picture cannot be written.
    """
    excess = np.asarray(ratio)[1:] - 1
    with _picture(path) as ax:
        ax.semilogy(1 + np.arange(len(excess)), 100 * excess, "o-", markersize=4)
        ax.set(
            xlabel="calibration loads", ylabel="readings err more than\nwith a known sensor by [%]"
        )


@contextmanager
def _picture(path: Path, width: float = 8.0, height: float = 3.6) -> Iterator[Axes]:
    """Axes of a picture that is written at the end; its size is in inches."""
    with figure(width, height) as (canvas, ax):
        yield ax
        with writing(path):
            canvas.savefig(path)
