"""A touch as a script: a fingertip presses, rolls where there is room, slides, and lets go."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.contacts.press import Press

PERIODS, FORCES = {1: 4.0, 2: 6.0}, {1: 2.0, 2: 5.0}
"""After which the touch begins again [s], and its normal force [N], on a line and on a plane."""
WIDTHS = {1: 0.12, 2: 0.25}
"""Width of the contact on the skin of a strip and of a pad at its full force, over the extent."""
LINEAR = 0.1
"""Largest mean pressure of it over the modulus of the cover; linear mechanics bear no more."""


def fingertip_forces(
    t: ArrayLike, places: ArrayLike, force: float | None = None, friction: float = 0.3
) -> Array:
    """Forces of a fingertip that presses, rolls, slides, and lets go, again and again.

    It presses left of the middle, rolls towards +y, which the contact follows while shear holds
    it back, slides along +x, rolls back and lifts.  On a strip it does not roll.

    Parameters
    ----------
    t : array_like, shape (k,)
        Times [s]; it repeats after `PERIODS`.
    places : array_like, shape (n,) or (n, 1), or (n, 2) of a pad
        Places of the tactels [m].
    force : float, optional
        Sum of the normal forces while it presses [N]; `FORCES` if not given.
    friction : float
        Tangential over normal force while it slides; half of it while it rolls.

    Returns
    -------
    ndarray, shape (k, n, components)
        Forces [N], smooth in time.
    """
    tactels = np.asarray(places, dtype=float)
    tactels = tactels.reshape(len(tactels), -1)
    dimensions = tactels.shape[1]
    middle, span = tactels.mean(axis=0), np.ptp(tactels, axis=0)
    pressed, way, drag = _touch(t, dimensions, friction)
    width = max(0.12 * float(span.max()), 1e-9)
    squares = ((tactels - (middle + span * way)[:, None]) ** 2).sum(axis=2)
    shape = np.exp(-0.5 * squares / width**2)
    total = FORCES[dimensions] if force is None else force
    normal = total * pressed[:, None] * shape / shape.sum(axis=1, keepdims=True)
    return normal[:, :, None] * np.concatenate([np.ones((len(drag), 1)), drag], axis=1)[:, None]


def fingertip_presses(
    t: ArrayLike,
    extent: float | tuple[float, float],
    force: float | None = None,
    friction: float = 0.3,
) -> list[list[Press]]:
    """What the fingertip presses on a skin, at each time; on that of a pad it rolls, too.

    Parameters
    ----------
    t : array_like, shape (k,)
        Times [s].
    extent : float or (float, float)
        Length of the skin of a strip, or sides of that of a pad [m].
    force : float, optional
        Normal force while it presses [N]; `FORCES` if not given.
    friction : float
        Tangential over normal force while it slides.
    """
    sides = np.atleast_1d(extent)
    dimensions = len(sides)
    pressed, way, drag = _touch(t, dimensions, friction)
    total = FORCES[dimensions] if force is None else force
    width = WIDTHS[dimensions] * float(sides.min())

    def press(share: float, at: list[float], pull: list[float]) -> Press:
        return Press(
            x=at[0],
            y=at[1] if dimensions == 2 else None,
            normal=total * share,
            tangential=(pull[0], pull[1]) if dimensions == 2 else pull[0],
            # as of a cylinder, or a sphere, on a half-space
            width=width * share ** (1 / (1 + dimensions)),
            friction=2 * friction,
        )

    steps = zip(pressed.tolist(), way * sides, drag * total * pressed[:, None], strict=True)
    return [
        [press(share, at.tolist(), pull.tolist())] if share > 0 else [] for share, at, pull in steps
    ]


def bearable(
    extent: float | tuple[float, float], modulus: float, across: float | None = None
) -> float:
    """Force of the fingertip that a skin bears within linear mechanics, `FORCES` at most.

    Parameters
    ----------
    extent : float or (float, float)
        Length of the skin of a strip, or sides of that of a pad [m].
    modulus : float
        Of its cover [Pa].
    across : float, optional
        Width of the strip [m].

    Returns
    -------
    float
        [N].
    """
    dimensions = np.size(extent)
    width = WIDTHS[dimensions] * float(np.min(extent))
    area = np.pi / 4 * width**2 if across is None else width * across
    return min(FORCES[dimensions], LINEAR * modulus * area)


def _touch(t: ArrayLike, dimensions: int, friction: float) -> tuple[Array, Array, Array]:
    """Share of the force (k,), way in spans and tangential over normal force (k, dimensions)."""
    phase = np.mod(np.atleast_1d(np.asarray(t, dtype=float)) / PERIODS[dimensions], 1)
    pressed = _rise(phase, 0.04, 0.14) - _rise(phase, 0.84, 0.94)
    rolled = _rise(phase, 0.18, 0.36) - _rise(phase, 0.68, 0.82)
    slid = _rise(phase, 0.4, 0.66)
    sliding = _rise(phase, 0.38, 0.44) - _rise(phase, 0.62, 0.68)
    way = np.stack([0.5 * (slid - 0.5), 0.3 * (rolled - 0.5)], axis=1)[:, :dimensions]
    drag = friction * np.stack([sliding, -0.5 * rolled * (1 - sliding)], axis=1)[:, :dimensions]
    return pressed, way, drag


def _rise(phase: Array, start: float, end: float) -> Array:
    """From 0 to 1 between two phases, without a corner."""
    u = np.clip((phase - start) / (end - start), 0, 1)
    return u * u * (3 - 2 * u)
