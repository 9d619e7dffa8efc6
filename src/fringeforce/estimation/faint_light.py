"""What loads add to a frame of no contact as long as they are faint: which light, in which space.

The grey levels of small phases p are nearly quadratic in them, and p is smooth along the strip, so
that all the light that faint loads can add lies in a space of a few dozen dimensions.  No load
explains a frame better than no contact by more than what the residuals have in that space.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.frame_exposure import expose, node_phase
from fringeforce.estimation.frame_model import FrameModel

Array = NDArray[np.float64]

SAMPLES = 600
"""Frames of faint loads whose light spans the space: several for each of its dimensions, which are
24 for eleven tactels and 58 for thirty-two."""
LEFT_OUT = 0.3
"""Length of what the space leaves out of a frame of faint loads, root mean square, in deviations of
one pixel's noise: it changes no sum of squares by more than about one."""
TOUCHED = 0.2
"""Share of the tactels that are touched in every other sample; all of them are in the others."""


def faint_light(model: FrameModel, phase: float) -> Array:
    """Orthonormal rows that span the light of faint loads.

    Parameters
    ----------
    model : FrameModel
        What makes frames.
    phase : float
        Largest phase that the loads of a sample cause [rad].

    Returns
    -------
    ndarray, shape (k, P)
        Directions in the space of grey levels, the strongest first.
    """
    rng, at = np.random.default_rng(0), model.at
    dark, light = expose(model, np.zeros(at.size))[0], list[Array]()
    for k in range(SAMPLES):
        unknowns = rng.normal(size=at.size)
        if k % 2:
            touched = rng.random(at.loads // 2) < TOUCHED
            unknowns[: at.loads] *= np.repeat(touched, 2)
        loads = np.where(np.arange(at.size) < at.loads, unknowns, 0.0)
        largest = np.abs(node_phase(model, loads) - model.fixed).max()
        if largest > 0:
            unknowns[: at.loads] *= phase / largest
        light.append(expose(model, unknowns)[0] - dark)
    rows = np.array(light) / np.sqrt(model.variance)
    # of the few directions that are kept, products of the rows are exact enough
    squares, shares = np.linalg.eigh(rows @ rows.T)
    behind = np.sqrt(squares.clip(0.0).cumsum() / SAMPLES)[::-1]
    kept = np.linalg.qr((shares[:, ::-1][:, behind > LEFT_OUT].T @ rows).T)[0]
    return np.ascontiguousarray(kept.T)
