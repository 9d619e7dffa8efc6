"""Experiments chosen one after the other, then exchanged, so that predictions vary least.

Linear (I-) optimality: the trace of a covariance against a matrix of weights, averaged over several
versions of the truth; V. V. Fedorov, Theory of Optimal Experiments, 1972.  Arrays only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fringeforce.base.arrays import Array

PASSES = 3
"""Largest number of rounds in which every choice may be exchanged."""
WORTHWHILE = 1e-6
"""Relative gain below which a choice is not exchanged."""


@dataclass(frozen=True, eq=False)
class CandidateExperiments:
    """What experiments tell and what it is worth, in versions v of the truth.

    Unknowns are such that each has unit variance, free of the others, before any experiment.

    Attributes
    ----------
    information : ndarray, shape (v, C, u, u)
        Information of every experiment.
    weights : ndarray, shape (v, u, u)
        Variance of what is to be predicted is the trace of these times the covariance.
    """

    information: Array
    weights: Array

    def covariances(self, rows: list[int]) -> Array:
        """Covariance after each number of experiments, none first, (v, len(rows) + 1, u, u)."""
        gained = np.cumsum(self.information[:, rows], axis=1)
        prior = np.broadcast_to(self._nothing, (len(gained), 1, *self._nothing.shape))
        information = np.concatenate([prior, gained + self._nothing], axis=1)
        return np.asarray(np.linalg.inv(information), float)

    def variances(self, rows: list[int]) -> Array:
        """Predicted variance after each number of experiments, shape (len(rows) + 1,)."""
        return self._averaged(self.covariances(rows))

    def chosen(self, count: int) -> list[int]:
        """Experiments to do, the most worthwhile first; one may be worth repeating."""
        everything = list(range(self.information.shape[1]))
        rows = self._forward(count, everything, repeated=True)
        for _ in range(PASSES):
            before = list(rows)
            for place in range(count):
                if rows[place] not in rows[:place]:
                    self._exchange(rows, place)
            if rows == before:
                break
        return self._forward(count, rows, repeated=False)

    @property
    def _nothing(self) -> Array:
        return np.eye(self.weights.shape[-1])

    def _averaged(self, covariance: Array) -> Array:
        """Predicted variance of covariances (v, m, u, u), shape (m,)."""
        return np.einsum("vij,vmji->m", self.weights, covariance) / len(self.weights)

    def _with_one_more(self, known: Array, rows: list[int]) -> Array:
        """Predicted variance if one experiment is added to what is known (v, u, u)."""
        there = np.asarray(np.linalg.inv(known[:, None] + self.information[:, rows]), float)
        return self._averaged(there)

    def _forward(self, count: int, pool: list[int], repeated: bool) -> list[int]:
        known, rows, left = np.repeat(self._nothing[None], len(self.weights), 0), [], list(pool)
        for _ in range(count):
            best = left[int(np.argmin(self._with_one_more(known, left)))]
            known = known + self.information[:, best]
            rows.append(best)
            if not repeated:
                left.remove(best)
        return rows

    def _exchange(self, rows: list[int], place: int) -> None:
        """Put the best experiment at one place, given all others."""
        others = rows[:place] + rows[place + 1 :]
        known = self._nothing + self.information[:, others].sum(axis=1)
        values = self._with_one_more(known, list(range(self.information.shape[1])))
        best = int(np.argmin(values))
        if values[best] < values[rows[place]] * (1 - WORTHWHILE):
            rows[place] = best
