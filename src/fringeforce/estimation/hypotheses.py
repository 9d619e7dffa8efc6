"""Explanations of one frame against each other: their weights, and what several come to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.compiling import entry

Array = NDArray[np.float64]

CONFIDENCE = 0.999
"""Probability of a reading that is OK, unless told otherwise: one in a thousand may be wrong."""
NEGLIGIBLE_LOSS = float(-2 * np.log((1 - CONFIDENCE) / 3))
"""Loss beyond the best at which an explanation has no weight: a third of what `CONFIDENCE` leaves,
0.0003."""
SAME_PHASE = 0.3
"""Phases nowhere farther apart are one explanation of a frame: a tenth of what mirror images differ
by [rad]."""


class MetPhases:
    """Phases that were met already, so that nothing is looked for twice.

    Parameters
    ----------
    even : bool
        Whether a phase and its negative are of the same frames.
    """

    def __init__(self, even: bool = False) -> None:
        self._even, self._count = even, 0
        self._phases, self._limits = np.empty((0, 0)), np.empty(0)

    def add(self, phase: Array, limit: float) -> None:
        """Add a phase, shape (m,), to which others are equal that are nowhere so far from it."""
        if self._count == len(self._limits):
            size = max(2 * self._count, 16)
            room = np.empty((size, len(phase))), np.empty(size)
            if self._count:
                room[0][: self._count], room[1][: self._count] = self._phases, self._limits
            self._phases, self._limits = room
        self._phases[self._count], self._limits[self._count] = phase, limit
        self._count += 1

    def holds(self, phase: Array) -> bool:
        """Whether a phase was met."""
        return bool(_is_near(phase, self._phases[: self._count], self._limits, self._even))


@entry
def _is_near(phase, others, limits, even):
    for k in range(len(others)):
        same, mirrored = True, even
        for i in range(len(phase)):
            same = same and abs(phase[i] - others[k, i]) < limits[k]
            mirrored = mirrored and abs(phase[i] + others[k, i]) < limits[k]
            if not (same or mirrored):
                break
        if same or mirrored:
            return True
    return False


def posterior_weights(masses: Array) -> Array:
    """Posterior weights of explanations, shape (k,); they add up to one.

    Parameters
    ----------
    masses : ndarray, shape (k,)
        Logarithms of their posterior masses, less a common constant.
    """
    shares = np.exp(masses - masses.max())
    return np.asarray(shares / shares.sum())


def mixture(weights: Array, means: Array, covariances: Array) -> tuple[Array, Array]:
    """Mean and covariance of several normal explanations together.

    Parameters
    ----------
    weights : ndarray, shape (k,)
        Of the explanations; they add up to one.
    means : ndarray, shape (k, m)
        Of the unknowns.
    covariances : ndarray, shape (k, m, m) or (m, m)
        Of each, or one of all.
    """
    mean = weights @ means
    apart = means - mean
    common = np.broadcast_to(covariances, (len(weights), *covariances.shape[-2:]))
    within = np.einsum("k,kij->ij", weights, common)
    return mean, np.asarray(within + (apart * weights[:, None]).T @ apart)
