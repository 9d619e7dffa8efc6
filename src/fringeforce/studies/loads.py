"""Loads that a study asks about: what a dry finger can do to the skin."""

from __future__ import annotations

import numpy as np

from fringeforce.base.arrays import Array

LARGEST_ANGLE = 20.0
"""Largest angle of a force from the surface normal [degrees]."""
FRICTION = float(np.tan(np.radians(LARGEST_ANGLE)))
"""Largest tangential force over normal force."""
SCATTERED = 16
"""Random maps among the loads on which designs are compared."""


def uniform_load(rng: np.random.Generator, n: int, normal: float) -> Array:
    """One force on all tactels at a random angle, shape (n, 2) [N]."""
    tangential = normal * np.tan(np.radians(rng.uniform(-LARGEST_ANGLE, LARGEST_ANGLE)))
    return np.tile([normal, tangential], (n, 1))


def scattered_load(rng: np.random.Generator, n: int, largest: float) -> Array:
    """Independent forces: normal ones from nothing to the largest, any angle, shape (n, 2) [N]."""
    normal = rng.uniform(0, largest, n)
    angle = np.radians(rng.uniform(-LARGEST_ANGLE, LARGEST_ANGLE, n))
    return np.stack([normal, normal * np.tan(angle)], axis=1)


def load_maps(seed: np.random.SeedSequence, n: int, largest: float) -> Array:
    """Loads on which designs are compared, the same for all that have as many tactels.

    Uniform loads of a third, two thirds and all of the largest at the extreme angles and straight,
    then scattered ones.

    Parameters
    ----------
    seed : SeedSequence
        Seed of the scattered loads.
    n : int
        Number of tactels.
    largest : float
        Largest normal force [N].

    Returns
    -------
    ndarray, shape (k, n, 2)
        Normal and tangential forces [N].
    """
    rng = np.random.default_rng(seed)
    uniform = [
        np.tile([share * largest, share * largest * slope], (n, 1))
        for share in (1 / 3, 2 / 3, 1.0)
        for slope in (-FRICTION, 0.0, FRICTION)
    ]
    return np.array(uniform + [scattered_load(rng, n, largest) for _ in range(SCATTERED)])
