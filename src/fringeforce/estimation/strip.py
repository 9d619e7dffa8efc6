"""A sensor's pixels as the compiled loops want them."""

from __future__ import annotations

from collections import namedtuple
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from fringeforce.estimation.freshness import freshness
from fringeforce.estimation.information import even_units, spacing
from fringeforce.estimation.layout import GROUP, Layout
from fringeforce.estimation.likelihood import Response
from fringeforce.estimation.vector_loops import ROWS, Single

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Strip:
    """A sensor's pixels as the compiled loops want them, in rows and single precision.

    Attributes
    ----------
    matrix : ndarray, shape (every, rows, places)
        Influence matrix [rad/N].
    nodes, even : ndarray, shape (rows, places)
        The same at the nodes; and there in units of `units`.
    units : ndarray, shape (loads, loads)
        Units of the loads in which the information is even; see `even_units` [rad/N].
    plain : bool
        Whether they are newtons.
    amplitude, offset : ndarray, shape (size,)
        A and I_o, grey levels.
    inverse, steepness : ndarray, shape (size,)
        Inverse of the noise, zero for pixels that are not used; and the same times A.
    share : ndarray, shape (size // GROUP,)
        Inverse deviation of the noise of a group's sum, in units of that of a pixel; zero for
        groups without a pixel that is used.
    floor, ceiling : float
        Where the converter clips.
    loads, pixels : int
        Number of loads, and of pixels that are used.
    bias, dark : ndarray, shape (size,)
        Phase [rad] and grey level without loads.
    shares : ndarray, shape (every, TAPS)
        Of the nodes around it in a pixel; see `Layout`.
    order : ndarray, shape (P,)
        Where the pixels lie.
    row : int
        First place of the row of which most pixels are used.
    fresh : float
        Bend up to which a matrix is used again; see `freshness`.
    layout : Layout
        The same for others than compiled loops.
    """

    matrix: Single
    nodes: Single
    even: Single
    units: Array
    plain: bool
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
    shares: Single
    order: NDArray[np.uint32]
    row: int
    fresh: float
    layout: Layout

    @classmethod
    def of(
        cls, influence: Array, response: Response, used: NDArray[np.bool_], channels: int = 1
    ) -> Strip:
        """From the influence matrix (P, m), the camera's response and the pixels to use."""
        layout = Layout(len(influence), channels, spacing(influence, used, channels))
        rows, even = np.zeros((2, len(influence), -(-influence.shape[1] // ROWS) * ROWS))
        rows[:, : influence.shape[1]] = influence
        units = even_units(influence, used)
        even[:, : influence.shape[1]] = solve_triangular(units, influence.T, lower=True).T
        return cls(
            matrix=np.ascontiguousarray(
                layout.lay(rows).reshape(-1, layout.every, layout.places).swapaxes(0, 1)
            ),
            nodes=layout.at_nodes(rows),
            even=layout.at_nodes(even),
            units=units,
            plain=np.array_equal(units, np.eye(len(units))),
            fresh=freshness(influence[used], response.at(used)),
            loads=influence.shape[1],
            shares=layout.shares,
            order=layout.order,
            layout=layout,
            **_seen(layout, response, used),
        )

    def under(self, response: Response, used: NDArray[np.bool_]) -> Strip:
        """The same strip in another light, or through other pixels."""
        return replace(self, **_seen(self.layout, response, used))

    def without(self, used: NDArray[np.bool_]) -> Strip:
        """The same strip through fewer pixels."""
        seen = self.layout.lay(used.astype(float))
        return replace(
            self,
            inverse=self.inverse * seen,
            steepness=self.steepness * seen,
            share=_shares(self.layout, seen),
            pixels=int(used.sum()),
            row=_fullest(self.layout, seen),
        )

    @cached_property
    def watched(self) -> Single:
        """One for nodes with a pixel that is used, zero for others, shape (places,)."""
        return np.any(self.inverse.reshape(-1, self.layout.places) > 0, axis=0).astype(np.float32)

    @property
    def groups(self) -> int:
        """Groups of neighbouring pixels of which at least one is used."""
        return int(np.count_nonzero(self.share))

    @cached_property
    def arrays(self) -> Pixels:
        """What the compiled functions take."""
        return Pixels(*(getattr(self, name) for name in Pixels._fields))


Pixels = namedtuple("Pixels", [field.name for field in fields(Strip) if field.name != "layout"])
"""What the compiled functions take of a strip, under the same names."""


def _seen(layout: Layout, response: Response, used: NDArray[np.bool_]) -> dict[str, Any]:
    """What the light and the pixels to use decide."""
    whole, inverse = np.ones(len(used)), used / np.sqrt(response.variance)
    seen = layout.lay(used.astype(float))
    return {
        "amplitude": layout.lay(whole * response.amplitude),
        "offset": layout.lay(whole * response.offset),
        "inverse": layout.lay(inverse),
        "steepness": layout.lay(inverse * response.amplitude),
        "share": _shares(layout, seen),
        "row": _fullest(layout, seen),
        "floor": float(response.floor),
        "ceiling": float(response.ceiling),
        "pixels": int(used.sum()),
        "bias": layout.lay(whole * response.bias),
        "dark": layout.lay(response.level(0 * whole)),
    }


def _shares(layout: Layout, seen: Single) -> Single:
    """Inverse square roots of the numbers of used pixels in groups."""
    counts = seen.reshape(layout.every, -1, GROUP // layout.every).sum(axis=(0, 2))
    return np.divide(1, np.sqrt(counts), out=np.zeros_like(counts), where=counts > 0)


def _fullest(layout: Layout, seen: Single) -> int:
    """First place of the row of which most pixels are used."""
    return layout.places * int(seen.reshape(layout.every, -1).sum(axis=1).argmax())
