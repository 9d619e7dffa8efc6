"""What the numbers of a sensor's readings are: components of the force on every tactel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.models.pad import COMPONENTS as PAD_COMPONENTS
from fringeforce.models.pad import PadModel
from fringeforce.models.strip import COMPONENTS, SensorModel

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Components:
    """Components of the force, and where the tactels lie.

    Attributes
    ----------
    names : tuple of str
        Names of the components: two of a strip, three of a pad.
    places : ndarray, shape (n,), or (n, 2) of a pad
        Places of the tactels [m].
    """

    names: tuple[str, ...]
    places: Array

    @classmethod
    def of(cls, model: SensorModel | PadModel) -> Components:
        """Components of a sensor's forces."""
        if isinstance(model, PadModel):
            return cls(PAD_COMPONENTS, model.sensor.tactels.places)
        return cls(COMPONENTS, model.sensor.tactels.positions)

    @property
    def pad(self) -> bool:
        """Whether the tactels cover a plane."""
        return self.places.ndim == 2

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of the forces of one line or image: tactels and components."""
        return len(self.places), len(self.names)

    @property
    def labels(self) -> list[str]:
        """A name for every number of a line or image, in the order of memory."""
        numbers = range(1, len(self.places) + 1)
        return [f"{name}_{tactel}" for tactel in numbers for name in self.names]
