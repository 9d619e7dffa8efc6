"""The size that many unknowns have in common, if it is what their estimates make most probable.

Unknowns x_i ~ N(0, s^2) are each told by data of variance n_i, which alone would give y_i, so that
s maximises

    sum_i log N(y_i; 0, s^2 + n_i).

Of estimates under a size s_0 the data are what they leave of the prior: with w_i = 1 - v_i / s_0^2,
the share of x_i that its data tell, n_i = s_0^2 (1 - w_i) / w_i and y_i = x_i / w_i.  Where s = s_0
is the maximum, sum x_i^2 = s_0^2 sum w_i.  MacKay's update, s^2 = sum x_i^2 / sum w_i, has the same
fixed point (Neural Computation 4, 415-447, 1992).  It grows fast and serves for that, but creeps to
a size of zero, which is found in one go.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar, root_scalar

from fringeforce.base.arrays import Array

LOST = 0.05
"""Share that data tell of unknowns, in the mean, below which noise hides them: as good as none."""
SMALLEST = 1e-3
"""Factor on a size in one go at least."""
UNTOLD = 1e-6
"""Share of an unknown below which its data tell nothing."""


def likeliest_size(squares: Array, shares: Array) -> float:
    """The likeliest size, over the one under which the unknowns were estimated.

    A size that tends to zero ends at half of `LOST`, so that it may grow again.

    Parameters
    ----------
    squares : ndarray, shape (n,)
        Squared estimates over the squared size.
    shares : ndarray, shape (n,)
        What data tell of each, from 0, nothing, to 1, all.

    Returns
    -------
    float

    Examples
    --------
    >>> from fringeforce.calibration.common_size import likeliest_size
    >>> round(likeliest_size(np.full(8, 4.0), np.ones(8)), 3)  # known exactly
    2.0
    """
    told = shares > UNTOLD
    if not told.any():
        return 1.0
    usual = squares[told].sum() / shares[told].sum()
    if usual >= 1:
        return float(np.sqrt(usual))
    share = np.minimum(shares[told], 1.0)
    noise, data = (1 - share) / share, squares[told] / share**2

    def loss(log_size: float) -> float:
        variance = np.exp(2 * log_size) + noise
        return float((np.log(variance) + data / variance).sum())

    def excess(log_size: float) -> float:
        square = np.exp(2 * log_size)
        return float((square / (square + noise)).sum() - LOST * len(shares) / 2)

    least = float(np.log(SMALLEST))
    if excess(0.0) <= 0:
        return 1.0
    if excess(least) < 0:
        least = float(root_scalar(excess, bracket=(least, 0.0)).root)
    found = minimize_scalar(loss, bounds=(least, 0.0), method="bounded", options={"xatol": 1e-3})
    return float(np.exp(found.x))
