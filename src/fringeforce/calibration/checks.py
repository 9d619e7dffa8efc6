"""What can be wrong with frames and loads from a bench, and which pixels and loads are wrong."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import median_filter

from fringeforce.base.arrays import Array, Mask, numbers
from fringeforce.base.errors import InputError
from fringeforce.calibration.bench_loads import BenchLoads, loads_on_tactels, presses_as_loads
from fringeforce.calibration.delay import coarse_delay
from fringeforce.calibration.load_log import LoadLog
from fringeforce.calibration.timed_loads import TimedLoads
from fringeforce.contacts.loads import checked_loads
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.estimation.bad_pixels import outlying, stuck_pixels
from fringeforce.models.presses import are_presses
from fringeforce.reading.strip_frames import SATURATION

FEWEST = 4
"""Loaded frames without which nothing is calibrated or checked."""
HEAVIEST, LIGHTEST = 500.0, 1e-4
"""Loads per tactel that no bench means to apply in newtons [N]."""
NEIGHBOURS = 51
"""Pixels whose median misfit tells what is usual around a pixel."""
MARGIN = 2
"""Pixels at either end of a strip that may see beside it, by the blur of the lens."""
MOST_STUCK = 0.5
"""Share of stuck pixels from which those of the majority are no faults but the camera's own way."""


def checked_measurements(
    sensor: Sensor | Pad, frames: ArrayLike, forces: ArrayLike
) -> tuple[Array, Array]:
    """Grey levels (F, P) and loads (F, components n) of measurements, as floats.

    Parameters
    ----------
    sensor : Sensor
        The drawing.
    frames : array_like, shape (F, P)
        Grey levels.
    forces : array_like, shape (F, n, components)
        Known forces [N].

    Raises
    ------
    InputError
        If they do not fit each other or the sensor; rows are named, counted from 0.
    """
    levels, tactels = _levels(sensor, frames), sensor.tactels.total
    if sensor.skin is not None:
        raise InputError(
            "A skin has no tactels to press on; say where each contact is: a list of presses for "
            "every frame, or a table with x_mm."
        )
    expected = len(levels), tactels, len(sensor.components)
    loads = checked_loads(forces, tactels, expected[2])
    if loads.shape != expected:
        raise InputError(
            f"Forces of shape {loads.shape} do not fit {len(levels)} frames of {tactels} tactels; "
            f"give {expected}, one entry for every frame."
        )
    if bad := _rows(~np.isfinite(loads).all(axis=(1, 2))):
        raise InputError(f"Forces of frames {bad} are not finite; give numbers or drop the rows.")
    _check_loads(np.abs(loads).max(axis=(1, 2)), np.abs(loads).max(), levels, sensor)
    return levels, loads.reshape(len(loads), -1)


def checked_bench(
    sensor: Sensor | Pad, frames: ArrayLike, loads: Any, times: ArrayLike | None
) -> tuple[Array, BenchLoads | TimedLoads]:
    """Grey levels (F, P) and contacts of a bench.

    Parameters
    ----------
    sensor : Sensor
        The drawing.
    frames : array_like, shape (F, P)
        Grey levels.
    loads : array_like, BenchLoads, LoadLog or sequence of sequences of Press
        As of `calibrate`.
    times : array_like, shape (F,), optional
        When the frames were taken [s].

    Raises
    ------
    InputError
        If they do not fit each other or the sensor.
    """
    if isinstance(loads, LoadLog):
        levels = _levels(sensor, frames)
        when = np.full(0, np.nan) if times is None else numbers(times, "Times")
        if when.shape != (len(levels),) or not np.isfinite(when).all():
            raise InputError(
                f"{when.size} times do not fit {len(levels)} frames; loads by time need the time "
                "of every frame in seconds, from the recording or by its frame rate."
            )
        delay = coarse_delay(loads, when, levels)
        timed = TimedLoads(loads, when, delay, max(float(np.median(np.diff(when))), 1e-3))
        _check_contacts(sensor, timed.at(delay), levels)
        return levels, timed
    if are_presses(loads):
        loads = presses_as_loads(loads)
    if not isinstance(loads, BenchLoads):
        levels, flat = checked_measurements(sensor, frames, loads)
        forces = flat.reshape(len(levels), -1, len(sensor.components))
        return levels, loads_on_tactels(forces, sensor.tactels.places)
    levels = _levels(sensor, frames)
    if len(loads) != len(levels):
        raise InputError(
            f"Loads of {len(loads)} frames do not fit {len(levels)} frames; give an entry, if only "
            "an empty one, for every frame."
        )
    _check_contacts(sensor, loads, levels)
    return levels, loads


def _levels(sensor: Sensor | Pad, frames: ArrayLike) -> Array:
    levels, camera = numbers(frames, "Grey levels"), sensor.camera
    if sensor.calibration_refusal:
        raise InputError(sensor.calibration_refusal)
    if levels.shape[1:] != sensor.frame_shape:
        raise InputError(
            f"Frames of shape {levels.shape} do not fit this {sensor.kind}; give "
            f"(frames, {', '.join(map(str, sensor.frame_shape))})."
        )
    levels = levels.reshape(len(levels), -1)
    seen = np.isfinite(levels) & (levels >= 0) & (levels <= camera.full_scale)
    if bad := _rows(~seen.all(axis=1)):
        raise InputError(
            f"Frames {bad} hold grey levels that are not from 0 to {camera.full_scale}; check the "
            f"camera's bits ({camera.bits} in the design) or drop the rows."
        )
    return levels


def _check_contacts(sensor: Sensor | Pad, loads: BenchLoads, levels: Array) -> None:
    """Raise if contacts lie beside the sensor, or forces make no sense."""
    sides = [sensor.transducer.length, sensor.transducer.width]
    if loads.forces.shape[2] != len(sensor.components):
        raise InputError(
            f"Forces have {loads.forces.shape[2]} components; those of a {sensor.kind} are "
            f"{', '.join(sensor.components)}."
        )
    places = loads.places.reshape(*loads.present.shape, -1)
    for axis, side, where in zip("xy", sides, np.moveaxis(places, -1, 0), strict=False):
        half = side / 2
        beside = loads.present & ~(np.abs(np.nan_to_num(where, nan=np.inf)) <= half)
        if beside.any():
            frame, contact = np.argwhere(beside)[0]
            raise InputError(
                f"Contact {contact + 1} of frame {frame} lies at {axis} = "
                f"{where[frame, contact]:g} m, beside the {sensor.kind}, which ends at +-{half:g} "
                "m; places are in metres from its middle."
            )
    _check_loads(loads.magnitude, np.nanmax(loads.magnitude, initial=0.0), levels, sensor)


def check_changes(levels: Array, sensor: Sensor | Pad) -> None:
    """Raise for frames most of whose pixels do not change, as those of another camera."""
    stuck = stuck_pixels(levels, sensor.noise).mean()
    if stuck > MOST_STUCK:
        raise InputError(
            f"{stuck:.0%} of the pixels hardly change from frame to frame, less than by the noise "
            f"of {' or '.join(f'{one:g}' for one in np.unique(sensor.noise))} grey levels in the "
            "design; give raw frames of this camera, or "
            "state its noise."
        )


def _check_loads(sizes: Array, largest: float, levels: Array, sensor: Sensor | Pad) -> None:
    """Raise if too few frames are loaded, forces are in another unit, or frames are saturated."""
    camera, loaded = sensor.camera, sizes > 0
    if loaded.sum() < FEWEST:
        raise InputError(
            f"{loaded.sum()} of {len(levels)} frames have a load that is not zero; at least "
            f"{FEWEST} are needed. Press in {FEWEST - loaded.sum()} more, or add their rows to the "
            "loads."
        )
    if not LIGHTEST < largest < HEAVIEST:
        raise InputError(
            f"The largest force is {largest:g} N, which no such sensor is pressed with; forces are "
            f"in newtons, from {LIGHTEST:g} to {HEAVIEST:g}. Convert the unit."
        )
    full = (levels >= camera.full_scale).mean(axis=1) > SATURATION
    if full.mean() > 0.5:
        raise InputError(
            f"Frames {_rows(full)} are saturated: more than {SATURATION:.0%} of their pixels are "
            f"at {camera.full_scale}. Shorten the exposure and press again."
        )


def remarks(levels: Array, loads: BenchLoads, sensor: Sensor) -> list[str]:
    """What a person should know of frames that can be used all the same."""
    found, camera = [], sensor.camera
    numbers = np.full(loads.present.shape, -1) if loads.tactels is None else loads.tactels
    tactels = np.arange(sensor.tactels.count) if (numbers >= 0).any() else []
    for number, kind in enumerate(("normally", "tangentially")):
        pressed = numbers[loads.present & (loads.forces[..., number] != 0)]
        if never := ", ".join(str(j + 1) for j in np.setdiff1d(tactels, pressed)):
            found.append(
                f"Never loaded {kind}: tactel {never}; what is said of it rests on the elements."
            )
    if full := _rows((levels >= camera.full_scale).mean(axis=1) > SATURATION):
        found.append(f"Frames {full} are saturated and say little; shorten the exposure.")
    return found


def see_strip(sensor: Sensor, positions: Array) -> Mask:
    """Pixels at these places [m], shape (P,), that see nothing beside the strip."""
    half = sensor.transducer.length * (1 / 2 - MARGIN / len(positions))
    return np.asarray(np.abs(positions) < half)


def misfitting_pixels(residuals: Array) -> Mask:
    """Pixels that fit worse than noise and than their neighbours, shape (P,).

    Parameters
    ----------
    residuals : ndarray, shape (F, P)
        In units of the noise.
    """
    square = (residuals**2).mean(axis=0)
    return outlying(residuals, median_filter(square, min(NEIGHBOURS, len(square)), mode="nearest"))


def _rows(chosen: ArrayLike) -> str:
    rows = np.flatnonzero(np.asarray(chosen)).tolist()
    return ", ".join(map(str, rows[:12])) + (f" and {len(rows) - 12} more" if rows[12:] else "")
