"""What can be wrong with frames and loads from a bench, and which pixels and loads are wrong."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import median_filter

from fringeforce.base.arrays import Array, Mask
from fringeforce.base.errors import InputError
from fringeforce.contacts.loads import checked_loads
from fringeforce.calibration.bench_loads import BenchLoads
from fringeforce.design.strip import Sensor
from fringeforce.estimation.bad_pixels import outlying
from fringeforce.estimation.residual_test import group_sums, square_limit
from fringeforce.reading.strip_frames import SATURATION

FEWEST = 4
"""Frames without which nothing is calibrated."""
HEAVIEST, LIGHTEST = 500.0, 1e-4
"""Loads per tactel that no bench means to apply in newtons [N]."""
NEIGHBOURS = 51
"""Pixels whose median misfit tells what is usual around a pixel."""


def checked_measurements(
    sensor: Sensor, frames: ArrayLike, forces: ArrayLike
) -> tuple[Array, Array]:
    """Grey levels (F, P) and loads (F, 2n) of measurements, as floats.

    Parameters
    ----------
    sensor : Sensor
        The drawing.
    frames : array_like, shape (F, P)
        Grey levels.
    forces : array_like, shape (F, n, 2)
        Known forces [N].

    Raises
    ------
    InputError
        If they do not fit each other or the sensor; rows are named, counted from 0.
    """
    levels, camera = np.asarray(frames, dtype=float), sensor.camera
    pixels, tactels = camera.pixels, sensor.tactels.count
    if sensor.skin is not None:
        raise InputError(
            "A skin has no tactels to press on; calibrate the same strip with tactels where it is "
            "pressed, and give its values to the design of the skin."
        )
    if sensor.polariscope.channels or sensor.polariscope.plates:
        raise InputError(
            "Known loads are compared in one dark field with perfect plates; give a design without "
            "polariscope.channels and polariscope.plates, and frames of that channel alone."
        )
    if levels.ndim != 2 or levels.shape[1] != pixels:
        raise InputError(
            f"Frames of shape {levels.shape} do not fit this sensor; give (frames, {pixels})."
        )
    loads = checked_loads(forces, tactels)
    if loads.shape != (len(levels), tactels, 2):
        raise InputError(
            f"Forces of shape {loads.shape} do not fit {len(levels)} frames of {tactels} tactels; "
            f"give ({len(levels)}, {tactels}, 2), one entry for every frame."
        )
    if bad := _rows(~np.isfinite(loads).all(axis=(1, 2))):
        raise InputError(f"Forces of frames {bad} are not finite; give numbers or drop the rows.")
    seen = np.isfinite(levels) & (levels >= 0) & (levels <= camera.full_scale)
    if bad := _rows(~seen.all(axis=1)):
        raise InputError(
            f"Frames {bad} hold grey levels that are not from 0 to {camera.full_scale}; check the "
            f"camera's bits ({camera.bits} in the design) or drop the rows."
        )
    loaded = np.abs(loads).max(axis=(1, 2)) > 0
    if loaded.sum() < FEWEST:
        raise InputError(
            f"{loaded.sum()} of {len(levels)} frames are loaded; at least {FEWEST} are needed, and "
            f"some {4 * tactels} make a good calibration."
        )
    largest = np.abs(loads).max()
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
    return levels, loads.reshape(len(loads), -1)


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


def misfitting_pixels(residuals: Array) -> Mask:
    """Pixels that fit worse than noise and than their neighbours, shape (P,).

    Parameters
    ----------
    residuals : ndarray, shape (F, P)
        In units of the noise.
    """
    square = (residuals**2).mean(axis=0)
    return outlying(residuals, median_filter(square, min(NEIGHBOURS, len(square)), mode="nearest"))


def misfitting_frames(residuals: Array) -> Mask:
    """Frames that fit worse than noise and than the other frames, shape (F,).

    As in `is_noise`, with the other frames' misfit as a scale where none fits perfectly.

    Parameters
    ----------
    residuals : ndarray, shape (F, p)
        Residuals of the sound pixels, in units of the noise.
    """
    found = np.zeros(len(residuals), dtype=bool)
    for values in (residuals.T, group_sums(residuals.T)):
        excess, freedom = (values**2).sum(axis=0) - len(values), len(values)
        usual = max(np.median(np.abs(excess)) / np.sqrt(2 * freedom), 1.0)
        found |= excess > (square_limit(freedom) - freedom) * usual
    return found


def _rows(chosen: ArrayLike) -> str:
    rows = np.flatnonzero(np.asarray(chosen)).tolist()
    return ", ".join(map(str, rows[:12])) + (f" and {len(rows) - 12} more" if rows[12:] else "")
