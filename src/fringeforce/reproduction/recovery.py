"""The paper's recovered forces beside ours, over many noisy frames, and the bound of one frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.contacts.loads import PAPER_ANGLE, PAPER_LOAD
from fringeforce.estimation.bounds import cramer_rao_bound
from fringeforce.reading.reading import Reading
from fringeforce.reading.strip_reader import StripFrameReader
from fringeforce.reproduction.example import PaperExample

PAPER_MAGNITUDES = (0.976, 1.02, 1.05, 0.97, 0.963, 0.98, 0.973, 0.967, 0.953, 0.943, 1.056)
PAPER_ANGLES = (10.6, 9.7, 9.8, 10.4, 9.5, 10.5, 10.4, 10.3, 10.2, 10.7, 9.7)
"""Section V of the paper, tactels 1 to 11 [N], [degrees]."""
SEEDS, AVERAGED = 100, 15
"""Noisy frames that are read, and how many of them one average takes."""


@dataclass(frozen=True, eq=False)
class Recovery:
    """Readings of many noisy frames of the paper's example, Case 1.

    Attributes
    ----------
    reading : Reading
        Reading of the frame of Figure 9.
    bound : ndarray, shape (n, 2)
        Smallest standard deviations that one frame allows [N].
    magnitude_error, angle_error : ndarray, shape (seeds,)
        Largest relative errors over the tactels, for every seed of the noise.
    averaged_magnitude, averaged_angle : float
        The same for the mean of `AVERAGED` frames' readings, in the median.
    """

    reading: Reading
    bound: Array
    magnitude_error: Array
    angle_error: Array
    averaged_magnitude: float
    averaged_angle: float


def recovered(example: PaperExample) -> Recovery:
    """Read the paper's example from `SEEDS` noisy frames."""
    model = example.models["free"]
    reader = StripFrameReader(model)
    readings = [reader.read(model.expose(example.forces, rng=seed)) for seed in range(SEEDS)]
    forces = np.array([reading.forces for reading in readings])
    phase = reader.influence @ example.forces.ravel()
    magnitude, angle = worst_errors(forces)
    groups = forces[: SEEDS // AVERAGED * AVERAGED].reshape(-1, AVERAGED, *forces.shape[1:])
    mean_magnitude, mean_angle = worst_errors(groups.mean(axis=1))
    return Recovery(
        reading=readings[0],
        bound=cramer_rao_bound(phase, reader.influence, reader.model.response).reshape(-1, 2),
        magnitude_error=magnitude,
        angle_error=angle,
        averaged_magnitude=float(np.median(mean_magnitude)),
        averaged_angle=float(np.median(mean_angle)),
    )


def worst_errors(forces: Array) -> tuple[Array, Array]:
    """Largest relative errors of magnitude and angle over the tactels, shape (k,) each."""
    magnitude = np.hypot(forces[..., 0], forces[..., 1])
    angle = np.degrees(np.arctan2(forces[..., 1], forces[..., 0]))
    sizes, turns = np.abs(magnitude / PAPER_LOAD - 1), np.abs(angle / PAPER_ANGLE - 1)
    return sizes.max(axis=1), turns.max(axis=1)
