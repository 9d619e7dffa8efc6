"""Tactels further along, whose contacts look alike under a camera that is shifted as much."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.hypotheses import NEGLIGIBLE_LOSS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TactelAlias:
    """What one explanation looks like on other tactels.

    Attributes
    ----------
    shift : int
        Number of the unknown of the camera's shift.
    pitch : float
        Its deviations from one tactel to the next.
    count : tuple of int
        Tactels along each axis.
    axis : int
        Along which the camera is shifted.
    """

    shift: int
    pitch: float
    count: tuple[int, ...]
    axis: int = 0

    def between(self, unknowns: Array, others: Array) -> bool:
        """Whether two explanations, unknowns of shape (q,) each, are of other tactels."""
        return bool(abs(unknowns[self.shift] - others[self.shift]) > self.pitch / 2)

    def images(
        self, loads: Array, unknowns: Array, loss: Callable[[Array], float]
    ) -> Iterator[tuple[Array, Array]]:
        """Starts on tactels further along either way, as far as the prior leaves them weight.

        Parameters
        ----------
        loads : ndarray, shape (c n,)
            Of an explanation [N].
        unknowns : ndarray, shape (q,)
            Its unknowns.
        loss : callable
            From unknowns to what the prior of the shift adds to the loss.

        Yields
        ------
        loads, unknowns : ndarray
            As the parameters.
        """
        most = loss(unknowns) + NEGLIGIBLE_LOSS
        for way in (-1, 1):
            for step in range(1, self.count[self.axis]):
                moved = unknowns.copy()
                moved[self.shift] += way * step * self.pitch
                if loss(moved) > most:
                    break
                yield self._moved(loads, way * step), moved

    def _moved(self, loads: Array, steps: int) -> Array:
        """Loads so many tactels further along; what leaves the last ones is left out."""
        grid = np.moveaxis(loads.reshape(*self.count, -1), self.axis, 0)
        moved = np.zeros_like(grid)
        if steps > 0:
            moved[steps:] = grid[:-steps]
        else:
            moved[:steps] = grid[-steps:]
        return np.moveaxis(moved, 0, self.axis).ravel()
