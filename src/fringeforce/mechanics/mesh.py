"""Tensor meshes that follow the design: fine where the solution is rough, coarse elsewhere.

Three things make the stresses rough: each tactel's line load, felt over a distance of about the
cover's thickness; the corners where a free edge meets the base or the interface, where stresses are
singular (Williams, J. Appl. Mech. 19, 1952); and nothing else.  Elements therefore grow in
geometric progression away from loads and corners, and high order does the rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.design.strip import Transducer
from fringeforce.mechanics.gauss_rule import gauss_rule

ORDER = 7
"""Polynomial order of the default mesh."""

# First element and growth beside a line load, in cover thicknesses, along the strip and into it.
LOAD_X, GROWTH_X = 0.8, 2.0
LOAD_Z, GROWTH_Z = 0.2, 2.4
# First element below the interface, in cover thicknesses, and growth from there to the base.
BELOW, GROWTH_BELOW = 1.2, 3.0
# First element, in thicknesses of the whole strip, and growth beside a singular corner.
CORNER, CORNER_GROWTH = 0.01, 10.0
# Largest element, in thicknesses of the whole strip.
LARGEST = 0.8


@dataclass(frozen=True, eq=False)
class Mesh:
    """Rectangular elements of one polynomial order on the product of two subdivisions.

    Attributes
    ----------
    x : ndarray, shape (columns + 1,)
        Element boundaries along the strip, ascending [m].
    z : ndarray, shape (rows + 1,)
        Element boundaries through the depth, from the bonded base up to the surface z = 0 [m].
    order : int
        Polynomial order of the displacements in both directions.
    """

    x: Array
    z: Array
    order: int

    def __post_init__(self) -> None:
        if self.order < 1:
            raise InputError(f"order = {self.order} is no polynomial order; take 1 or more.")

    @property
    def unknowns(self) -> int:
        """Displacements that are solved for, supports at the edges included."""
        return 2 * (self.order * (len(self.x) - 1) + 1) * self.order * (len(self.z) - 1)

    @property
    def stations(self) -> Array:
        """Gauss points of the columns, shape (order * columns,) [m].

        Stresses converge one order faster there than elsewhere (Barlow, Int. J. Numer. Methods
        Eng. 10, 1976).
        """
        points = (gauss_rule(self.order)[0] + 1) / 2
        return (self.x[:-1, None] + np.diff(self.x)[:, None] * points).ravel()

    def refined(self, factor: int) -> Mesh:
        """The mesh with every element cut `factor` times in both directions."""
        if factor < 1:
            raise InputError(f"A mesh cannot be refined by {factor}; the factor is 1 or more.")
        return Mesh(cut(self.x, factor), cut(self.z, factor), self.order)


def cut(breaks: Array, factor: int) -> Array:
    """Every interval between boundaries cut into equal ones."""
    fractions = np.arange(factor) / factor
    inner = breaks[:-1, None] + np.diff(breaks)[:, None] * fractions
    return np.append(inner.ravel(), breaks[-1])


class Progression(NamedTuple):
    """Sizes that start at `first` and grow by `growth`, never beyond `largest` [m].

    Up to `usual` they grow by `steep`, if that is more.
    """

    first: float
    growth: float
    largest: float
    usual: float = 0.0
    steep: float = 1.0

    def size(self, index: int) -> float:
        """Length of one interval, counted from the beginning [m]."""
        first, growths = self.first, min(index, 99)  # then far beyond the largest, and a float
        if self.steep > self.growth and first < self.usual:
            steps = int(np.ceil(np.log(self.usual / first) / np.log(self.steep)))
            if growths < steps:
                return min(first * self.steep**growths, self.largest)
            first, growths = self.usual, growths - steps
        return min(first * self.growth**growths, self.largest)


def subdivision(length: float, left: Progression, right: Progression) -> Array:
    """Sizes that fill `length`, grown from both ends towards the middle, none larger than asked."""
    sizes: tuple[list[float], list[float]] = ([], [])
    ends = (left, right)
    while sum(sizes[0]) + sum(sizes[1]) < length * (1 - 1e-9):
        following = [end.size(len(grown)) for end, grown in zip(ends, sizes, strict=True)]
        side = int(following[1] < following[0])
        sizes[side].append(following[side])
    filled = np.array(sizes[0] + sizes[1][::-1])
    return filled * (length / filled.sum())


def strip_mesh(
    transducer: Transducer,
    positions: ArrayLike,
    order: int = ORDER,
    finest: ArrayLike = np.inf,
    steep: float = GROWTH_X,
) -> Mesh:
    """The mesh that a design asks for.

    Parameters
    ----------
    transducer : Transducer
        The strip.
    positions : array_like, shape (n,)
        Where the tactels' line loads act, ascending [m].
    order : int
        Polynomial order of the elements.
    finest : array_like, shape () or (n,)
        Largest first element beside each line load, along the strip and into it [m].
    steep : float
        Growth of elements along the strip up to the size at which they begin without `finest`.
    """
    a, b = transducer.compliant.thickness, transducer.photoelastic.thickness
    half, depth = transducer.length / 2, a + b
    corner = CORNER * depth if transducer.edges == "free" else np.inf

    edge = Progression(corner, CORNER_GROWTH, LARGEST * depth)
    marks = np.concatenate([[-half], np.asarray(positions, dtype=float), [half]])
    first = np.broadcast_to(finest, len(marks) - 2)
    usual = LOAD_X * a
    loads = [
        Progression(min(usual, one), GROWTH_X, LARGEST * depth, usual, steep)
        for one in first.tolist()
    ]
    ends = [edge, *loads, edge]
    widths = [
        subdivision(gap, ends[i], ends[i + 1]) for i, gap in enumerate(np.diff(marks)) if gap > 0
    ]
    surface = Progression(float(first.min(initial=LOAD_Z * a)), GROWTH_Z, a)
    above = Progression(corner, CORNER_GROWTH, a)
    below = Progression(min(corner, BELOW * a), GROWTH_BELOW, b)
    base = Progression(corner, CORNER_GROWTH, b)
    heights = [subdivision(b, base, below), subdivision(a, above, surface)]
    x = np.cumsum(np.concatenate([[-half], *widths]))
    z = np.cumsum(np.concatenate([[-a - b], *heights]))
    return Mesh(snapped(x, marks), snapped(z, np.array([-a - b, -a, 0.0])), order)


def paper_mesh(transducer: Transducer, positions: ArrayLike) -> Mesh:
    """The subdivision of the paper: 201 x 25 bilinear nodes, half of the columns under the tactels.

    Section II gives the numbers of nodes and that the middle is finer; where exactly the nodes lay
    is not printed, so they are spread evenly within each part.

    Parameters
    ----------
    transducer : Transducer
        The strip.
    positions : array_like, shape (n,)
        Where the tactels' line loads act, evenly spaced and ascending [m]; at most 101 of them.
    """
    columns, rows = 200, 24
    a, b = transducer.compliant.thickness, transducer.photoelastic.thickness
    tactels = np.asarray(positions, dtype=float)
    gaps = len(tactels) - 1
    if gaps > columns // 2:
        raise InputError(
            f"The paper's mesh has room for 101 tactels, not {len(tactels)}; use the default mesh."
        )
    inner = gaps * (columns // 2 // max(gaps, 1))
    left = (columns - inner) // 2
    half = transducer.length / 2
    x = np.concatenate(
        [
            np.linspace(-half, tactels[0], left + 1)[:-1],
            np.linspace(tactels[0], tactels[-1], inner + 1) if gaps else tactels,
            np.linspace(tactels[-1], half, columns - inner - left + 1)[1:],
        ]
    )
    clear = min(max(round(rows * b / (a + b)), 1), rows - 1)
    z = np.concatenate(
        [np.linspace(-a - b, -a, clear + 1)[:-1], np.linspace(-a, 0.0, rows - clear + 1)]
    )
    return Mesh(snapped(x, tactels), z, order=1)


def snapped(breaks: Array, marks: Array) -> Array:
    """Put the boundaries that stand for given marks exactly on them, rounding removed."""
    breaks = breaks.copy()
    breaks[np.abs(breaks[:, None] - marks).argmin(axis=0)] = marks
    return breaks


def named_mesh(name: str, transducer: Transducer, positions: ArrayLike) -> Mesh:
    """A mesh by its name: "paper" for the 201 x 25 nodes of the paper, "default" for our own.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    build = {"default": strip_mesh, "paper": paper_mesh}.get(name)
    if build is None:
        raise InputError(f"There is no mesh called {name!r}; choose 'default' or 'paper'.")
    return build(transducer, positions)
