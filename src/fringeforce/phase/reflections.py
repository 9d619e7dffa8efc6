"""Neighbouring explanations: mirror images of stretches of the phase.

Where the phase comes near a multiple of pi, noise may hide whether it crosses or turns, and between
two such places it may be the mirror image of what was found.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TURN = 2 * np.pi
TOUCH = 0.6
"""How near a multiple of pi the phase must come for a crossing to be mistaken for a turn [rad]."""
LOSS = 250.0
"""Expected growth of the loss beyond which a mirror image is not worth trying."""
SHIFT = 30.0
"""Squared standard deviations by which a mirror image must differ to be another explanation."""


def reflections(phase: Array, influence: Array, information: Array) -> Array:
    """Changes of the loads that mirror a stretch of the phase at a multiple of pi.

    Every stretch between two neighbouring places (or next but one) where the phase meets the same
    multiple of pi is mirrored, and the change of the loads that follows it best is found by
    least squares; sin^2 p, and with it the information, is the same on both sides of the mirror.

    Parameters
    ----------
    phase : ndarray, shape (P,)
        Phase of an explanation [rad].
    influence : ndarray, shape (P, m)
        Influence matrix.
    information : ndarray, shape (P,)
        Inverse variance of the phase at every pixel [1/rad^2].

    Returns
    -------
    ndarray, shape (k, m)
        Changes of the loads, the likeliest first.
    """
    places = _contacts(phase)
    stretches = [*pairwise(places), *zip(places, places[2:], strict=False)]
    root = np.linalg.cholesky(_normal_matrix(influence, information))
    found = []
    for start, stop in stretches:
        inside = slice(start, stop + 1)
        mirror = np.pi * np.rint((phase[start] + phase[stop]) / TURN)
        if abs(phase[start] - mirror) > TOUCH or abs(phase[stop] - mirror) > TOUCH:
            if start > 0 and stop < len(phase) - 1:
                continue
            mirror = np.pi * np.rint((phase[stop] if start == 0 else phase[start]) / np.pi)
        wanted = 2 * (mirror - phase[inside])
        pull = influence[inside].T @ (information[inside] * wanted)
        half = np.linalg.solve(root, pull)
        loss = information[inside] @ wanted**2 - half @ half
        if loss < LOSS and half @ half > SHIFT:
            found.append((loss, np.linalg.solve(root.T, half)))
    found.sort(key=lambda item: item[0])
    return np.reshape([change for _, change in found], (-1, influence.shape[1]))


def _contacts(phase: Array) -> list[int]:
    """Pixels where the phase meets a multiple of pi or turns near it, and both ends."""
    distance = np.abs(phase - np.pi * np.rint(phase / np.pi))
    lowest = (distance[1:-1] <= distance[:-2]) & (distance[1:-1] < distance[2:])
    inner = np.nonzero(lowest & (distance[1:-1] < TOUCH))[0] + 1
    return [0, *inner.tolist(), len(phase) - 1]


def _normal_matrix(influence: Array, information: Array) -> Array:
    scaled = influence * np.sqrt(information)[:, None]
    matrix = scaled.T @ scaled
    return matrix + 1e-9 * np.trace(matrix) * np.eye(len(matrix))
