"""From phase lead to light, equation (11) of the paper."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def intensity(phase: ArrayLike) -> NDArray[np.float64]:
    """Normalised intensity behind a dark-field circular polariscope, sin^2(p / 2).

    Parameters
    ----------
    phase : array_like, any shape
        Phase lead p [rad].

    Returns
    -------
    ndarray, same shape
        Between 0 and 1; equation (11).
    """
    return np.sin(np.asarray(phase, dtype=float) / 2) ** 2
