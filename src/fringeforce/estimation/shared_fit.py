"""Many frames with unknowns of their own, and unknowns that all of them share.

Of a frame f with own unknowns u_f and shared ones s, half the loss is to second order

    [u; s]' [A_f B_f; B_f' C_f] [u; s] / 2 + [a_f; c_f]' [u; s],

so that the own ones follow every step of the shared: u_f = -A_f^-1 (a_f + B_f s).  What is left
for s has the matrix sum_f C_f - B_f' A_f^-1 B_f, a Schur complement (Triggs et al., Bundle
adjustment, a modern synthesis, Vision Algorithms, 298-372, 2000, section 6).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, get_lapack_funcs

Array = NDArray[np.float64]

_factorised, _solved = get_lapack_funcs(("potrf", "potrs"))


class FrameTerms(NamedTuple):
    """Half the loss of one frame to second order; l own unknowns, S shared ones.

    Attributes
    ----------
    own, cross, shared : ndarray, shapes (l, l), (l, S) and (S, S)
        Second derivatives A, B and C.
    own_gradient, gradient : ndarray, shapes (l,) and (S,)
        First derivatives a and c.
    which : ndarray of int, shape (S,), optional
        Numbers of these shared unknowns among those of all frames, if the frame has not all.
    """

    own: Array
    cross: Array
    shared: Array
    own_gradient: Array
    gradient: Array
    which: NDArray[np.intp] | None = None


@dataclass(frozen=True, eq=False)
class Eliminated:
    """One frame with its own unknowns eliminated.

    Attributes
    ----------
    information : ndarray, shape (S, S)
        Schur complement.
    gradient : ndarray, shape (S,)
        By the shared unknowns, the own ones at their best.
    step : ndarray, shape (l,)
        Of the own unknowns where the shared ones stay.
    response : ndarray, shape (l, S)
        What the own unknowns do with each shared one.
    spread : ndarray, shape (l, l)
        Covariance of the own unknowns where the shared ones are known.
    which : ndarray of int, shape (S,)
        Numbers of these shared unknowns among those of all frames.
    """

    information: Array
    gradient: Array
    step: Array
    response: Array
    spread: Array
    which: NDArray[np.intp]

    @classmethod
    def of(cls, terms: FrameTerms) -> Eliminated:
        """Eliminate the own unknowns of a frame."""
        which = np.arange(len(terms.gradient)) if terms.which is None else terms.which
        if not len(terms.own):
            none = np.zeros((0, len(terms.gradient)))
            return cls(terms.shared, terms.gradient, np.zeros(0), none, terms.own, which)
        size, shared = terms.cross.shape
        factor, failed = _factorised(terms.own, clean=0)
        if failed:
            raise LinAlgError("what a frame tells of its own unknowns leaves some of them open")
        # one call for all: frames are many and small, and calls cost as much as sums
        right = np.zeros((size, shared + 1 + size), order="F")
        right[:, :shared], right[:, shared] = terms.cross, terms.own_gradient
        np.fill_diagonal(right[:, shared + 1 :], 1.0)
        solved = _solved(factor, right, overwrite_b=1)[0]
        response, step = -solved[:, :shared], -solved[:, shared]
        return cls(
            terms.shared + terms.cross.T @ response,
            terms.gradient + response.T @ terms.own_gradient,
            step,
            response,
            solved[:, shared + 1 :],
            which,
        )

    def variances(self, covariance: Array) -> Array:
        """Variances of the own unknowns, from the covariance of all shared ones."""
        shared = covariance[np.ix_(self.which, self.which)]
        moved = (self.response @ shared * self.response).sum(axis=1)
        return np.diag(self.spread) + moved


def excess_scatter(told: Sequence[Eliminated], shares: Array, covariance: Array) -> Array:
    """Variance of what frames tell of each shared unknown, over that of their noise, shape (S,).

    By noise alone the gradient of a frame, at the best of all, has the covariance
    H_f - H_f C H_f; small errors of the model, anew in every frame, add to it (White,
    Econometrica 50, 1-25, 1982, equation 3.2; Huber, Proc. Fifth Berkeley Symp. 1, 221-233, 1967).
    One of an unknown of which no two frames tell.

    Parameters
    ----------
    told : sequence of Eliminated, length F
        At the best of all.
    shares : ndarray, shape (F,)
        Weights of the frames.
    covariance : ndarray, shape (S, S)
        Of the shared unknowns.
    """
    found, expected = np.zeros((2, len(covariance)))
    for share, one in zip(shares, told, strict=True):
        moved = covariance[:, one.which]
        found += np.square(share * moved @ one.gradient)
        left = share * one.information
        left = left - left @ covariance[np.ix_(one.which, one.which)] @ left
        expected += ((moved @ left) * moved).sum(axis=1)
    moves = expected > np.sqrt(np.finfo(float).eps) * np.diag(covariance)  # beyond rounding
    return np.divide(found, expected, out=np.ones_like(found), where=moves)
