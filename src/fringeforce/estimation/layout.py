"""Where the compiled loops keep pixels: beside those that lie alike between two nodes.

The influence bends so little from pixel to pixel that it, and all that is linear in it, is known
from every eighth pixel, or as many as it takes: the nodes.  A quintic polynomial through six of
them says what lies between.  Pixels at the same distance from the node before them share its
coefficients, and stand in a row, so that every loop runs over neighbours in memory.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.residual_test import GROUP

Array = NDArray[np.float64]
Single = NDArray[np.float32]

TAPS = 6
"""Nodes that a polynomial goes through."""
BEFORE, BEHIND = TAPS // 2 - 1, TAPS // 2
"""Nodes of a polynomial that lie before the node of a pixel, and behind it."""


@dataclass(frozen=True)
class Layout:
    """Pixels row after row: pixel k every + d of a channel is number k of row d.

    Attributes
    ----------
    pixels : int
        Pixels of all channels.
    channels : int
        Channels, one after the other.
    every : int
        Distance of the nodes in pixels, a divisor of GROUP.
    """

    pixels: int
    channels: int
    every: int

    @property
    def length(self) -> int:
        """Pixels of a channel."""
        return self.pixels // self.channels

    @property
    def nodes(self) -> int:
        """Nodes of a channel."""
        return -(-self.length // self.every)

    @property
    def width(self) -> int:
        """Places of a channel."""
        return GROUP - (-(self.nodes + BEHIND) // GROUP) * GROUP

    @property
    def places(self) -> int:
        """Places of a row."""
        return self.channels * self.width

    @property
    def size(self) -> int:
        """Places of all rows."""
        return self.every * self.places

    @cached_property
    def order(self) -> NDArray[np.uint32]:
        """Where the pixels lie, shape (pixels,)."""
        channel, pixel = np.divmod(np.arange(self.pixels), self.length)
        node, row = np.divmod(pixel, self.every)
        places = row * self.places + channel * self.width + GROUP + node
        return places.astype(np.uint32)

    def lay(self, values: Array) -> Single:
        """Values of pixels (pixels, ...) where they lie, shape (..., size); zero elsewhere."""
        laid = np.zeros((*values.shape[1:], self.size), np.float32)
        laid[..., self.order] = values.T
        return laid

    def pick(self, laid: Single) -> Single:
        """Values of the pixels from where they lie, shape (pixels,)."""
        return laid[self.order]

    def at_nodes(self, influence: Array) -> Single:
        """An influence matrix (pixels, m) at the nodes and around the channels' ends.

        Around them lies what makes polynomials near the ends go through the last nodes only.
        """
        laid = self.lay(influence)[:, : self.places].astype(float)
        if self.every == 1:
            return laid.astype(np.float32)
        basis = np.vander(np.arange(-BEFORE, TAPS + BEHIND), TAPS)
        beyond = basis @ np.linalg.inv(basis[BEFORE:-BEHIND])
        for first in range(GROUP, laid.shape[1], self.width):
            last = first + self.nodes
            laid[:, first - BEFORE : first] = laid[:, first : first + TAPS] @ beyond[:BEFORE].T
            laid[:, last : last + BEHIND] = laid[:, last - TAPS : last] @ beyond[-BEHIND:].T
        return laid.astype(np.float32)

    @cached_property
    def shares(self) -> Single:
        """What the nodes around a pixel contribute to it, shape (every, TAPS).

        Lagrange's polynomials at its place between the nodes.
        """
        nodes = np.arange(-BEFORE, BEHIND + 1)
        place = np.arange(self.every)[:, None] / self.every
        rows = np.ones((self.every, TAPS))
        for i in range(TAPS):
            others = np.delete(nodes, i)
            rows[:, i] = np.prod((place - others) / (nodes[i] - others), axis=1)
        return rows.astype(np.float32)
