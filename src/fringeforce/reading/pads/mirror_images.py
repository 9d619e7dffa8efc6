"""Other forces that may explain a frame of a pad as well: mirror images beyond a quarter wave.

What a pixel sees is the sine of the retardance, the same for a retardance below an odd multiple of
a quarter wave and for the one as far above.  Where the retardance hardly passes such a fold, or
nearly reaches it, forces whose retardance stays on the other side there may leave the same frame.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.ndimage import label

from fringeforce.estimation.covariance import covariance_of
from fringeforce.estimation.hypotheses import NEGLIGIBLE_LOSS, mixture, posterior_weights
from fringeforce.reading.pads.fit import Optimum
from fringeforce.reading.pads.sampling import Sampling

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Mask = NDArray[np.bool_]

FOLD_DISTANCES = (0.0, 0.15, 0.4)
"""Distances below a fold from which retardance is taken to its other side [rad]."""
TRIED = 6
"""Regions beyond folds that are tried, the smallest ones."""
SPREAD = 3.0
"""Factor in a deviation up to which rivals that widen it are one explanation, less sure."""
RIDGE = 1e-6
"""Share of the mean of the normal equations that keeps unseen loads small."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """What explanations come to.

    Attributes
    ----------
    forces : ndarray, shape (3 n,)
        Their mean, or the likeliest if they are apart [N].
    information : ndarray, shape (3 n, 3 n)
        Inverse of its covariance [1/N^2].
    others : ndarray, shape (k, 3 n)
        Other explanations that may be as likely, and apart [N].
    probability : float
        Posterior weight of the explanations that the forces stand for.
    """

    forces: Array
    information: Array
    others: Array
    probability: float = 1.0


def weighed(optima: Sequence[Optimum], information: Array) -> Verdict:
    """Weigh explanations of one frame against each other, by their posterior masses.

    Parameters
    ----------
    optima : sequence of Optimum
        Explanations.
    information : ndarray, shape (3 n, 3 n)
        About the forces, at the first of them [1/N^2].
    """
    spread = covariance_of(information)
    deviations = np.sqrt(np.diag(spread))
    masses = np.array([optimum.mass - _pull(optimum.forces, deviations) / 2 for optimum in optima])
    least = masses.max() - NEGLIGIBLE_LOSS / 2
    order = [i for i in np.argsort(-masses, kind="stable") if masses[i] > least]
    loads = [optima[i].forces for i in order]
    distinct = [
        k
        for k, load in enumerate(loads)
        if all(are_apart(load, other, information) for other in loads[:k])
    ]
    if len(distinct) == 1:
        return Verdict(loads[0], information, np.empty((0, len(deviations))))
    found = np.array(loads)[distinct]
    weights = posterior_weights(masses[np.array(order)[distinct]])
    mean, whole = mixture(weights, found, spread)
    # the widest direction, in units of what noise alone leaves open
    rooted = (found - mean) * np.sqrt(weights)[:, None]
    if np.linalg.eigvalsh(rooted @ information @ rooted.T)[-1] > SPREAD**2 - 1:
        return Verdict(found[0], information, found[1:], float(weights[0]))
    return Verdict(mean, covariance_of(whole), found[:0])


def are_apart(one: Array, other: Array, information: Array) -> bool:
    """Whether two explanations, shape (3 n,), are more than noise around one."""
    difference = one - other  # noise moves each load by one deviation
    return bool(difference @ information @ difference > len(one))


def _pull(forces: Array, deviations: Array) -> float:
    """Loss of an explanation for normal forces that pull, which no contact does."""
    return float((np.minimum(forces[::3] / deviations[::3], 0) ** 2).sum())


@dataclass(frozen=True, eq=False)
class Mirror:
    """Mirror images of forces at the folds of what is seen.

    Attributes
    ----------
    places : Sampling
        Where retardance is looked at.
    dispersions : tuple of float
        Retardance of every wavelength over that of the polariscope's own.
    """

    places: Sampling
    dispersions: tuple[float, ...]

    def images(self, forces: Array, used: Mask | None = None) -> Iterator[Array]:
        """Forces whose retardance is beyond a fold where that of the given ones is not.

        Parameters
        ----------
        forces : ndarray, shape (3 n,)
            Forces [N].
        used : ndarray of bool, shape (P,), optional
            Pixels that count; all if not given.
        """
        vector = self._whole @ forces.astype(np.float32)
        shown = np.ones(vector.shape[1], dtype=bool) if used is None else used[self.places.pixels]
        size = np.hypot(*vector) * shown
        factor = self._factor if used is None else self._solver(shown)
        shape = len(self.places.rows), len(self.places.columns)
        found = []
        for fold in self._folds(size.max()):
            for near in FOLD_DISTANCES:
                beyond = (size > fold - near).reshape(shape)
                regions, count = label(beyond)
                for number in range(1, count + 1):
                    inside = regions.ravel() == number
                    found.append((int(inside.sum()), fold, inside))
        found.sort(key=lambda region: region[0])
        for _, fold, inside in found[:TRIED]:
            # the same direction, as far on the other side
            change = 2 * (fold - size[inside]) / np.maximum(size[inside], 1e-6)
            moved = (vector[:, inside] * change).astype(np.float32)
            pull = np.einsum("fmn,fm->n", self._whole[:, inside], moved)
            yield forces + cho_solve(factor, pull.astype(float))

    def _folds(self, largest: float) -> list[float]:
        """Retardances of the polariscope's own wavelength up to which one wavelength folds."""
        reach = largest + max(FOLD_DISTANCES)
        folds = {
            (k + 0.5) * np.pi / dispersion
            for dispersion in self.dispersions
            for k in range(int(reach * dispersion / np.pi + 0.5))
        }
        return sorted(folds)

    @cached_property
    def _whole(self) -> Single:
        """Retardance of both passes per force, shape (2, m, 3 n)."""
        profile = 2 * self.places.model.profile.sum(axis=0)
        return np.ascontiguousarray(np.einsum("k,fkmn->fmn", profile, self.places.influence))

    @cached_property
    def _factor(self) -> tuple[Array, bool]:
        return self._solver(np.ones(self._whole.shape[1], dtype=bool))

    def _solver(self, shown: Mask) -> tuple[Array, bool]:
        rows = self._whole[:, shown].reshape(-1, self._whole.shape[2])
        normal = (rows.T @ rows).astype(float)
        normal[np.diag_indices(len(normal))] += RIDGE * np.trace(normal) / len(normal)
        return cho_factor(normal)
