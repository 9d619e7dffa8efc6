"""What is written down of the loads of a bench: contacts at places, or at tactels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.design.strip import Sensor


@dataclass(frozen=True, eq=False)
class KnownLoads:
    """Contacts of F frames, k at most in each.

    Attributes
    ----------
    places : ndarray, shape (F, k)
        Along the strip [m]; not a number where a frame has fewer contacts.
    forces : ndarray, shape (F, k, 2)
        Normal and tangential [N]; zero there.
    """

    places: Array
    forces: Array

    @classmethod
    def at_tactels(cls, sensor: Sensor, forces: Array) -> KnownLoads:
        """Loads of tactels, shape (F, n, 2) [N]; those without any are not touched."""
        touched = np.abs(forces).max(axis=2) > 0
        most = max(int(touched.sum(axis=1).max()), 1)
        places, found = np.full((len(forces), most), np.nan), np.zeros((len(forces), most, 2))
        for row, (load, where) in enumerate(zip(forces, touched, strict=True)):
            count = int(where.sum())
            places[row, :count] = sensor.tactels.positions[where]
            found[row, :count] = load[where]
        return cls(places, found)
