"""A camera that sees an area, and of whose pictures a region is read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, Self

from fringeforce.acquisition.cameras.camera import Block, Camera
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor
from fringeforce.pictures.extraction import sampler_of
from fringeforce.pictures.region import Region


class AreaCamera:
    """The frames of a sensor from a camera of whole pictures.

    Parameters
    ----------
    camera : Camera
        Delivers pictures of shape (rows, columns) or (rows, columns, 3).
    sensor : Sensor or Pad
        Its camera says pixels and bits of the frames.
    region : Region
        Where the sensor is in the pictures.
    """

    patient = False

    def __init__(self, camera: Camera, sensor: Sensor | Pad, region: Region) -> None:
        self.name, self._camera = camera.name, camera
        self._sensor, self._region = sensor, region

    def __enter__(self) -> Self:
        self._camera.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._camera.__exit__(*error)

    def __iter__(self) -> Iterator[Block]:
        sampler = None
        for block in self._camera:
            if sampler is None:
                sampler = sampler_of(self._sensor, self._region, block.lines[0])
            frames = sampler.frames(block.lines, self._sensor.camera.bits)
            yield replace(block, lines=frames)

    def close(self) -> None:
        """End the iteration soon; may be called from another thread."""
        self._camera.close()
