"""Picture files to the frames of a design."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.pictures.files import load_pictures
from fringeforce.pictures.imaging import ImageSampler
from fringeforce.pictures.region import Region
from fringeforce.pictures.sampling import Sampler, channels_of

Paths = Iterable[str | os.PathLike[str]]
TURNED = 1.0
"""Most by which the analysers of a polarisation camera may be turned against a pad [degrees]."""
FIRST = 16
"""Pictures from which the strip is found and the noise is told."""


def first_pictures(paths: Paths, count: int = FIRST) -> list[NDArray[Any]]:
    """The first pictures of some files, `count` at most."""
    return [picture for picture, _ in islice(load_pictures(paths), count)]


def bits_of(pictures: Sequence[NDArray[Any]], stated: int | None, designed: int) -> int:
    """Bits of a grey level: as stated, 8 of bytes, otherwise those of the design.

    Raises
    ------
    InputError
        If 16 bits of storage may hold fewer, and neither option nor design says how many.
    """
    if stated is not None:
        return stated
    if all(picture.dtype == np.uint8 for picture in pictures):
        return 8
    if designed <= 8:
        raise InputError(
            "The pictures store 16 bits, of which cameras often use 10, 12 or 14; state the "
            "camera's with --bits."
        )
    return designed


def sampler_of(sensor: Sensor | Pad, region: Region, picture: NDArray[Any]) -> Sampler:
    """What takes the frames of a sensor from pictures like this one.

    Raises
    ------
    InputError
        If the pictures do not tell the sensor's channels apart, or a polarisation camera is turned.
    """
    seen: Any = sensor.camera
    light: Any = sensor.polariscope
    if sensor.dimensions == 1:
        return Sampler(region, seen.pixels, channels_of(light, region, picture.ndim == 3))
    if seen.kind != "polarisation":
        return ImageSampler(region, seen.pixels, channels_of(light, region, picture.ndim == 3))
    turned = (region.tilt + 90) % 180 - 90
    if picture.ndim == 3 or region.mosaic or abs(turned) > TURNED:
        raise InputError(
            f"The design has a polarisation camera, whose raw pictures are grey, with no mosaic "
            f"stated and along the pad within {TURNED:g} degrees; these have {picture.ndim} axes, "
            f'mosaic = "{region.mosaic}" and a tilt of {region.tilt:.1f} degrees.'
        )
    return ImageSampler(region, seen.pixels, analysers=True)


def extract_frames(
    paths: Paths, sensor: Sensor | Pad, region: Region
) -> tuple[NDArray[np.unsignedinteger], Array | None]:
    """Frames of a design from pictures.

    Parameters
    ----------
    paths : iterable of path
        As of `load_pictures`.
    sensor : Sensor or Pad
        Its camera says pixels and bits of the frames.
    region : Region
        Where the sensor is.

    Returns
    -------
    frames : ndarray, shape (k, pixels) or (k, channels, pixels), or (k, ..., rows, columns)
        Grey levels with the bits of the design's camera.
    times : ndarray, shape (k,), or None
        When they were exposed, since the start of the video [s]; None if a file does not say.
    """
    sampler, frames, times = None, [], []
    for picture, time in load_pictures(paths):
        if sampler is None:
            sampler = sampler_of(sensor, region, picture)
        frames.append(sampler.frames([picture], sensor.camera.bits)[0])
        times.append(time)
    if not frames:
        raise InputError("There are no pictures to take lines from.")
    known = [time for time in times if time is not None]
    increasing = len(known) == len(times) and bool((np.diff(known) > 0).all())
    return np.array(frames), np.array(known) if increasing else None
