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
    pulled = information * phase
    powers = np.stack([information, pulled, pulled * phase], axis=1)
    moments, pulls = _running(powers, influence, places)
    weight, mean, square = (moments[last] - moments[first]).T
    wanted = 4 * (mirror**2 * weight - 2 * mirror * mean + square)
    level, slope = np.moveaxis(pulls[last] - pulls[first], 1, 0)
    root = np.linalg.inv(np.linalg.cholesky(_normal_matrix(influence, information)))
    half = root @ (2 * (mirror[:, None] * level - slope).T)
    shift = (half**2).sum(axis=0)
    loss = wanted - shift
    likely = np.nonzero((loss < LOSS) & (shift > SHIFT))[0]
    likely = likely[np.argsort(loss[likely])]
    return np.asarray(half[:, likely].T @ root, dtype=np.float64)


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


def _running(powers: Array, influence: Array, places: NDArray[np.intp]) -> tuple[Array, Array]:
    """Sums over the pixels before each place: of three powers, and of two times the influence."""
    moments = np.zeros((len(places), 3))
    pulls = np.zeros((len(places), 2, influence.shape[1]))
    for k, (start, end) in enumerate(pairwise(places), start=1):
        moments[k] = powers[start:end].sum(axis=0)
        pulls[k] = powers[start:end, :2].T @ influence[start:end]
    return moments.cumsum(axis=0), pulls.cumsum(axis=0)


def _normal_matrix(influence: Array, information: Array) -> Array:
    scaled = influence * np.sqrt(information)[:, None]
    matrix = scaled.T @ scaled
    return matrix + 1e-9 * np.trace(matrix) * np.eye(len(matrix))
