"""From one noisy frame to loads that may explain it, with no earlier state.

A search along the frame that any lines of fringes can use which a linear model explains: it sees
intensities, the variance of their noise and influence matrices, and knows nothing of sensors.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.phase.beam import beam_search
from fringeforce.estimation.phase.folding import (
    Fringes,
    block_edges,
    folded_phase,
    interleaved,
    phase_pace,
)

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


def explanations(channels: Sequence[Fringes]) -> Iterator[Array]:
    """Loads that may explain a frame, attempt by attempt, each starting where the last one failed.

    Parameters
    ----------
    channels : sequence of Fringes
        The same strip in one light or in several, along the same pixels.

    Yields
    ------
    ndarray, shape (k, m)
        Loads of one attempt, the likeliest first.  Where no channel is biased, each is known up to
        its sign: a load and its negative give the same frame.  They lie within a fraction of a
        fringe of what they explain.
    """
    paces = np.array([phase_pace(fringes.intensity, fringes.variance) for fringes in channels])
    steps = np.array([fringes.steps for fringes in channels])
    scale = load_scale(paces, np.array([fringes.influence for fringes in channels]), steps)
    for effort in EFFORTS:
        yield _track(channels, paces.max(axis=0), scale, effort)


def load_scale(paces: Array, influence: Array, steps: NDArray[np.bool_]) -> float:
    """Root-mean-square load whose fringes run, on average, as fast as the frame's.

    Parameters
    ----------
    paces : ndarray, shape (..., P)
        Local pace of the phase [rad per pixel].
    influence : ndarray, shape (..., P, m)
        Phase per unit load.
    steps : ndarray of bool, shape (..., P - 1)
        From which pixels to the next the pace was seen.
    """
    unit = np.diff(influence, axis=-2)[steps]
    return float(np.sqrt((paces[..., :-1][steps] ** 2).sum() / (unit**2).sum()))


def _track(channels: Sequence[Fringes], pace: Array, scale: float, effort: Effort) -> Array:
    edges = block_edges(pace, effort.extent)
    folded = interleaved([folded_phase(fringes, edges) for fringes in channels])
    order = slice(None, None, -1 if effort.backward else 1)
    means, _ = beam_search(
        folded.fold[order],
        folded.variance[order],
        folded.single[order],
        folded.bias[order],
        np.ascontiguousarray(folded.influence[order]),
        effort.scale * max(scale, 1e-12),
        effort.width,
        GATE,
        effort.cut,
    )
    return means
