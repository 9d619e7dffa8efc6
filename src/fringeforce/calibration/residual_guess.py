"""What a residual may be before frames are seen, of which neither length nor size is known.

One Gaussian process of one length and size would hold a residual down that is rougher or larger
than was stated, and unknown loads, which are the same in every frame, would make up for it.  What
follows from each length and size is averaged, with the probability that the frames give it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.special import chdtrc

from fringeforce.base.arrays import Array
from fringeforce.calibration.residual_length import (
    FAINTEST,
    SHORTER,
    ResidualLengths,
    Weighed,
    correlation_lengths,
    probabilities,
)
from fringeforce.design.strip import Sensor

WRONG = 4.0
"""Factor by which the size of a residual may be wrong that somebody states, either way: strips of
one kind have residuals from some hundredths of a radian to some tenths."""


class Averaged(NamedTuple):
    """What frames tell of unknowns, under all guesses together.

    Attributes
    ----------
    mean : ndarray, shape (S,)
        Of the unknowns.
    covariance : ndarray, shape (S, S)
        About it.
    """

    mean: Array
    covariance: Array

    def turned(self, signs: Array) -> Averaged:
        """The same of unknowns that have other signs, shape (S,)."""
        return Averaged(signs * self.mean, self.covariance * np.outer(signs, signs))


@dataclass(frozen=True, eq=False)
class ResidualGuess:
    """Lengths and sizes that the residual may have, all as likely before the frames; h of them.

    Attributes
    ----------
    modes : ndarray, shape (q, m)
        Of the residual at the nodes, of unit variance each on the average of all guesses [rad].
    covariances : ndarray, shape (h, q, q)
        Of their unknowns under each guess.
    """

    modes: Array
    covariances: Array

    @classmethod
    def of(cls, sensor: Sensor, std: float, places: Array, nodes: int) -> ResidualGuess:
        """That of a strip.

        Parameters
        ----------
        sensor : Sensor
            Of the drawing.
        std : float
            Size that is stated [rad].
        places, nodes
            As of `ResidualLengths.of`.
        """
        lengths = correlation_lengths(sensor)
        steps = round(np.log(WRONG) / np.log(1 / SHORTER))
        sizes = std * SHORTER ** np.arange(-steps, steps + 1)
        known, count = ResidualLengths.of(lengths, places, nodes), len(lengths)
        usual = np.full(count, np.square(sizes).mean())
        modes, size = known.averaged(Weighed(np.full(count, 1 / count), usual, 0.0))
        modes *= size
        roots = [np.linalg.lstsq(modes.T, root, rcond=None)[0] for root in known.roots]
        each = [size**2 * (root @ root.T) for root in roots for size in sizes]
        return cls(modes @ known.fields, np.array(each))

    @classmethod
    def none(cls, nodes: int) -> ResidualGuess:
        """That of a strip whose residual stays as it is."""
        return cls(np.empty((0, nodes)), np.empty((1, 0, 0)))

    def average(self, own: slice, information: Array, pull: Array) -> Averaged:
        """Unknowns of all that frames tell of; those of other things have unit variance before.

        Parameters
        ----------
        own : slice
            Unknowns of the residual.
        information : ndarray, shape (S, S)
            A, what frames tell.
        pull : ndarray, shape (S,)
            b: half the loss of frames with unknowns u is u' A u / 2 - b' u but for a constant.
        """
        before = self.before(own, len(pull))
        # (C^-1 + A)^-1 = C (1 + A C)^-1, where a length has no variance as well
        told = np.eye(len(pull)) + information @ before
        after = before @ np.linalg.inv(told)
        means = after @ pull
        weights = probabilities(np.linalg.slogdet(told)[1] - means @ pull)
        mean = weights @ means
        off = means - mean
        covariance = np.tensordot(weights, after, 1) + (off.T * weights) @ off
        return Averaged(mean, (covariance + covariance.T) / 2)

    def before(self, own: slice, count: int) -> Array:
        """Covariances of all unknowns before the frames, shape (h, S, S)."""
        found = np.tile(np.eye(count), (len(self.covariances), 1, 1))
        found[:, own, own] = self.covariances
        return found

    def loss(self, unknowns: Array) -> float:
        """Twice the negative logarithm of the probability of unknowns (q,), less a constant."""
        precision, volume = self._densities
        losses = np.einsum("a,hab,b->h", unknowns, precision, unknowns) + volume
        least = losses.min()
        return float(least - 2 * np.log(np.exp((least - losses) / 2).mean()))

    def chance(self, unknowns: Array) -> float:
        """Chance that a residual is as large along the strip, under the guess that allows it best.

        Its mean square is a sum of squares of normal numbers, which has nearly the distribution of
        chi squared of the same mean and variance (Satterthwaite, Biometrics Bull. 2, 110, 1946).
        """
        gram = self.modes @ self.modes.T
        spread = self.covariances @ gram
        mean, square = np.einsum("haa->h", spread), np.einsum("hab,hba->h", spread, spread)
        freedom = mean**2 / square
        return float(chdtrc(freedom, freedom * (unknowns @ gram @ unknowns) / mean).max())

    @cached_property
    def _densities(self) -> tuple[Array, Array]:
        """Precision and volume of each guess, of which none is certain of any mode."""
        spread = self.covariances + FAINTEST * np.eye(len(self.modes))
        precision, volume = np.linalg.inv(spread), np.linalg.slogdet(spread)[1]
        return np.asarray(precision, dtype=float), np.asarray(volume, dtype=float)
