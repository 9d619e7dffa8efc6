"""Loads of a bench in files: by tactel, by place, or by time."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import numpy as np

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.base.errors import FileFormatError, InputError
from fringeforce.base.storage import FORCE_AXES, existing_file, format_of, read, whole_file
from fringeforce.calibration.bench_loads import BenchLoads, bench_loads, loads_on_tactels
from fringeforce.calibration.load_log import LoadLog, load_log
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.io.frames import FRAMES, load_times
from fringeforce.io.load_columns import Columns, load_columns
from fringeforce.io.load_rows import (
    contact_numbers,
    force_stds,
    forces_of,
    frame_numbers,
    tactel_numbers,
)

STATED = {"width": "widths", "radius": "radii", "place_std": "place_std", "width_std": "width_std"}
"""Columns that may be left out, and what loads call them."""


def load_bench_loads(
    path: str | os.PathLike[str], sensor: Sensor | Pad, frames: int | None = None
) -> BenchLoads | LoadLog:
    """Read what a bench says of its loads, by frame or, where there is a column of times, by time.

    Parameters
    ----------
    path : path
        A table (CSV, or HDF5) with the columns of the page on formats; or a frames file (HDF5)
        with forces.  Frames without a row, and rows whose forces are zero, are not loaded.
    sensor : Sensor or Pad
        Whose loads these are.
    frames : int, optional
        Number of frames; up to the last that the table names if not given.

    Returns
    -------
    BenchLoads or LoadLog
        A log if the table has a column of times and none of frames.

    Raises
    ------
    FileFormatError
        If the file is missing or cannot be understood; the message names line, value and limit.

    Examples
    --------
    >>> from pathlib import Path
    >>> from fringeforce.io.bench_loads import load_bench_loads
    >>> rows = "frame;x_mm;normal_N;tangential_N", "0;-1,5;2,0;0,3", "2;3,0;1,0;0"
    >>> _ = Path("presses.csv").write_text(chr(10).join(rows))
    >>> loads = load_bench_loads("presses.csv", ff.load_sensor("skin"))
    >>> len(loads), loads.forces[0]
    (3, array([[2. , 0.3]]))
    """
    if format_of(path) == f"fringeforce-{FRAMES}":
        return _of_frames(path, sensor, frames)
    table = load_columns(path)
    if not table.lines:
        raise FileFormatError(
            f"{path} holds no loads; give the columns frame, tactel or x_mm, normal_N and "
            "tangential_N, and a row for each contact."
        )
    by_time = "frame" not in table.values and bool({"time", "date"} & set(table.values))
    forces = forces_of(table, sensor.components)
    loaded = np.asarray(forces.any(axis=1), bool)
    tactels, places = _places(table, sensor, loaded, by_time)
    _check(table, sensor, places, forces)
    force_std = force_stds(table, sensor.components)
    stated = {theirs: table.get(ours) for ours, theirs in STATED.items()}
    contacts = contact_numbers(table)
    if by_time:
        # a contact that never presses is none
        kept = (contacts >= 0) & np.isin(contacts, contacts[loaded])
        if not kept.any():
            raise FileFormatError(f"{table.name}: nothing presses at any time of this log.")
        when = table.get("time", "date")
        if np.isnan(when).any():
            raise FileFormatError(
                f"{table.where(int(np.isnan(when).argmax()))} has no time; give one."
            )
        try:
            return load_log(
                when[kept],
                places[kept],
                forces[kept],
                contacts[kept],
                force_std=force_std[kept],
                **{name: values[kept] for name, values in stated.items()},
            )
        except InputError as error:
            raise FileFormatError(f"{table.name}: {error}") from None
    number = frame_numbers(table, frames)
    kept = loaded & (contacts >= 0)
    _check_places(table, number, places, kept)
    return bench_loads(
        places[kept],
        forces[kept],
        number[kept],
        int(number.max()) + 1 if frames is None else frames,
        force_std=force_std[kept],
        tactels=None if tactels is None else tactels[kept],
        **{name: values[kept] for name, values in stated.items()},
    )


def save_bench_loads(path: str | os.PathLike[str], loads: BenchLoads) -> None:
    """Write loads as CSV, as `load_bench_loads` reads them.

    A row for each contact; frames without any have a row of zeros, and columns of which nothing is
    stated are left out.

    Parameters
    ----------
    path : path
        Of the file.
    loads : BenchLoads
        What to write.

    Raises
    ------
    FileFormatError
        If the file cannot be written.

    Examples
    --------
    >>> from fringeforce.calibration.bench_loads import bench_loads
    >>> from fringeforce.io.bench_loads import load_bench_loads, save_bench_loads
    >>> save_bench_loads("loads.csv", bench_loads([1e-3], [(2.0, 0.5)], widths=4e-4))
    >>> load_bench_loads("loads.csv", ff.load_sensor("skin")).widths
    array([[0.0004]])
    """
    pad = loads.forces.shape[-1] == 3
    components = Pad.components if pad else Sensor.components
    columns = {
        **{f"{a}_mm": 1e3 * v for a, v in zip("xy", _split(loads.places, pad), strict=False)},
        **{f"{c}_N": v for c, v in zip(components, _split(loads.forces, True), strict=True)},
        "place_std_mm": 1e3 * loads.place_std,
        **{f"{c}_std_N": v for c, v in zip(components, _split(loads.force_std, True), strict=True)},
        "width_mm": 1e3 * loads.widths,
        "width_std_mm": 1e3 * loads.width_std,
        "radius_mm": 1e3 * loads.radii,
    }
    present = loads.present
    always = {f"{name}_N" for name in components} | {"x_mm", "y_mm"}
    kept = {k: v for k, v in columns.items() if k in always or np.isfinite(v[present]).any()}
    named = loads.tactels is not None and bool((loads.tactels[present] >= 0).any())
    with whole_file(path) as place, open(place, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["frame", *(["tactel"] if named else []), *kept])
        for frame, here in enumerate(present):
            for contact in np.flatnonzero(here):
                tactel = loads.tactels[frame, contact] if loads.tactels is not None else -1
                cells = [_cell(values[frame, contact]) for values in kept.values()]
                first = [tactel + 1 if tactel >= 0 else ""] if named else []
                writer.writerow([frame, *first, *cells])
            if not here.any():
                cells = [0 if name.endswith("_N") and "_std" not in name else "" for name in kept]
                writer.writerow([frame, *([""] if named else []), *cells])


def load_frame_times(path: str | os.PathLike[str], frames: int, rate: float | None = None) -> Array:
    """When frames were exposed: as recorded, or evenly spaced from zero on.

    Parameters
    ----------
    path : path
        Of the frames.
    frames : int
        Their number.
    rate : float, optional
        Frames per second, in the place of what is recorded.

    Returns
    -------
    ndarray, shape (frames,)
        [s]; recorded times count from 1970.

    Raises
    ------
    InputError
        If no times are recorded and no rate is given, or the rate is not above zero.

    Examples
    --------
    >>> from fringeforce.io.bench_loads import load_frame_times
    >>> load_frame_times("frames.npy", 3, rate=50.0)
    array([0.  , 0.02, 0.04])
    """
    if rate is not None:
        if not 0 < rate < np.inf:
            raise InputError(f"{rate:g} frames per second: must be above 0 and finite.")
        return np.arange(frames) / rate
    times = load_times(path)
    if times is None:
        raise InputError(
            f"{Path(path).name} says nothing of when its frames were exposed; give the number of "
            "frames per second (--fps), or frames that `fringeforce live --record` wrote."
        )
    return np.asarray(times[:frames], dtype=float)


def _places(
    table: Columns, sensor: Sensor | Pad, loaded: Mask, by_time: bool
) -> tuple[Index | None, Array]:
    """Tactels, if they are named, and places of all rows."""
    axes = "xy"[: sensor.dimensions]
    places = np.stack([table.get(axis) for axis in axes], axis=1)
    tactels = None
    if "tactel" in table.values:
        number = table.get("tactel")
        given = np.isfinite(number)
        if set(axes) <= set(table.values) and not given.any():
            given = np.zeros(len(number), bool)
        tactels = tactel_numbers(table, sensor.tactels.total, given)
        known = sensor.tactels.places
        free = np.isnan(places).all(axis=1) & given
        places[free] = known[tactels[free]]
    elif not set(axes) <= set(table.values):
        wanted = " and ".join(f"{axis}_mm" for axis in axes)
        raise FileFormatError(
            f"{table.name} has the columns {', '.join(table.header)}; loads need {wanted}, or "
            "tactel, for where."
        )
    missing = loaded & np.isnan(places).any(axis=1)
    if by_time:  # between places that are stated others follow
        contacts = contact_numbers(table)
        missing &= ~np.isin(contacts, contacts[np.isfinite(places).all(axis=1)])
    if missing.any():
        row = int(missing.argmax())
        raise FileFormatError(
            f"{table.where(row)} has a force and no place; give it in the column "
            f"{table.written.get('x', 'x_mm')}, or a tactel."
        )
    return tactels, places if len(axes) > 1 else places[:, 0]


def _check(table: Columns, sensor: Sensor | Pad, places: Array, forces: Array) -> None:
    """Raise for what cannot be on this sensor, naming the row."""
    sides = [sensor.transducer.length, sensor.transducer.width]
    for axis, column in zip("xy", places.reshape(len(places), -1).T, strict=False):
        half = sides["xy".index(axis)] / 2
        beyond = np.abs(np.nan_to_num(column)) > half
        if beyond.any():
            row = int(beyond.argmax())
            raise FileFormatError(
                f"{table.where(row)}: {axis} = {column[row] * 1e3:g} mm is beyond the sensor, "
                f"which ends at +-{half * 1e3:g} mm; places count from its middle, and the name of "
                f"the column {table.written.get(axis, axis)} tells the unit."
            )
    for meaning, values in table.values.items():
        lowest = 0.0 if meaning.endswith("_std") else np.nextafter(0, 1)
        if meaning in STATED or meaning.endswith("_std"):
            wrong = values < lowest
            if wrong.any():
                row = int(wrong.argmax())
                limit = "0 or more" if lowest == 0 else "greater than 0"
                raise FileFormatError(
                    f"{table.where(row)}: {table.written[meaning]} must be {limit}; leave the cell "
                    "empty where it is not known."
                )
    both = np.isfinite(table.get("width")) & np.isfinite(table.get("radius"))
    if both.any():
        raise FileFormatError(
            f"{table.where(int(both.argmax()))} has both a width and a radius; give the width of "
            "the contact, or the radius of the indenter, from which mechanics tells the width."
        )
    strongest = int(np.abs(forces[:, 0]).argmax())
    if forces[strongest, 0] < 0 and "tactel" not in table.values:
        column = table.written.get("normal", table.written.get("magnitude", "normal_N"))
        raise FileFormatError(
            f"{table.where(strongest)}: the largest normal force, in the column {column}, pulls. "
            "normal_N counts into the surface; fz_N out of it, as the force on the sensor does; "
            "what acts on the indenter is reaction_fz_N."
        )


def _check_places(table: Columns, frame: Index, places: Array, kept: Mask) -> None:
    """Raise for two contacts of one frame at one place."""
    seen: set[tuple[float, ...]] = set()
    rows = np.flatnonzero(kept)
    for row, where in zip(rows.tolist(), np.column_stack([frame, places])[rows], strict=True):
        key = tuple(where.tolist())
        if key in seen:
            raise FileFormatError(
                f"{table.where(row)}: frame {frame[row]} has two contacts at one place; give their "
                "force in one row."
            )
        seen.add(key)


def _of_frames(
    path: str | os.PathLike[str], sensor: Sensor | Pad, frames: int | None
) -> BenchLoads:
    with existing_file(path, FRAMES) as file:
        if "forces" not in file:
            raise FileFormatError(
                f"{path} holds frames without {' and '.join(FORCE_AXES)} of their forces; give a "
                "table of loads."
            )
        forces = read(file, "forces")
    expected = (len(forces) if frames is None else frames, sensor.tactels.total)
    if forces.shape != (*expected, len(sensor.components)):
        raise FileFormatError(
            f"{path} holds forces of shape {forces.shape}; this sensor and these frames need "
            f"{(*expected, len(sensor.components))}."
        )
    return loads_on_tactels(forces, sensor.tactels.places)


def _split(values: Array, parts: bool) -> list[Array]:
    return list(np.moveaxis(values, -1, 0)) if parts else [values]


def _cell(value: float) -> str:
    return repr(float(f"{value:.12g}")) if np.isfinite(value) else ""
