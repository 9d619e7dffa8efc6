"""Slices that retard light by more than a wave, as steps of a fit try them where a mask hides all.

A slice turns light by its retardance, so that whole turns of it change nothing: what is left of it
after them does the same, and lies where the series of `integrated` hold.
"""

from __future__ import annotations

import numpy as np
from numba import njit

LARGEST = 2 * np.pi
"""Retardance of one slice up to which the series hold to 1e-8, a whole turn of light [rad]."""


@njit(cache=True, error_model="numpy", nogil=True)
def remainder(slices):
    """Slices less their whole turns, which turn light alike, and the shares that are left of them.

    Of shapes (n, 2, P) and (n, P).
    """
    rest, share = np.empty_like(slices), np.empty_like(slices[:, 0])
    for n in range(len(slices)):
        for i in range(slices.shape[2]):
            A, B = slices[n, 0, i], slices[n, 1, i]
            size, left = np.hypot(float(A), float(B)), 1.0
            if not size <= LARGEST:
                left = 1 - LARGEST * np.floor(size / LARGEST) / size
            share[n, i], rest[n, 0, i], rest[n, 1, i] = left, left * A, left * B
    return rest, share


@njit(cache=True, error_model="numpy", nogil=True)
def remainder_back(slices, share, gradient) -> None:
    """Make the derivative by what is left of slices the derivative by the slices.

    What is left changes with a slice along it, and across it in proportion to the sizes of both.
    """
    for n in range(len(slices)):
        for i in range(slices.shape[2]):
            left, A, B = share[n, i], slices[n, 0, i], slices[n, 1, i]
            if left != 1:
                by_A, by_B = gradient[n, 0, i], gradient[n, 1, i]
                along = (1 - left) * (A * by_A + B * by_B) / (A * A + B * B)
                gradient[n, 0, i] = left * by_A + along * A
                gradient[n, 1, i] = left * by_B + along * B
