"""Gauss's rule on an interval, found once for each number of points."""

from __future__ import annotations

from functools import cache

from numpy.polynomial.legendre import leggauss

from fringeforce.base.arrays import Array


@cache
def gauss_rule(points: int) -> tuple[Array, Array]:
    """Gauss points of the interval from -1 to 1, and their weights.

    Parameters
    ----------
    points : int
        Number of them.

    Returns
    -------
    nodes, weights : ndarray, shape (points,)
        Read-only, for all share them.
    """
    nodes, weights = leggauss(points)
    nodes.flags.writeable = weights.flags.writeable = False
    return nodes, weights
