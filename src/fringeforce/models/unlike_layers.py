"""Phases of a strip whose layers relax unlike: its influence matrix turns with time.

By the correspondence principle the phase is Psi(q) f with the ratio q = m_1 / m_2 of the layers'
relaxations, an operator in time; see `models.creep`.  A polynomial in q - 1 through the matrices of
four ratios, from that of the drawing to that of loads that last, stands for Psi.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.models.creep import Creep

SHARES = (0.0, 1 / 3, 2 / 3, 1.0)
"""Of the whole change of the ratio, at which the matrix is solved: where it is a tenth, a cubic
polynomial leaves a millionth of the matrix."""


def ratio_powers(influence: Callable[[float], Array], last: float) -> Array:
    """Matrices of the powers of q - 1, shape (4, m, 2n) [rad/N].

    Parameters
    ----------
    influence : callable
        Influence matrix, shape (m, 2n), of a strip whose ratio of moduli is so many times that of
        the drawing.
    last : float
        q - 1 of a load that lasts.
    """
    at = last * np.array(SHARES)
    values = np.array([influence(1 + change) for change in at])
    return np.tensordot(np.linalg.inv(np.vander(at, increasing=True)), values, axes=1)


def turned_phase(powers: Array, ratio: Creep, times: Array, forces: Array) -> Array:
    """Phases under forces in a row that began at rest, shape (F, m) [rad].

    Parameters
    ----------
    powers : ndarray, shape (J, m, 2n)
        As of `ratio_powers`.
    ratio : Creep
        The lags of q.
    times : ndarray, shape (F,)
        Ascending [s].
    forces : ndarray, shape (F, 2n)
        [N].
    """
    phase = forces @ powers[-1].T
    for matrix in powers[-2::-1]:  # Horner's scheme
        phase = ratio.added(times, phase) + forces @ matrix.T
    return phase
