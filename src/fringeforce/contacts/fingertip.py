"""Touches as scripts: a strip is pressed and dragged along, a pad pressed, rolled and slid over."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

PERIOD, PAD_PERIOD = 4.0, 6.0
"""After which the touch of a strip, and that of a pad, begin again [s]."""


def touch(
    t: ArrayLike, positions: ArrayLike, force: float = 2.0, friction: float = 0.3
) -> NDArray[np.float64]:
    """Forces of a fingertip that presses, drags towards +x, and lets go; repeats every 4 s.

    Parameters
    ----------
    t : array_like, shape (k,)
        Times [s].
    positions : array_like, shape (n,)
        Positions of the tactels [m].
    force : float
        Sum of the normal forces while it presses [N].
    friction : float
        Tangential over normal force while it drags.

    Returns
    -------
    ndarray, shape (k, n, 2)
        Normal and tangential forces [N], smooth in time.
    """
    x = np.asarray(positions, dtype=float)
    phase = np.mod(np.atleast_1d(np.asarray(t, dtype=float)) / PERIOD, 1)[:, None]
    pressed = _rise(phase, 0.1, 0.25) - _rise(phase, 0.75, 0.9)
    dragged = _rise(phase, 0.3, 0.7)
    sliding = _rise(phase, 0.28, 0.35) - _rise(phase, 0.65, 0.72)
    span, middle = np.ptp(x), x.mean()
    place = middle + 0.5 * span * (dragged - 0.5)
    width = max(0.1 * span, 1e-9)
    shape = np.exp(-0.5 * ((x - place) / width) ** 2)
    normal = force * pressed * shape / shape.sum(axis=1, keepdims=True)
    return np.stack([normal, friction * sliding * normal], axis=2)


def pad_touch(
    t: ArrayLike, places: ArrayLike, force: float = 5.0, friction: float = 0.3
) -> NDArray[np.float64]:
    """Forces of a fingertip that presses, rolls, slides, and lets go; repeats every 6 s.

    It presses left of the middle, rolls towards +y, which the contact follows while shear holds
    it back, slides along +x, rolls back and lifts.

    Parameters
    ----------
    t : array_like, shape (k,)
        Times [s].
    places : array_like, shape (n, 2)
        Places of the tactels [m].
    force : float
        Sum of the normal forces while it presses [N].
    friction : float
        Tangential over normal force while it slides; half of it while it rolls.

    Returns
    -------
    ndarray, shape (k, n, 3)
        N, T_x, T_y [N], smooth in time.
    """
    tactels = np.asarray(places, dtype=float)
    middle, span = tactels.mean(axis=0), np.ptp(tactels, axis=0)
    phase = np.mod(np.atleast_1d(np.asarray(t, dtype=float)) / PAD_PERIOD, 1)
    pressed = _rise(phase, 0.04, 0.14) - _rise(phase, 0.84, 0.94)
    rolled = _rise(phase, 0.18, 0.36) - _rise(phase, 0.68, 0.82)
    slid = _rise(phase, 0.4, 0.66)
    sliding = _rise(phase, 0.38, 0.44) - _rise(phase, 0.62, 0.68)
    along = middle + span * np.stack([0.5 * (slid - 0.5), 0.3 * (rolled - 0.5)], axis=1)
    width = max(0.12 * float(span.max()), 1e-9)
    squares = ((tactels - along[:, None]) ** 2).sum(axis=2)
    shape = np.exp(-0.5 * squares / width**2)
    normal = force * pressed[:, None] * shape / shape.sum(axis=1, keepdims=True)
    drag = friction * np.stack([sliding, -0.5 * rolled * (1 - sliding)], axis=1)
    return normal[:, :, None] * np.concatenate([np.ones((len(drag), 1)), drag], axis=1)[:, None]


def _rise(phase: NDArray[np.float64], start: float, end: float) -> NDArray[np.float64]:
    """From 0 to 1 between two phases, without a corner."""
    u = np.clip((phase - start) / (end - start), 0, 1)
    return u * u * (3 - 2 * u)
