"""Pixels that show something else than a load: dirt, a hair, a cable, a glint.

Loads explain all others.  These are left out among neighbours that loads do not explain, and the
rest is explained anew.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, uniform_filter

from fringeforce.estimation.residual_test import FALSE_VERDICT, GROUP, square_limit

Array = NDArray[np.float64]
Pixels = NDArray[np.bool_]

PLAIN = 9.0
"""Squared deviations of a pixel from which it counts no more: single pixels that are broken hide no
others."""
ROUNDS = 8
"""Rounds in which loads and hidden pixels settle; they take two or three."""
MOST = 0.4
"""Largest share of the pixels that may be hidden: of less than that is left, much would fit."""


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
    squares = np.minimum(np.nan_to_num(np.square(left), nan=1.0), PLAIN)
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
