"""A sensor's pixels as the compiled loops want them."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
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
        return cls(
            matrix=chunked_matrix(influence),
            nodes=chunked_matrix(influence[::every]),
            loads=influence.shape[1],
            every=every,
            count=len(influence[::every]),
            **_seen(response, used),
        )

    def under(self, response: Response, used: NDArray[np.bool_]) -> Strip:
        """The same strip in another light, or through other pixels."""
        return replace(self, **_seen(response, used))

    def without(self, used: NDArray[np.bool_]) -> Strip:
        """The same strip through fewer pixels."""
        seen = chunked(used.astype(float))
        return replace(
            self,
            inverse=self.inverse * seen,
            steepness=self.steepness * seen,
            share=_shares(seen),
            pixels=int(used.sum()),
        )

    @cached_property
    def watched(self) -> Single:
        """One for nodes with a pixel that is used, zero for others, shape (fewer chunks, CHUNK)."""
        seen = self.inverse.reshape(-1)[: self.count * self.every].reshape(-1, self.every)
        return chunked(1.0 * np.any(seen > 0, axis=1))

    @property
    def groups(self) -> int:
        """Groups of neighbouring pixels of which at least one is used."""
        return int(np.count_nonzero(self.share))

    @cached_property
    def arrays(self) -> tuple[Any, ...]:
        """What the compiled functions take."""
        return tuple(getattr(self, field.name) for field in fields(self))


def _seen(response: Response, used: NDArray[np.bool_]) -> dict[str, Any]:
    """What the light and the pixels to use decide."""
    whole, inverse = np.ones(len(used)), used / np.sqrt(response.variance)
    return {
        "amplitude": chunked(whole * response.amplitude),
        "offset": chunked(whole * response.offset),
        "inverse": chunked(inverse),
        "steepness": chunked(inverse * response.amplitude),
        "share": _shares(chunked(used.astype(float))),
        "floor": float(response.floor),
        "ceiling": float(response.ceiling),
        "pixels": int(used.sum()),
        "bias": chunked(whole * response.bias),
        "dark": chunked(response.level(0 * whole)),
    }


def _shares(seen: Single) -> Single:
    """Inverse numbers of used pixels in groups."""
    counts = seen.reshape(-1, CHUNK // GROUP, GROUP).sum(axis=2)
    return np.divide(1, counts, out=np.zeros_like(counts), where=counts > 0)
