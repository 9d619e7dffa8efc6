"""Pixels that show something else than a load: dirt, a hair, a cable, a glint.

Loads explain all others.  These are left out among neighbours that loads do not explain, and the
rest is explained anew.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, uniform_filter

from fringeforce.estimation.residual_test import FALSE_VERDICT, GROUP, square_limit

Array = NDArray[np.float64]
Pixels = NDArray[np.bool_]

FARTHEST = 9.0
"""Squared deviations of a pixel from which it counts no more: single pixels that are broken hide no
others."""
ROUNDS = 8
"""Rounds in which loads and hidden pixels settle; they take two or three."""
MOST = 0.4
"""Largest share of the pixels that may be hidden: of less than that is left, much would fit."""


class Explained(NamedTuple):
    """Pixels of a frame as loads explain them at best.

    Attributes
    ----------
    left : ndarray, shape (channels, pixels) or (channels, rows, columns)
        Residuals in units of the noise.
    noise : bool
        Whether they are no more than that.
    evidence : float
        Logarithm of the posterior mass, less a constant of the frame.
    """

    left: Array
    noise: bool
    evidence: float


class Hidden(NamedTuple):
    """Pixels that show something else, where loads explain all others.

    Attributes
    ----------
    pixels : ndarray of bool, shape (channels * P,)
        Which.
    evidence : float
        Logarithm of the posterior mass, if these may show any grey level.
    """

    pixels: Pixels
    evidence: float


def hidden_pixels(
    explained: Callable[[Pixels], Explained | None], used: Pixels, bits: int, variance: float
) -> Hidden | None:
    """What is left out of a frame until loads explain the rest, or none.

    Parameters
    ----------
    explained : callable
        Explains some pixels of the frame at best; none if it finds no load.
    used : ndarray of bool, shape (channels * P,)
        Pixels that count.
    bits : int
        Of the converter.
    variance : float
        Of the noise [grey levels squared].
    """
    shown = used
    for _ in range(ROUNDS):
        found, hidden = explained(shown), used & ~shown
        if found is None:
            return None
        if found.noise:
            cost = any_level(int(hidden.sum()), bits, variance)
            return Hidden(hidden, found.evidence - cost) if hidden.any() else None
        more = np.broadcast_to(unlike(found.left), found.left.shape).ravel()
        if not (shown & more).any() or (shown & ~more).sum() < (1 - MOST) * used.sum():
            return None
        shown = shown & ~more
    return None


def unlike(left: Array) -> Pixels:
    """Pixels among neighbours that loads do not explain, in any channel.

    Parameters
    ----------
    left : ndarray, shape (channels, pixels) or (channels, rows, columns)
        Residuals in units of the noise; not finite where a pixel is not used.

    Returns
    -------
    ndarray of bool, shape (pixels,) or (rows, columns)
        A little more than those.
    """
    side = round(GROUP ** (1 / (left.ndim - 1)))
    squares = np.minimum(np.nan_to_num(np.square(left), nan=1.0), FARTHEST)
    mean = uniform_filter(squares, (0, *[side] * (left.ndim - 1)))
    far = (mean > square_limit(GROUP, FALSE_VERDICT) / GROUP).any(axis=0)
    return np.asarray(binary_dilation(far, iterations=side // 2))


def any_level(hidden: int, bits: int, variance: float) -> float:
    """Logarithm of the evidence that hidden pixels cost, which may show any grey level.

    Parameters
    ----------
    hidden : int
        How many.
    bits : int
        Of the converter.
    variance : float
        Of the noise [grey levels squared].
    """
    return hidden * math.log(2.0**bits / math.sqrt(2 * math.pi * variance))
