"""The influence matrix measured column by column, from weak presses on one tactel at a time.

The procedure of Saad et al.: a known load on one tactel, its phase from the intensity, divided by
the load.  `calibrate` uses the same frames better; this one needs no design to be right.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import uniform_filter1d

from fringeforce.base.errors import InputError
from fringeforce.calibration import checks
from fringeforce.design.strip import Sensor
from fringeforce.estimation.bad_pixels import stuck_pixels
from fringeforce.models.imaging import Imaging
from fringeforce.models.strip import SensorModel, characterize

Array = NDArray[np.float64]

SMOOTHING = 31
"""Pixels that are averaged to find where a phase changes its sign."""
FOLD = 0.9 * np.pi
"""Phase up to which the arcsine of the intensity is taken for the phase [rad]."""


def single_press_matrix(
    sensor: Sensor,
    frames: ArrayLike,
    forces: ArrayLike,
    window: int = 1,
    imaging: Imaging | None = None,
) -> SensorModel:
    """Measure the influence matrix pixel by pixel, equations (6) to (8) of the paper.

    Frames of the same press are averaged first.  The sign, which no frame shows, changes where the
    intensity is least between two extremes of the column on the drawing.

    Parameters
    ----------
    sensor : Sensor
        The drawing.
    frames : array_like, shape (F, n_pixels)
        Grey levels; unloaded frames have zero forces and give the offset pixel by pixel.
    forces : array_like, shape (F, n, 2)
        Known forces, at most one of a frame not zero [N].
    window : int
        Neighbouring pixels that are averaged before the arcsine; one for the procedure as it is.
    imaging : Imaging, optional
        Registration and lighting if they are known; as designed if not given.

    Returns
    -------
    SensorModel
        Its matrix is constant over a pixel, and says nothing of its own errors.

    Raises
    ------
    InputError
        If a frame has several loads, a tactel is never pressed, or a phase would fold.
    """
    levels, loads = checks.checked_measurements(sensor, frames, forces)
    camera = sensor.camera
    several = np.flatnonzero((loads != 0).sum(axis=1) > 1)
    if several.size:
        raise InputError(
            f"Frame {several[0]} has several loads; press one tactel in one direction at a time, "
            "or use calibrate, which takes any known loads."
        )
    if never := ", ".join(map(str, np.flatnonzero(~loads.any(axis=0)) // 2 + 1)):
        raise InputError(f"Tactel {never} was not pressed both ways; every column needs a press.")
    if window < 1:
        raise InputError(f"window = {window}: must be at least 1 pixel.")
    even = np.ones(camera.pixels)
    known = imaging or Imaging.known(
        sensor.pixel_positions, camera.amplitude * even, camera.offset * even
    )
    unloaded = ~(loads != 0).any(axis=1)
    offset = levels[unloaded].mean(axis=0) if unloaded.any() else known.offset
    model, half = characterize(sensor), sensor.transducer.length / 2
    drawn = model.influence(np.clip(known.positions, -half, half)).reshape(camera.pixels, -1)
    columns = [
        _column(levels, loads[:, j], offset, known.amplitude, drawn[:, j], window)
        for j in range(loads.shape[1])
    ]
    usable = known.usable & ~stuck_pixels(levels, camera.noise)
    edges = (np.arange(camera.pixels + 1) / camera.pixels - 0.5) * sensor.transducer.length
    return SensorModel(
        sensor=sensor,
        breaks=edges,
        psi=np.stack(columns, axis=1).reshape(camera.pixels, -1, 2),
        provenance={"method": "single presses", "calibration frames": len(levels)},
        imaging=Imaging(
            sensor.pixel_positions,
            np.asarray(known.amplitude, dtype=float),
            np.asarray(offset, dtype=float),
            usable,
            *(known.influence_modes[:0], known.amplitude_modes[:0], known.offset_modes[:0]),
        ),
    )


def _column(
    levels: Array,
    loads: Array,
    offset: Array,
    amplitude: Array,
    drawn: Array,
    window: int,
) -> Array:
    """One column from its presses, shape (P,) [rad/N]."""
    rows = np.flatnonzero(loads)
    total, weight = np.zeros_like(drawn), 0.0
    for load in np.unique(loads[rows]):
        peak = np.abs(drawn * load).max()
        if peak > FOLD:
            raise InputError(
                f"A load of {load:g} N turns the phase by {peak:.2g} rad, which the arcsine folds; "
                f"stay below {abs(load) * FOLD / peak:.2g} N, or use calibrate."
            )
        same = rows[loads[rows] == load]
        mean = uniform_filter1d(levels[same].mean(axis=0) - offset, window, mode="nearest")
        light = np.clip(mean / np.maximum(amplitude, 1e-9), 0, 1)
        phase = _signs(drawn * load, mean) * 2 * np.arcsin(np.sqrt(light))
        share = len(same) * load**2
        total, weight = total + share * phase / load, weight + share
    return total / weight


def _signs(drawn: Array, light: Array) -> Array:
    """Signs of a phase, from the drawn one and an intensity that vanishes where they change."""
    signs = np.sign(drawn)
    zeros = np.flatnonzero(signs[:-1] * signs[1:] < 0) + 1
    edges = [0, *zeros.tolist(), len(drawn)]
    runs = list(pairwise(edges))
    tops = [first + int(np.argmax(np.abs(drawn[first:end]))) for first, end in runs]
    steady = uniform_filter1d(light, SMOOTHING, mode="nearest")
    places = []
    for first, end in pairwise(tops):
        near = max(first, first + int(np.argmin(steady[first:end])) - SMOOTHING)
        places.append(near + int(np.argmin(light[near : near + 2 * SMOOTHING])))
    found = np.empty(len(drawn))
    for (first, _), begin, end in zip(runs, [0, *places], [*places, len(drawn)], strict=True):
        found[begin:end] = signs[first]
    return found
