"""A sensor's pixels as the compiled loops want them."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fringeforce.force.information import spacing
from fringeforce.force.likelihood import Response
from fringeforce.force.vector_loops import CHUNK, Single, chunked, chunked_matrix

Array = NDArray[np.float64]

GROUP = 16
"""Neighbouring pixels that are summed to find a misfit that noise would average away."""


@dataclass(frozen=True, eq=False)
class Strip:
    """A sensor's pixels as the compiled loops want them, in chunks and single precision.

    Attributes
    ----------
    matrix : ndarray, shape (chunks, rows, CHUNK)
        Influence matrix [rad/N].
    nodes : ndarray, shape (fewer chunks, rows, CHUNK)
        The same at every fourth pixel, or as many as it takes; see `information`.
    amplitude, offset : ndarray, shape (chunks, CHUNK)
        A and I_o, grey levels.
    inverse, steepness : ndarray, shape (chunks, CHUNK)
        Inverse of the noise, zero for pixels that are not used; and the same times A.
    share : ndarray, shape (chunks, CHUNK // GROUP)
        Inverse of the number of used pixels in a group, zero if there are none.
    floor, ceiling : float
        Where the converter clips.
    loads, pixels : int
        Number of loads, and of pixels that are used.
    bias, dark : ndarray, shape (chunks, CHUNK)
        Phase [rad] and grey level without loads.
    every, count : int
        Distance of the nodes in pixels, and their number.
    """

    matrix: Single
    nodes: Single
    amplitude: Single
    offset: Single
    inverse: Single
    steepness: Single
    share: Single
    floor: float
    ceiling: float
    loads: int
    pixels: int
    bias: Single
    dark: Single
    every: int
    count: int

    @classmethod
    def of(cls, influence: Array, response: Response, used: NDArray[np.bool_]) -> Strip:
        """From the influence matrix (P, m), the camera's response and the pixels to use."""
        every = spacing(influence, used)
        whole, inverse = np.ones(len(influence)), used / np.sqrt(response.variance)
        counts = chunked(used.astype(float)).reshape(-1, CHUNK // GROUP, GROUP).sum(axis=2)
        return cls(
            matrix=chunked_matrix(influence),
            nodes=chunked_matrix(influence[::every]),
            amplitude=chunked(whole * response.amplitude),
            offset=chunked(whole * response.offset),
            inverse=chunked(inverse),
            steepness=chunked(inverse * response.amplitude),
            share=np.divide(1, counts, out=np.zeros_like(counts), where=counts > 0),
            floor=float(response.floor),
            ceiling=float(response.ceiling),
            loads=influence.shape[1],
            pixels=int(used.sum()),
            bias=chunked(whole * response.bias),
            dark=chunked(response.level(0 * whole)),
            every=every,
            count=len(influence[::every]),
        )

    @property
    def groups(self) -> int:
        """Groups of neighbouring pixels of which at least one is used."""
        return int(np.count_nonzero(self.share))

    @property
    def arrays(self) -> tuple[Any, ...]:
        """What the compiled functions take."""
        return tuple(getattr(self, field.name) for field in fields(self))
