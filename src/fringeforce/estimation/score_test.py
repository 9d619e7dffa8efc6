"""Whether changes that were not fitted show beside unknowns that were: Rao's score test.

With s half the derivative of the loss by the changes, and V the information about them, both beside
what was fitted, s' V^-1 s is a chi-square number of as many degrees of freedom as there are changes
that can be told, where there are none (Rao, Math. Proc. Camb. Phil. Soc. 44, 50-57, 1948).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import get_lapack_funcs, solve_triangular

from fringeforce.base.arrays import Array, Index

LEAST_SHARE = 1e-3
"""Share of the information about a change that unknowns must leave: sums at the nodes of a line, or
over a lattice of pixels in single precision, do not say more exactly what explains it."""
RANK = 1e-5
"""Share of the largest information below which a change is absorbed by the unknowns."""


class Score(NamedTuple):
    """What a frame tells of k changes beside what was fitted.

    Attributes
    ----------
    pull : ndarray, shape (k,)
        Half the derivative of the loss by the changes.
    information : ndarray, shape (k, k)
        Half its expected second derivative.
    alone : ndarray, shape (k,)
        Information about each change where nothing else is fitted.
    solved : ndarray, shape (m, k)
        How far each change moves what was fitted.
    fitted : ndarray, shape (m, m)
        Information about what was fitted.
    """

    pull: Array
    information: Array
    alone: Array
    solved: Array
    fitted: Array

    @classmethod
    def beside(
        cls, fitted: tuple[Array, Array], across: Array, tested: tuple[Array, Array]
    ) -> Score:
        """Of half the derivatives of the loss, the first and the second.

        Parameters
        ----------
        fitted : (ndarray, ndarray), shapes (m,) and (m, m)
            By what was fitted.
        across : ndarray, shape (m, k)
            Second derivative by both.
        tested : (ndarray, ndarray), shapes (k,) and (k, k)
            By the changes; a diagonal will do where each is looked at by itself.
        """
        solved = np.asarray(np.linalg.solve(fitted[1], across), dtype=float)
        left = tested[1] - across.T @ solved
        pull, alone = tested[0] - solved.T @ fitted[0], tested[1].diagonal()
        return cls(pull, left, alone, solved, fitted[1])

    def of(self, some: slice) -> Score:
        """Of some of the changes alone."""
        left, own = self.information[some, some], self.solved[:, some]
        return Score(self.pull[some], left, self.alone[some], own, self.fitted)

    def square(self) -> tuple[float, int]:
        """The chi-square number and its degrees of freedom.

        By a generalised inverse: changes that the unknowns absorb, or others before them, are left
        out, down to `RANK` of the largest information.
        """
        return self._square(RANK * float(self.information.diagonal().max()))

    def plain(self) -> tuple[float, int]:
        """The same of changes that are plain to see.

        What the unknowns hide even where it is as large as its generous deviation, one here, is
        left out, and what they explain but for `LEAST_SHARE` of it.
        """
        return self._square(max(1.0, LEAST_SHARE * float(self.alone.max())))

    def each(self) -> tuple[float, int]:
        """The same of changes each of which may be hidden but for `LEAST_SHARE` of it."""
        shown = np.flatnonzero(self.alone > 1)
        unit = np.sqrt(self.alone[shown])
        information = self.information[np.ix_(shown, shown)] / np.outer(unit, unit)
        scaled = self._replace(pull=self.pull[shown] / unit, information=information)
        return scaled._square(LEAST_SHARE)

    def _square(self, least: float) -> tuple[float, int]:
        if len(self.pull) == 1:
            known = float(self.information[0, 0])
            return (float(self.pull[0]) ** 2 / known, 1) if known > least else (0.0, 0)
        (factorise,) = get_lapack_funcs(("pstrf",), (self.information,))
        root, order, rank, _ = factorise(self.information, tol=least, lower=1)
        if rank == 0:
            return 0.0, 0
        pulls = self.pull[order[:rank] - 1]
        normal = solve_triangular(root[:rank, :rank], pulls, lower=True)
        return float(normal @ normal), int(rank)

    @property
    def size(self) -> Array:
        """The changes under a standard normal prior, shape (k,)."""
        known = np.eye(len(self.pull)) + self.information
        return np.asarray(np.linalg.solve(known, -self.pull), dtype=float)

    @property
    def best(self) -> float:
        """The one change that explains most."""
        return float(-self.pull[0] / self.information[0, 0])

    def moves(self, some: Index) -> float:
        """How far changes of this size move one of some of the unknowns, in its deviations."""
        spread = np.sqrt(np.diag(np.linalg.inv(self.fitted))[some])
        return float((np.abs(self.solved[some] @ self.size) / spread).max())

    def evidence(self) -> float:
        """Twice the logarithm of the evidence for changes that have a standard normal prior."""
        _, width = np.linalg.slogdet(np.eye(len(self.pull)) + self.information)
        return float(-self.pull @ self.size - width)
