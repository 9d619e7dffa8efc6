"""How smooth the residual is, which nobody knows beforehand: what frames make of its length.

What follows from several correlation lengths is averaged, each with the probability that the frames
give it (Hoeting, Madigan, Raftery and Volinsky, Statistical Science 14, 382-417, 1999).  One length
alone, a squared exponential's, excludes all that is a little rougher, however plain frames show it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar

from fringeforce.base.arrays import Array
from fringeforce.design.strip import Sensor
from fringeforce.models.node_splines import coefficients
from fringeforce.models.smooth_field import karhunen_loeve, squared_exponential

SHORTER = 0.5**0.5
"""Factor between correlation lengths of the residual that are tried: fields of one between pass for
those of its neighbours, which they do not at a factor of two."""
UNLIKELY = 1e-3
"""Probability of a correlation length, over that of the likeliest, below which it is left out, and
shorter ones are not tried."""
FAINTEST = 1e-5
"""Variance of a mode of the residual, relative to the largest, below which it is left out: a
milliradian of a residual of 0.3 rad, which is as much as a calibration leaves uncertain of it."""
SIZES = 1e-4, 10.0
"""Standard deviations of a residual between which the likeliest is sought: below the noise of any
frame, and beyond a fringe [rad]."""


def correlation_lengths(sensor: Sensor) -> list[float]:
    """Lengths that are tried [m]: the drawing's, and shorter and shorter ones.

    Down to the thickness of the cover: no stress of casting and bonding varies faster.
    """
    found = [float(sensor.polariscope.residual_length)]
    while SHORTER * found[-1] >= sensor.transducer.compliant.thickness:
        found.append(SHORTER * found[-1])
    return found


def probabilities(losses: ArrayLike) -> Array:
    """Probabilities of models that are as likely before the frames.

    Parameters
    ----------
    losses : array_like, shape (k,)
        Twice the negative logarithm of the probability of the frames under each, less a constant.

    Returns
    -------
    ndarray, shape (k,)
    """
    above = np.asarray(losses, dtype=float) - np.min(losses)
    weights = np.exp(-above / 2)
    return np.asarray(weights / weights.sum())


class Weighed(NamedTuple):
    """What frames make of the lengths.

    Attributes
    ----------
    weights : ndarray, shape (k,)
        Probabilities of the lengths; none where they are below `UNLIKELY`.
    variances : ndarray, shape (k,)
        Variance of the residual that is likeliest under each [rad^2].
    gain : float
        Twice the logarithm of the probability of the frames under the likeliest length, over that
        without any residual.
    """

    weights: Array
    variances: Array
    gain: float


@dataclass(frozen=True, eq=False)
class ResidualLengths:
    """Covariances of residuals of several lengths, by what they are in modes of the shortest.

    Attributes
    ----------
    fields : ndarray, shape (r, m)
        Modes of the shortest, of unit variance along the strip, at the nodes [rad].
    roots : sequence of ndarray, length k, shape (r, q) each
        Of each length the square root R of the covariance R R' of the unknowns of these modes.
    scales : ndarray, shape (r,)
        Norms of the modes along the strip.
    """

    fields: Array
    roots: Sequence[Array]
    scales: Array

    @classmethod
    def of(cls, lengths: Sequence[float], places: Array, nodes: int) -> ResidualLengths:
        """Those of some lengths, the last of which is the shortest.

        Parameters
        ----------
        lengths : sequence of float, length k
            From the longest to the shortest [m].
        places : ndarray, shape (s,)
            Of samples, evenly spaced from the second node to the last but one [m].
        nodes : int
            Their number m.
        """
        modes = karhunen_loeve(places, lengths[-1], FAINTEST)
        scales = np.linalg.norm(modes, axis=1)  # modes are orthogonal
        onto, roots = modes / np.square(scales)[:, None], []
        for length in lengths:
            values, turn = np.linalg.eigh(onto @ squared_exponential(places, length) @ onto.T)
            roots.append(turn * np.sqrt(np.maximum(values, 0.0)))
        return cls(coefficients(modes, nodes), roots, scales)

    def weighed(self, information: Array, pull: Array) -> Weighed:
        """Probabilities of the lengths, each with its likeliest size, to second order.

        All unknowns are integrated out (MacKay, Neural Computation 4, 415-447, 1992): of a variance
        v, eigenvalues l of R' A R and q = R' b in their directions the loss is
        sum log(1 + v l) - v q^2 / (1 + v l).

        Parameters
        ----------
        information : ndarray, shape (r, r)
            A, of the unknowns of `fields`, all others integrated out.
        pull : ndarray, shape (r,)
            b: half the loss of unknowns u is u' A u / 2 - b' u but for a constant.
        """
        losses, variances = [], []
        for root in self.roots:
            told, turn = np.linalg.eigh(root.T @ information @ root)
            told, squares = np.maximum(told, 0.0), np.square(turn.T @ (root.T @ pull))

            def loss(size: float, told: Array = told, squares: Array = squares) -> float:
                seen = 1 + np.exp(2 * size) * told
                return float((np.log(seen) - np.exp(2 * size) * squares / seen).sum())

            found = minimize_scalar(loss, bounds=np.log(SIZES), method="bounded")
            losses.append(float(found.fun))
            variances.append(float(np.exp(2 * found.x)))
        weights = probabilities(losses)
        weights[weights < UNLIKELY * weights.max()] = 0.0
        return Weighed(weights / weights.sum(), np.array(variances), -min(losses))

    def averaged(self, weighed: Weighed) -> tuple[Array, float]:
        """Modes of the average covariance, as changes of `fields`, and the residual's size [rad].

        Modes (q, r) are of unit variance along the strip, to be multiplied with the size; those
        that add next to nothing are left out.
        """
        shares = weighed.weights * weighed.variances
        size = float(np.sqrt(shares.sum()))
        each = zip(np.sqrt(shares) / size, self.roots, strict=True)
        root = np.hstack([share * self.scales[:, None] * own for share, own in each if share])
        turn, spread, _ = np.linalg.svd(root, full_matrices=False)
        kept = np.square(spread) > FAINTEST * spread[0] ** 2
        return (turn[:, kept] * spread[kept]).T / self.scales, size


def alone(information: Array, pull: Array, own: slice, precision: Array) -> tuple[Array, Array]:
    """What frames tell of some unknowns, all others integrated out; as `ResidualLengths.weighed`.

    Parameters
    ----------
    information : ndarray, shape (S, S)
        What frames tell of all.
    pull : ndarray, shape (S,)
        In which direction, as of `ResidualLengths.weighed`.
    own : slice
        Which.
    precision : ndarray, shape (S - r,)
        What is known of the others without the frames.
    """
    others = np.delete(np.arange(len(pull)), own)
    cross = information[others, own]
    response = np.linalg.solve(information[np.ix_(others, others)] + np.diag(precision), cross)
    left = information[own, own] - cross.T @ response
    return left, pull[own] - response.T @ pull[others]
