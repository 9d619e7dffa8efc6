"""Sizes of what scatters under which frames are most probable, to second order about some values.

Of a bench's unknowns x about what is expected of them, with precisions P in groups of one size
each, the frames' probability with all unknowns integrated out is, but for a constant,

    -2 log p = log det H - log det P + min_x (x' P x + what frames add),    H = P + what frames tell

(MacKay, Neural Computation 4, 415-447, 1992), which is the restricted likelihood of variance
components (Patterson and Thompson, Biometrika 58, 545-554, 1971).  Half its derivative by the
logarithm of a size is how many unknowns of the group frames tell, sum(1 - P diag H^-1), less
sum(P x^2).  Its expected curvature leads to the maximum in a few steps (Fisher's scoring), also
where nothing scatters.  Other sizes change P alone, so that no frame is expanded again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, get_lapack_funcs

from fringeforce.base.arrays import Array, Index
from fringeforce.estimation.levenberg_marquardt import Curvature, Expansion, Stop, minimise
from fringeforce.estimation.shared_fit import FrameTerms

STEPS = 12
"""Most steps of the search for the sizes; half of them mostly do."""
FOUND = Stop(close=0.01, near=0.1)
"""Twice the logarithm of a probability that steps may leave: a tenth of a size's deviation."""
UNTOLD = 1e-8
"""Curvature by the logarithm of a size below which it is rounding: no frame tells of the size."""

_factorised, _solved, _inverted = get_lapack_funcs(("potrf", "potrs", "potri"))


class Scattering(NamedTuple):
    """Unknowns that scatter about what is expected of them.

    Attributes
    ----------
    off : ndarray, shape (l,)
        How far they are from it.
    precision : ndarray, shape (l,)
        Inverse variances.
    group : ndarray of int, shape (l,)
        Which size each has; -1 if it has none that is sought.
    """

    off: Array
    precision: Array
    group: Index

    def resized(self, steps: Array) -> Array:
        """What sizes (n,) that grow by these logarithms add to the precision, shape (l,)."""
        return self.precision * np.expm1(-2 * np.append(steps, 0.0)[self.group])


class Sums(NamedTuple):
    """Sums over groups of unknowns; the last one is of those without a size.

    Attributes
    ----------
    squares, free, members : ndarray, shape (n + 1,)
        Squares over variances, how many unknowns frames tell, and how many there are.
    curvature : ndarray, shape (n + 1, n + 1)
        Half the expected second derivative of twice the negative logarithm of the probability, but
        for what frames have in common.
    """

    squares: Array
    free: Array
    members: Array
    curvature: Array

    @classmethod
    def none(cls, count: int) -> Sums:
        """Of no unknowns, for so many sizes."""
        squares, free, members = np.zeros((3, count + 1))
        return cls(squares, free, members, np.zeros((count + 1,) * 2))

    def add(self, own: Scattering, covariance: Array, share: float) -> None:
        """Count unknowns with their covariance, shape (l, l)."""
        deviations = 1 / np.sqrt(own.precision)
        told = np.eye(len(deviations)) - covariance / np.outer(deviations, deviations)
        onto = np.eye(len(self.free))[own.group]
        self.squares[:] += share * onto.T @ (own.precision * np.square(own.off))
        self.free[:] += share * onto.T @ np.diag(told)
        self.members[:] += share * onto.sum(axis=0)
        self.curvature[:] += 2 * share * onto.T @ np.square(told) @ onto


class Sized(NamedTuple):
    """Frames under other sizes, all unknowns at their best.

    Attributes
    ----------
    steps : ndarray, shape (n,)
        Logarithms of the sizes over those of the expansion.
    loss : float
        Twice the negative logarithm of the frames' probability, less a constant.
    sums : Sums
        Over the groups.
    shared, own : ndarray, shape (S,), and list of ndarray, length F
        How far all unknowns are from those of the expansion.
    """

    steps: Array
    loss: float
    sums: Sums
    shared: Array
    own: list[Array]

    @property
    def gradient(self) -> Array:
        """Half the derivative of the loss by the logarithms of the sizes, shape (n,)."""
        return (self.sums.free - self.sums.squares)[:-1]


@dataclass(frozen=True, eq=False)
class Expanded:
    """Frames of a bench to second order about some values of all unknowns.

    Attributes
    ----------
    terms : sequence of FrameTerms, length F
        Of the frames.
    own : sequence of Scattering, length F
        Of each frame's own unknowns.
    moves : sequence of ndarray, length F, shape (l, w) each
        What the last of its shared unknowns change in what is expected of the own ones.
    shares : ndarray, shape (F,)
        What each frame counts.
    shared : Scattering
        Of the shared unknowns.
    expected, slope : ndarray, shapes (S, S) and (S,)
        Information about these before the frames, and half the derivative of what it adds.
    count : int
        Number n of sizes.
    """

    terms: Sequence[FrameTerms]
    own: Sequence[Scattering]
    moves: Sequence[Array]
    shares: Array
    shared: Scattering
    expected: Array
    slope: Array
    count: int

    @cached_property
    def _centred(self) -> list[tuple[FrameTerms, Index]]:
        """Terms by what own unknowns are off what is expected: sizes change a diagonal alone."""
        found = []
        for terms, moves in zip(self.terms, self.moves, strict=True):
            size = len(terms.gradient)
            turn = np.zeros((len(terms.own), size))
            turn[:, size - moves.shape[1] :] = moves
            mixed = turn.T @ terms.cross
            centred = terms._replace(
                cross=terms.cross + terms.own @ turn,
                shared=terms.shared + mixed + mixed.T + turn.T @ terms.own @ turn,
                gradient=terms.gradient + turn.T @ terms.own_gradient,
            )
            found.append((centred, np.arange(size) if terms.which is None else terms.which))
        return found

    @cached_property
    def _summed(self) -> tuple[Array, Array, Array]:
        """Information and gradient of the shared unknowns while the own ones stay.

        Then what frames count times what each own unknown has in common with all shared ones,
        shape (L, S), frame by frame.
        """
        information, gradient = self.expected.copy(), self.slope.copy()
        crosses = np.zeros((sum(len(own.off) for own in self.own), len(gradient)))
        last = 0
        for (terms, which), share in zip(self._centred, self.shares, strict=True):
            begin, last = last, last + len(terms.own)
            if share:
                information[np.ix_(which, which)] += share * terms.shared
                gradient[which] += share * terms.gradient
                crosses[begin:last, which] = share * terms.cross
        return information, gradient, crosses

    def sized(self, steps: Array) -> Sized:
        """The frames under sizes that grow by these logarithms, shape (n,)."""
        shared, sums = self.shared, Sums.none(self.count)
        added = shared.resized(steps)
        loss, told, last = float(added @ np.square(shared.off)), [], 0
        plain, slope, crosses = self._summed
        followed, pulled = np.zeros_like(crosses), np.zeros(len(crosses))
        for (terms, which), own, share in zip(self._centred, self.own, self.shares, strict=True):
            more = own.resized(steps)
            pull, (size, others) = terms.own_gradient + more * own.off, terms.cross.shape
            factor = _factor(terms.own + np.diag(more))
            right = np.zeros((size, others + 1 + size), order="F")
            right[:, :others], right[:, others] = terms.cross, pull
            np.fill_diagonal(right[:, others + 1 :], 1.0)
            solved = _solved(factor, right, overwrite_b=1)[0]
            begin, last = last, last + size
            followed[begin:last, which], pulled[begin:last] = solved[:, :others], solved[:, others]
            if share:
                left = more @ np.square(own.off) - pull @ pulled[begin:last]
                loss += share * float(_log_det(factor) + left)
            told.append((solved[:, others + 1 :], own.precision + more))
        information = plain + np.diag(added) - crosses.T @ followed
        gradient = slope + added * shared.off - crosses.T @ pulled
        factor = _factor(information)
        covariance = _inverse(factor)
        moved = -covariance @ gradient
        off, precision = shared.off + moved, shared.precision + added
        sums.add(Scattering(off, precision, shared.group), covariance, 1.0)
        found, common, after = [], followed @ covariance, -(pulled + followed @ moved)
        last = 0
        for own, share, (spread, precision) in zip(self.own, self.shares, told, strict=True):
            begin, last = last, last + len(spread)
            found.append(after[begin:last])
            if share:
                scattering = Scattering(own.off + found[-1], precision, own.group)
                spread = spread + common[begin:last] @ followed[begin:last].T
                sums.add(scattering, spread, share)
        loss += _log_det(factor) + float(gradient @ moved + 2 * sums.members[:-1] @ steps)
        return Sized(steps, loss, sums, moved, self._uncentred(found, moved))

    def _uncentred(self, steps: list[Array], shared: Array) -> list[Array]:
        """Steps of the own unknowns, from those of what they are off what is expected of them."""
        last = len(shared)
        return [
            step + moves @ shared[last - moves.shape[1] :]
            for step, moves in zip(steps, self.moves, strict=True)
        ]

    def likeliest(self, start: Sized, low: Array, high: Array) -> Sized:
        """The frames under the likeliest sizes, whose logarithms change within bounds (n,)."""

        def expand(here: Sized) -> Expansion[Sized]:
            # what a bound holds is left out
            gradient, curvature = here.gradient, here.sums.curvature[:-1, :-1].copy()
            down, up = here.steps <= low, here.steps >= high
            held = (down & (gradient > 0)) | (up & (gradient < 0))
            curvature[held], curvature[:, held] = 0.0, 0.0
            curvature[np.diag_indices(self.count)] += np.where(held, 1.0, UNTOLD)

            def ahead(step: Array) -> tuple[Sized, float]:
                try:
                    there = self.sized(np.clip(here.steps + step, low, high))
                except LinAlgError:
                    return here, np.inf
                return there, there.loss

            gradient = np.where(held, 0.0, gradient)
            return Expansion(here.loss, gradient, lambda: Curvature(curvature), ahead)

        return minimise(start, expand, STEPS, FOUND).place


def _factor(information: Array) -> Array:
    """Cholesky's, upper triangle."""
    factor, failed = _factorised(information, clean=0)
    if failed:
        raise LinAlgError("what frames tell of a bench leaves some of its unknowns open")
    return np.asarray(factor)


def _inverse(factor: Array) -> Array:
    """Of a matrix, from Cholesky's factor."""
    upper = np.triu(_inverted(factor)[0])
    return upper + np.triu(upper, 1).T


def _log_det(factor: Array) -> float:
    """Logarithm of the determinant of a matrix, from Cholesky's factor."""
    return float(2 * np.log(np.diag(factor)).sum())
