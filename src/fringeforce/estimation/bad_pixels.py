"""Pixels that tell nothing of the phase: the one rule, for single frames and for many.

A pixel is bad if its squared residuals in all frames add up to more than noise allows, or, before
anything is fitted, if it stands out from both of its neighbours as no fringe does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.likelihood import Response
from fringeforce.estimation.residual_test import square_limit

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

BAD = 6e-7
"""Chance that noise alone makes a sound pixel bad: of a frame of 2048 pixels, one in a thousand."""
OUTLIER = float(np.sqrt(square_limit(1, BAD)))
"""Residual of one frame, in units of its noise, beyond which a pixel is bad: five of them."""
STEEPEST = 3.0
"""Differences of its neighbours by which a pixel on a fringe lies off their mean at most."""


def outlying(residuals: Array, usual: Array | float = 1.0) -> Mask:
    """Pixels that fit worse than noise does by chance, shape (P,).

    Parameters
    ----------
    residuals : ndarray, shape (F, P)
        Of all frames, in units of the noise.
    usual : float or ndarray, shape (P,)
        Mean square that is usual around a pixel, if that is larger than noise.
    """
    limit = square_limit(len(residuals), BAD)
    return (residuals**2).sum(axis=0) > limit * np.maximum(usual, 1.0)


def isolated(levels: Array, response: Response) -> Mask:
    """Single pixels of a frame that stand out from both neighbours as no fringe does, shape (P,).

    Parameters
    ----------
    levels : ndarray, shape (P,)
        Grey levels.
    response : Response
        Of the camera.
    """
    middle = (levels[:-2] + levels[2:]) / 2
    apart = np.abs(levels[2:] - levels[:-2])
    alone = np.abs(levels[1:-1] - middle)
    inner = response.at(slice(1, -1))
    # the noise of three pixels, of which two count half
    limit = np.maximum(OUTLIER * np.sqrt(1.5 * inner.variance), inner.amplitude / 4)
    found = np.zeros(len(levels), dtype=bool)
    found[1:-1] = (alone > limit) & (alone > STEEPEST * apart)
    return found


def stuck_pixels(levels: Array, noise: Array | float) -> Mask:
    """Pixels that vary less from frame to frame than their own noise, shape (P,).

    Parameters
    ----------
    levels : ndarray, shape (F, P)
        Grey levels, of all channels in turn.
    noise : float or ndarray, shape (C,)
        Of all channels or each, grey levels.
    """
    own = np.atleast_1d(noise)
    own = np.repeat(own, levels.shape[1] // len(own))
    return (own > 0.5) & (levels.std(axis=0) < own / 6)
