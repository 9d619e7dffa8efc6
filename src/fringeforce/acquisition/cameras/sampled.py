"""Lines of a strip out of the pictures of any camera."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Self

from fringeforce.acquisition.cameras.camera import Block, Camera
from fringeforce.design.strip import Sensor
from fringeforce.pictures.region import Region
from fringeforce.pictures.sampling import Sampler, channels_of


@dataclass(frozen=True, eq=False)
class SampledCamera:
    """A camera whose pictures are sampled along a strip.

    Parameters
    ----------
    pictures : Camera
        Delivers images, of three colours or not.
    sensor : Sensor
        Its camera says pixels and bits of the lines.
    region : Region
        Where the strip is.
    """

    pictures: Camera
    sensor: Sensor
    region: Region

    @property
    def name(self) -> str:
        """What to call it."""
        return self.pictures.name

    @property
    def patient(self) -> bool:
        """Whether it waits for whoever reads."""
        return self.pictures.patient

    def __enter__(self) -> Self:
        self.pictures.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self.pictures.__exit__(*error)

    def __iter__(self) -> Iterator[Block]:
        seen, light, sampler = self.sensor.camera, self.sensor.polariscope, None
        for block in self.pictures:
            if sampler is None:
                colour = block.lines.ndim == 4
                sampler = Sampler(self.region, seen.pixels, channels_of(light, self.region, colour))
            yield replace(block, lines=sampler.frames(block.lines, seen.bits))

    def close(self) -> None:
        """End the iteration soon; may be called from another thread."""
        self.pictures.close()
