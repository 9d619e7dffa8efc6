"""What readings of small strain miss of forces under large strain, to second order.

A section through neighbouring contacts is solved in a plane: of a strip as its design says, of a
pad in plane strain, as under rows of equal contacts.  Least squares with the linear phase Psi take
its second order f' H f for forces Psi^+ (f' H f), which grow with the square of the forces.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

from fringeforce.base.arrays import Array
from fringeforce.design.pad import Pad
from fringeforce.design.strip import Sensor, Transducer
from fringeforce.mechanics.finite_strain import finite_strip
from fringeforce.mechanics.second_order import Expansion

NEIGHBOURS = 2
"""Contacts on either side of one; farther ones hardly press on its light."""
PATTERNS = 64
"""Load patterns whose mean square is taken, which is then known to a tenth."""
SLOPE = 0.3
"""Largest tangential over normal force of a pattern, as of contacts that stick."""
ELEMENT_ORDER = 3
"""Order of the elements: one more changes the result by a hundredth of it."""
PLACES = 400
"""Places along the section at which the light is looked at."""


def strain_error(sensor: Sensor | Pad) -> Array:
    """Errors of forces that large strain causes, over the square of the largest force, shape (2,).

    Root mean squares of normal and tangential forces, over patterns of neighbouring contacts
    [1/N].  Contacts of a strip without width are as wide as its cover is thick, and those of a skin
    stand side by side.

    Parameters
    ----------
    sensor : Sensor or Pad
        With tactels; a strip that is solved in a plane.
    """
    block, count, pitch, width = sensor.section
    some = min(NEIGHBOURS, (count - 1) // 2)
    return _error(block.model_dump_json(), pitch, min(width, pitch), some).copy()


@lru_cache(maxsize=8)
def _error(stated: str, pitch: float, width: float, some: int) -> Array:
    centres = pitch * np.arange(-some, some + 1)
    transducer = Transducer.model_validate_json(stated).model_copy(update={"strain": "linear"})
    found = Expansion.of(
        finite_strip(transducer, centres, np.full(len(centres), width), order=ELEMENT_ORDER)
    )
    x = transducer.length * (np.arange(PLACES) + 0.5 - PLACES / 2) / PLACES
    first, second = (
        CubicSpline(found.strip.mesh.stations, stress)(x) for stress in (found.first, found.second)
    )
    rng = np.random.default_rng(0)
    forces = rng.uniform(0, 1, (PATTERNS, len(centres), 2))
    forces /= forces[..., 0].max(axis=1)[:, None, None]
    forces[..., 1] = forces[..., 0] * rng.uniform(-SLOPE, SLOPE, forces.shape[:2])
    flat = forces.reshape(PATTERNS, -1)
    missed = np.linalg.lstsq(first, np.einsum("mab,pa,pb->mp", second, flat, flat), rcond=None)[0]
    return np.sqrt(np.square(missed.T.reshape(forces.shape)).mean(axis=(0, 1)))


def strain_deviation(pad: Pad, forces: Array) -> Array:
    """Standard deviations of a pad's forces by large strain, shape (n, 3) [N].

    Parameters
    ----------
    pad : Pad
        With tactels.
    forces : ndarray, shape (n, 3)
        That are read [N]; the largest one near each tactel counts.
    """
    size = np.abs(forces).max(axis=1).reshape(pad.tactels.count)
    padded = np.pad(size, NEIGHBOURS)
    windows = np.lib.stride_tricks.sliding_window_view(padded, (2 * NEIGHBOURS + 1,) * 2)
    largest = windows.max(axis=(2, 3)).ravel()
    normal, tangential = strain_error(pad)
    return np.square(largest)[:, None] * [normal, tangential, tangential]
