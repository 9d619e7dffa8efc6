"""Values of all unknowns of a bench, and what is expected of those that all frames share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from fringeforce.base.arrays import Array
from fringeforce.estimation.shared_fit import Eliminated


@dataclass(frozen=True, eq=False)
class State:
    """Values of all unknowns: the shared ones (S,), and those of every frame."""

    shared: Array
    own: list[Array]

    def moved(self, step: Array, told: list[Eliminated]) -> State:
        """A step (S,) of the shared unknowns away, which the others follow."""
        return self.by(step, [one.step + one.response @ step[one.which] for one in told])

    def by(self, shared: Array, own: Sequence[Array]) -> State:
        """Steps (S,) of the shared unknowns and those of every frame away."""
        moved = [value + step for value, step in zip(self.own, own, strict=True)]
        return State(self.shared + shared, moved)


@dataclass(frozen=True, eq=False)
class Expected:
    """What is expected before the frames are seen.

    Attributes
    ----------
    precision : ndarray, shape (S,)
        Of the shared unknowns, whose mean is zero.
    sizes : dict of str to float
        How much each of GROUPS scatters: forces over the whole force of the contact, places and
        widths and light in the units of the model.
    """

    precision: Array
    sizes: dict[str, float] = field(default_factory=dict)

    @property
    def information(self) -> Array:
        """What is known of the shared unknowns together, shape (S, S)."""
        return np.diag(self.precision)

    def loss(self, shared: Array) -> float:
        """Twice the negative logarithm of what is expected of the shared unknowns (S,)."""
        return float(self.precision @ np.square(shared))

    def slope(self, shared: Array) -> Array:
        """Half the derivative of that, shape (S,)."""
        return self.precision * shared

    def freedom(self, covariance: Array) -> float:
        """How many of the shared unknowns frames tell that leave them with a covariance (S, S)."""
        return float((1 - self.precision * np.diag(covariance)).sum())


@dataclass(frozen=True, eq=False)
class ExpectedTogether(Expected):
    """What is known of shared unknowns together, such as by an earlier calibration.

    Attributes
    ----------
    mean : ndarray, shape (S,)
        Of the shared unknowns.
    together : ndarray, shape (S, S)
        Inverse of their covariance.
    """

    mean: Array = field(kw_only=True)
    together: Array = field(kw_only=True)

    @property
    def information(self) -> Array:
        """What is known of the shared unknowns together, shape (S, S)."""
        return self.together.copy()

    def loss(self, shared: Array) -> float:
        """As of `Expected`."""
        return float((shared - self.mean) @ self.slope(shared))

    def slope(self, shared: Array) -> Array:
        """As of `Expected`."""
        return self.together @ (shared - self.mean)

    def freedom(self, covariance: Array) -> float:
        """As of `Expected`."""
        return float(len(covariance) - (self.together * covariance).sum())
