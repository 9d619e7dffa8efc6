"""Neighbouring explanations: mirror images of stretches of the phase.

Where the phase comes near a multiple of pi, noise may hide whether it crosses or turns, and between
two such places it may be the mirror image of what was found.
"""

from __future__ import annotations

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

    Every stretch between two places where the phase meets the same multiple of pi is mirrored, and
    the change of the loads that follows it best is found by least squares; sin^2 p, and with it the
    information, is the same on both sides of the mirror.  An end of the frame may be either place.

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
    first, last, mirror = _stretches(phase, places)
    # sums over the pixels up to each place, of which every stretch is a difference
    powers = information[:, None] * phase[:, None] ** np.arange(3)
    moments = _running(powers, places)
    pulls = (
        _running(influence * powers[:, :1], places),
        _running(influence * powers[:, 1:2], places),
    )
    weight, mean, square = (moments[last] - moments[first]).T
    wanted = 4 * (mirror**2 * weight - 2 * mirror * mean + square)
    level, slope = (pull[last] - pull[first] for pull in pulls)
    root = np.linalg.cholesky(_normal_matrix(influence, information))
    half = np.linalg.solve(root, 2 * (mirror[:, None] * level - slope).T)
    shift = (half**2).sum(axis=0)
    loss = wanted - shift
    likely = np.nonzero((loss < LOSS) & (shift > SHIFT))[0]
    likely = likely[np.argsort(loss[likely])]
    changes = np.linalg.solve(root.T, half[:, likely])
    return np.asarray(changes.T, dtype=np.float64)


def _contacts(phase: Array) -> NDArray[np.intp]:
    """Pixels where the phase meets a multiple of pi or turns near it, and both ends."""
    distance = np.abs(phase - np.pi * np.rint(phase / np.pi))
    lowest = (distance[1:-1] <= distance[:-2]) & (distance[1:-1] < distance[2:])
    inner = np.nonzero(lowest & (distance[1:-1] < TOUCH))[0] + 1
    return np.concatenate([[0], inner, [len(phase)]])


def _stretches(
    phase: Array, places: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    """Pairs of places at the same multiple of pi, and that multiple [rad].

    The whole frame is no stretch: its mirror image is the same load with the other sign.
    """
    multiple = np.rint(phase[np.minimum(places, len(phase) - 1)] / np.pi)
    first, last = np.triu_indices(len(places), k=1)
    starts, ends = first == 0, last == len(places) - 1
    known = np.where(starts, multiple[last], multiple[first])
    fits = (multiple[first] == multiple[last]) | starts | ends
    fits &= ~(starts & ends)
    return first[fits], last[fits], np.pi * known[fits]


def _running(values: Array, places: NDArray[np.intp]) -> Array:
    """Sums of the rows of `values` before each place."""
    sums = np.add.reduceat(values, places[:-1], axis=0)
    return np.concatenate([np.zeros_like(sums[:1]), np.cumsum(sums, axis=0)])


def _normal_matrix(influence: Array, information: Array) -> Array:
    scaled = influence * np.sqrt(information)[:, None]
    matrix = scaled.T @ scaled
    return matrix + 1e-9 * np.trace(matrix) * np.eye(len(matrix))
