"""A touch as a script: press, drag along the strip, release."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

PERIOD = 4.0


def touch(
    t: ArrayLike, positions: ArrayLike, force: float = 2.0, friction: float = 0.3
) -> NDArray[np.float64]:
    """Forces of a fingertip that presses, drags towards +x, and lets go; repeats every 4 s.

    Parameters
    ----------
    t : array_like, shape (k,)
        Times [s].
    positions : array_like, shape (n,)
        Of the tactels [m].
    force : float
        Sum of the normal forces while it presses [N].
    friction : float
        Tangential over normal force while it drags.

    Returns
    -------
    ndarray, shape (k, 2, n)
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
    return np.stack([normal, friction * sliding * normal], axis=1)


def _rise(phase: NDArray[np.float64], start: float, end: float) -> NDArray[np.float64]:
    """From 0 to 1 between two phases, without a corner."""
    u = np.clip((phase - start) / (end - start), 0, 1)
    return u * u * (3 - 2 * u)
