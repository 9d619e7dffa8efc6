"""From one noisy frame to loads that may explain it, with no earlier state.

A search along the frame that any line of fringes can use which a linear model explains: it sees an
intensity, the variance of its noise and an influence matrix, and knows nothing of sensors.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.phase.beam import beam_search
from fringeforce.phase.folding import block_edges, folded_phase, phase_pace

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Effort:
    """One attempt at a frame.

    Attributes
    ----------
    backward : bool
        Whether to scan from the last pixel to the first.
    scale : float
        Standard deviation of the loads before anything is seen, in units of the estimate from the
        frame's own fringes.
    extent : float
        Phase that a block of pixels may span [rad].
    width : int
        Hypotheses that are kept.
    cut : float
        Squared deviations behind the best at which a hypothesis is given up.
    """

    backward: bool = False
    scale: float = 1.5
    extent: float = 0.4
    width: int = 32
    cut: float = 30.0


GATE = 5.0
EFFORTS = (
    Effort(),
    Effort(backward=True, scale=2.5),
    Effort(scale=4.0, extent=0.25, width=128, cut=60.0),
    Effort(backward=True, extent=0.25, width=256, cut=80.0),
)
"""Attempts in the order in which they are made; the first one succeeds nearly always."""


def explanations(intensity: Array, variance: float, influence: Array) -> Iterator[Array]:
    """Loads that may explain a frame, attempt by attempt, each starting where the last one failed.

    Parameters
    ----------
    intensity : ndarray, shape (P,)
        Normalised intensity along the strip, noise included.
    variance : float
        Of the noise of one pixel, in the same unit.
    influence : ndarray, shape (P, m)
        Phase per unit load at every pixel.

    Yields
    ------
    ndarray, shape (k, m)
        Loads of one attempt, the likeliest first, each up to its sign: a load and its negative
        give the same frame.  They lie within a fraction of a fringe of what they explain.
    """
    pace = phase_pace(intensity, variance)
    scale = load_scale(pace, influence)
    for effort in EFFORTS:
        yield _track(intensity, variance, influence, pace, scale, effort)


def load_scale(pace: Array, influence: Array) -> float:
    """Root-mean-square load whose fringes run, on average, as fast as the frame's.

    Parameters
    ----------
    pace : ndarray, shape (P,)
        Local pace of the phase [rad per pixel].
    influence : ndarray, shape (P, m)
        Phase per unit load.
    """
    unit = np.diff(influence, axis=0)
    return float(np.sqrt((pace[:-1] ** 2).sum() / (unit**2).sum()))


def _track(
    intensity: Array,
    variance: float,
    influence: Array,
    pace: Array,
    scale: float,
    effort: Effort,
) -> Array:
    folded = folded_phase(intensity, variance, influence, block_edges(pace, effort.extent))
    order = slice(None, None, -1 if effort.backward else 1)
    means, _ = beam_search(
        folded.fold[order],
        folded.variance[order],
        folded.single[order],
        np.ascontiguousarray(folded.influence[order]),
        effort.scale * max(scale, 1e-12),
        effort.width,
        GATE,
        effort.cut,
    )
    return means
