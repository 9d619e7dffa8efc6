"""Neighbouring explanations: mirror images of stretches of the phase.

Where the phase comes near a multiple of pi, noise may hide whether it crosses or turns, and between
two such places it may be the mirror image of what was found.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

TOUCH = 0.6
"""How near a multiple of pi the phase must come for a crossing to be mistaken for a turn [rad]."""
KNEE = (0.05, 0.3)
"""And where it only runs along one: nearer, it meets it [rad]."""
DIFFERENT_IMAGE = 30.0
"""Squared standard deviations by which a mirror image must differ to be another explanation."""
EQUAL_LOSS = 0.01
"""Difference of two losses below which they are equal: it says nothing, and rounding may cause it.

Both sides of one place at zero, for one, leave loads that differ in their sign alone."""


def mirror_images(
    phase: Array,
    columns: Array,
    information: Array,
    precision: Array | None = None,
    growth: float = np.inf,
) -> tuple[Array, Array, Array]:
    """Changes of any unknowns that mirror a stretch of the phase, and what the loss grows by.

    Parameters
    ----------
    phase, columns, information
        As of `reflections`; the columns are of m unknowns.
    precision : ndarray, shape (m,), optional
        Of the unknowns before the frame; none if not given.
    growth : float
        Expected growth of the loss beyond which an image is left out.

    Returns
    -------
    changes : ndarray, shape (k, m)
        Of the unknowns, the likeliest first; equals in the order of their stretches.
    losses : ndarray, shape (k,)
        Growth that each is expected to cause.
    turned : ndarray, shape (k, n_pixels)
        Change of the phase that each is for: its stretch mirrored, nothing elsewhere [rad].
    """
    scaled = columns * np.sqrt(information)[:, None]
    normal = scaled.T @ scaled
    if precision is None:
        normal += 1e-9 * np.trace(normal) * np.eye(len(normal))
    else:
        normal += np.diag(precision)
    root = np.linalg.inv(np.linalg.cholesky(normal))
    places = _contacts(phase)
    moments, pulls = _running(phase, np.ascontiguousarray(columns), information, places)
    # what each place pulls at the unknowns, in their deviations
    half, loss, stretch = _mirrored(phase, places, moments, pulls @ root.T)
    likely = _distinct(half, _ordered(loss)[: np.count_nonzero(loss < growth)])
    turned = np.zeros((len(likely), len(phase)))
    for change, (begin, end, multiple) in zip(turned, stretch[likely], strict=True):
        change[begin:end] = 2 * (np.pi * multiple - phase[begin:end])
    return np.asarray(half[likely] @ root, dtype=np.float64), loss[likely], turned


def _ordered(loss: Array) -> NDArray[np.intp]:
    """Numbers of losses, the smallest first, equals as they come."""
    order = np.argsort(loss, kind="stable")
    level = np.zeros(len(loss), dtype=np.intp)
    np.cumsum(loss[order[1:]] > loss[order[:-1]] + EQUAL_LOSS, out=level[1:])
    return order[np.lexsort((order, level))]


@njit(cache=True, error_model="numpy", nogil=True)
def _distinct(changes, order):
    """Numbers, in their order, of changes that differ from all before by another explanation.

    Where the phase runs along a multiple of pi there are many stretches that end beside each other.
    """
    kept, count = np.empty_like(order), 0
    for i in order:
        near = False
        for j in kept[:count]:
            apart = 0.0
            for k in range(changes.shape[1]):
                apart += (changes[i, k] - changes[j, k]) ** 2
            if apart <= DIFFERENT_IMAGE:
                near = True
                break
        if not near:
            kept[count] = i
            count += 1
    return kept[:count]


@njit(cache=True, error_model="numpy", nogil=True)
def _contacts(phase):
    """Pixels where the phase meets a multiple of pi, turns or runs along near it, and both ends."""
    places = np.empty(len(phase) + 1, np.int64)
    places[0], count = 0, 1
    distance = np.abs(phase - np.pi * np.rint(phase / np.pi))
    for k in range(1, len(phase) - 1):
        here = distance[k]
        if here >= TOUCH:
            continue
        met = here <= distance[k - 1] and here < distance[k + 1]
        if met or (KNEE[0] < here < KNEE[1] and _runs_along(phase, k)):
            places[count] = k
            count += 1
    places[count] = len(phase)
    return places[: count + 1]


@njit(cache=True, error_model="numpy", nogil=True)
def _runs_along(phase, k):
    """Whether the phase is least steep from one pixel to the next, without a turn."""
    if k > len(phase) - 3:
        return False
    before, here = phase[k] - phase[k - 1], phase[k + 1] - phase[k]
    after = phase[k + 2] - phase[k + 1]
    same = before * here > 0 and here * after > 0
    return same and abs(here) <= abs(before) and abs(here) < abs(after)


@njit(cache=True, error_model="numpy", nogil=True)
def _running(phase, influence, information, places):
    """Sums over the pixels before each place, shapes (places, 3) and (places, 2, m).

    Of the information times powers of the phase; and times the first two of them and the influence.
    """
    moments = np.zeros((len(places), 3))
    pulls = np.zeros((len(places), 2, influence.shape[1]))
    for i in range(1, len(places)):
        for part in range(3):
            moments[i, part] = moments[i - 1, part]
        for j in range(influence.shape[1]):
            pulls[i, 0, j], pulls[i, 1, j] = pulls[i - 1, 0, j], pulls[i - 1, 1, j]
        for k in range(places[i - 1], places[i]):
            weight = information[k]
            pulled = weight * phase[k]
            moments[i, 0] += weight
            moments[i, 1] += pulled
            moments[i, 2] += pulled * phase[k]
            for j in range(influence.shape[1]):
                pulls[i, 0, j] += weight * influence[k, j]
                pulls[i, 1, j] += pulled * influence[k, j]
    return moments, pulls


@njit(cache=True, error_model="numpy", nogil=True)
def _mirrored(phase, places, moments, pulls):
    """Changes of the loads in their deviations, shape (k, m), and what the loss grows by, (k,).

    And what is mirrored, shape (k, 3): first pixel, the one behind the last, multiple of pi.

    Infinite for what is no other explanation.  The whole frame is no stretch: its mirror image is
    the same load with the other sign.
    """
    ends, size = len(places) - 1, pulls.shape[2]
    multiple = np.rint(phase[np.minimum(places, len(phase) - 1)] / np.pi).astype(np.int64)
    changes = np.empty((ends * (ends + 1) // 2, size))
    stretch = np.empty((len(changes), 3), np.int64)
    loss, count = np.full(len(changes), np.inf), 0
    for i in range(ends):
        for j in range(i + 1, ends + 1):
            whole, open_ended = i == 0 and j == ends, i == 0 or j == ends
            if whole or not (open_ended or multiple[i] == multiple[j]):
                continue
            mirror = np.pi * (multiple[j] if i == 0 else multiple[i])
            weight, mean, square = moments[j] - moments[i]
            wanted = 4 * (mirror**2 * weight - 2 * mirror * mean + square)
            shift = 0.0
            for k in range(size):
                level, slope = pulls[j, 0, k] - pulls[i, 0, k], pulls[j, 1, k] - pulls[i, 1, k]
                changes[count, k] = 2 * (mirror * level - slope)
                shift += changes[count, k] ** 2
            if shift > DIFFERENT_IMAGE:
                loss[count] = wanted - shift
                stretch[count, 0], stretch[count, 1] = places[i], places[j]
                stretch[count, 2] = multiple[j] if i == 0 else multiple[i]
                count += 1
    return changes[:count], loss[:count], stretch[:count]
