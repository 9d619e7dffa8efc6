"""Levenberg and Marquardt's method: damped least squares, of any loss that can be expanded.

With g half the derivative of a loss and H half its expected second derivative, a step s solves

    (H + lambda diag H) s = -g

While a step loses, lambda grows tenfold, and after one that gains it falls to a tenth: from Gauss
and Newton's step, lambda = 0, to short ones downhill, the same in whatever units the unknowns are
(Marquardt, SIAM J. 11, 431-441, 1963; Nocedal and Wright, Numerical Optimization, 2006, ch. 10.3).
The compiled loop of `strip_fit` does the same for the pixels of a strip, with these constants.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from fringeforce.base.arrays import Index
from fringeforce.estimation.covariance import covariance_of

Array = NDArray[np.float64]
Place = TypeVar("Place")

FIRST, FACTOR, STRONGEST = 1e-3, 10.0, 1e6
"""Damping to begin with, what it changes by, and where a search for a step that gains gives up."""
MOST_STEPS = 25
"""Steps after which a descent ends in any case; most take a few."""
SLOW = 0.1
"""Share of a promise left after a step, above which the curvature is computed again."""
STALE = 0.01
"""The same for a curvature that was given, before the last step."""


@dataclass(frozen=True, eq=False)
class Curvature:
    """Half the expected second derivative of a loss.

    Attributes
    ----------
    information : ndarray, shape (m, m)
        The matrix H.
    held : ndarray of bool, shape (q,), optional
        Unknowns that it holds; all if not given.  The others are apart from all, and have an
        information of one.
    """

    information: Array
    held: NDArray[np.bool_] | None = None

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.information) if self.held is None else len(self.held)

    def at(self, unknowns: Index) -> Index:
        """Where some of the unknowns that it holds stand in the matrix."""
        return unknowns if self.held is None else np.cumsum(self.held)[unknowns] - 1

    def holds(self, unknowns: Index) -> NDArray[np.bool_]:
        """Whether the matrix holds each of some unknowns."""
        return np.ones(len(unknowns), bool) if self.held is None else self.held[unknowns]

    def kept(self, values: Array) -> Array:
        """Of values of all unknowns, shape (q, ...), those of the ones that it holds."""
        return values if self.held is None else values[self.held]

    @cached_property
    def _factor(self) -> Array | None:
        return _factor(self.information)

    @cached_property
    def covariance(self) -> Array:
        """Covariance of the unknowns whose loss it bends, shape (m, m)."""
        return covariance_of(self.information)

    def step(self, gradient: Array, damping: float = 0.0) -> tuple[Array, float]:
        """The step, shape (m,), and the gain that it promises; not numbers where there is none."""
        factor = self._factor
        if damping:
            diagonal = damping * np.diag(self.information)
            factor = _factor(self.information + np.diag(diagonal))
        if factor is None:
            return np.full_like(gradient, np.nan), np.nan
        held = slice(None) if self.held is None else self.held
        step = -gradient / (1 + damping)
        step[held] = -cho_solve((factor, False), gradient[held], check_finite=False)
        return step, float(-(step @ gradient))


@dataclass(frozen=True, eq=False)
class Expansion(Generic[Place]):
    """A loss about a place.

    Attributes
    ----------
    loss : float
        There.
    gradient : ndarray, shape (m,)
        Half its derivative.
    curvature : callable
        Computes half its expected second derivative.
    ahead : callable
        The place a step (m,) away, and its loss.
    """

    loss: float
    gradient: Array
    curvature: Callable[[], Curvature]
    ahead: Callable[[Array], tuple[Place, float]]


class Stop(NamedTuple):
    """When to stop, by the gain that the undamped step promises.

    Attributes
    ----------
    close : float
        Below it a step is not evaluated any more.
    near : float
        Below it a step by the curvature of the very place is the last, for what it leaves is some
        thousandths of its gain; and so is one that gains less than `close`: it crawls.
    """

    close: float = 0.0
    near: float = 0.0


@dataclass(frozen=True, eq=False)
class Minimum(Generic[Place]):
    """Where a loss is smallest.

    Attributes
    ----------
    place : object
        Evaluated last.
    step : ndarray, shape (m,)
        The way on from there, too short to evaluate.
    gain : float
        By which it lowers the loss, as the expansion promises.
    curvature : Curvature
        Used last.
    converged : bool
        Whether it stopped where it was to, and not for want of steps or of one that gains.
    """

    place: Place
    step: Array
    gain: float
    curvature: Curvature | None
    converged: bool


def minimise(
    start: Place,
    expand: Callable[[Place], Expansion[Place]],
    steps: int,
    stop: Stop,
    within: Callable[[Place], bool] = lambda place: True,
    damping: float = FIRST,
    reuse: bool = False,
    curvature: Curvature | None = None,
    stale: float = STALE,
) -> Minimum[Place]:
    """Descend from a place near the minimum, never to a larger loss.

    Parameters
    ----------
    start : object
        Where to start.
    expand : callable
        Expands the loss about a place.
    steps : int
        Largest number of steps.
    stop : Stop
        When a step is the last.
    within : callable
        Whether the expansion holds at a place, which is otherwise the last.
    damping : float
        Lambda of the first step.
    reuse : bool
        Whether a curvature serves until steps by it leave much.
    curvature : Curvature, optional
        Of a place near by, if it is reused.
    stale : float
        Share of a promise that it may leave before the last step.
    """
    here, step, promised, given = start, np.zeros(0), np.inf, curvature is not None
    converged = False
    for _ in range(steps):
        about, before, fresh = expand(here), promised, curvature is None or not reuse
        if curvature is None or fresh:
            curvature = about.curvature()
        step, promised = curvature.step(about.gradient)
        last = promised < stop.close
        if not fresh and promised > (stale if last and given else SLOW) * before:
            curvature, fresh, given = about.curvature(), True, False
            step, promised = curvature.step(about.gradient)
            last = promised < stop.close
        if last:
            return Minimum(here, step, promised, curvature, converged=True)
        if (found := _gain(about, curvature, damping)) is None:
            break
        here, damping, gained = found
        last = gained < stop.close or (fresh and damping <= FIRST)
        converged = last and promised < stop.near
        if converged or not within(here):
            break
        damping /= FACTOR
    return Minimum(here, np.zeros_like(step), 0.0, curvature, converged)


def _gain(
    about: Expansion[Place], curvature: Curvature, damping: float
) -> tuple[Place, float, float] | None:
    """Where a step ends that gains, its damping and its gain; none if there is no such step."""
    while True:
        step, _ = curvature.step(about.gradient, damping)
        if not np.isfinite(step).all():
            return None
        there, loss = about.ahead(step)
        if loss <= about.loss:
            return there, damping, about.loss - loss
        if damping > STRONGEST:
            return None
        damping = max(FACTOR * damping, FIRST)


def _factor(matrix: Array) -> Array | None:
    """Cholesky's, upper triangle, or None."""
    try:
        return cho_factor(matrix, check_finite=False)[0]
    except LinAlgError:
        return None
