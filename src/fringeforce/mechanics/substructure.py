"""Direct solution of a tensor mesh, column of elements by column of elements.

Three eliminations, each exact: the inside of every element, then the rungs between the elements of
a column, which leaves a block-tridiagonal system for the vertical mesh lines.  Columns of equal
width share one matrix, and a strip with evenly spaced tactels has few distinct widths, so almost
all of the cost is the block Cholesky factorisation of the lines.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from fringeforce.base.arrays import Array, Index, Mask
from fringeforce.mechanics.elements import element_stiffness
from fringeforce.mechanics.tridiagonal import BlockCholesky, block_cholesky

ROUNDING = 11
"""Digits to which the logarithms of two sizes must agree to count as equal."""


@dataclass(frozen=True)
class _Numbering:
    """Where the unknowns of an element and of a column stand in flat order.

    A column holds (2 components, order + 1 along x, order * rows + 1 along z) unknowns.  Its frame,
    numbered apart, are those on the boundaries of its elements.
    """

    order: int
    rows: int

    @cached_property
    def grid(self) -> Index:
        shape = (2, self.order + 1, self.order * self.rows + 1)
        return np.arange(np.prod(shape)).reshape(shape)

    @cached_property
    def inside(self) -> Index:
        """Unknowns inside one element, in the element's own numbering."""
        local = np.arange(2 * (self.order + 1) ** 2).reshape(2, self.order + 1, self.order + 1)
        return local[:, 1:-1, 1:-1].ravel()

    @cached_property
    def around(self) -> Index:
        """Unknowns on the boundary of one element, in the element's own numbering."""
        return np.setdiff1d(np.arange(2 * (self.order + 1) ** 2), self.inside)

    @cached_property
    def elements(self) -> Index:
        """Column unknowns of each element, shape (rows, 2 (order + 1)^2)."""
        p = self.order
        return np.array(
            [self.grid[:, :, r * p : (r + 1) * p + 1].ravel() for r in range(self.rows)]
        )

    @cached_property
    def frame(self) -> Index:
        """Column unknowns on the boundaries of the elements, ascending."""
        return np.unique(self.elements[:, self.around])

    @cached_property
    def lines(self) -> Index:
        """Column unknowns on the left, then on the right mesh line, above the base."""
        return self.grid[:, [0, -1], 1:].transpose(1, 0, 2).ravel()

    @cached_property
    def top(self) -> Index:
        """Which of the rungs' unknowns belong to the surface."""
        return np.flatnonzero(np.isin(self.rungs, self.grid[:, 1:-1, -1]))

    @cached_property
    def rungs(self) -> Index:
        """Column unknowns on the horizontal edges above the base."""
        return self.grid[:, 1:-1, self.order :: self.order].ravel()

    def in_frame(self, unknowns: Index) -> Index:
        """Column unknowns in the frame's own numbering."""
        return np.searchsorted(self.frame, unknowns)


@dataclass(frozen=True)
class _Column:
    """A column of elements reduced to its two mesh lines, and the way back inside."""

    stiffness: Array  # (2 line, 2 line)
    rungs: Array  # (rungs, 2 line): rung displacements per line displacement
    yielding: Array  # (rungs, top): rung displacements per force on the top edge, lines held
    inside: Array  # (rows, inside, around): inner displacements per boundary displacement


def _eliminated(stiffness: Array, keep: Index, drop: Index) -> tuple[Array, Array]:
    """Schur complement on `keep`, and displacements of `drop` per displacement of `keep`."""
    coupling, dropped = _block(stiffness, drop, keep), _block(stiffness, drop, drop)
    recovery = -np.asarray(np.linalg.solve(dropped, coupling), dtype=np.float64)
    kept = _block(stiffness, keep, keep)
    return kept + np.swapaxes(coupling, -1, -2) @ recovery, recovery


def _block(stiffness: Array, rows: Index, columns: Index) -> Array:
    """Some rows and columns of matrices, much sooner than by an index of both."""
    return stiffness.take(rows, axis=-2).take(columns, axis=-1)


def _columns(
    numbering: _Numbering, widths: Array, heights: Array, c11: Array, c12: Array
) -> list[_Column]:
    """Columns of the given widths; an element's stiffness depends on its shape, not its size."""
    aspect = (heights / widths[:, None]).ravel()
    moduli = np.tile([c11, c12], len(widths))
    _, first, kind = np.unique(
        np.vstack([np.log(aspect).round(ROUNDING), moduli]),
        axis=1,
        return_index=True,
        return_inverse=True,
    )
    elements = element_stiffness(numbering.order, aspect[first], *moduli[:, first])
    shells, inside = _eliminated(elements, numbering.around, numbering.inside)
    return [
        _assembled(numbering, shells[row_kinds], inside[row_kinds])
        for row_kinds in kind.reshape(len(widths), len(heights))
    ]


def _assembled(numbering: _Numbering, shells: Array, inside: Array) -> _Column:
    stiffness = np.zeros((numbering.frame.size,) * 2)
    around = numbering.in_frame(numbering.elements[:, numbering.around])
    for shell, unknowns in zip(shells, around, strict=True):
        stiffness[unknowns[:, None], unknowns] += shell
    lines, rungs = (numbering.in_frame(part) for part in (numbering.lines, numbering.rungs))
    reduced, recovery = _eliminated(stiffness, lines, rungs)
    top = np.eye(len(rungs))[:, numbering.top]
    yielding = np.linalg.solve(_block(stiffness, rungs, rungs), top)
    return _Column(reduced, recovery, np.asarray(yielding, dtype=np.float64), inside)


_Recovery = list[Callable[[Array, Array], Array]]


@dataclass(frozen=True)
class TensorSystem:
    """A factorised strip with a bonded base, ready for any number of loads on its mesh lines."""

    numbering: _Numbering
    columns: list[_Column]
    kind: Index  # (columns,): which of the distinct columns stands where
    lines: BlockCholesky

    def solve(self, loads: Array, between: Array, weights: Array | None = None) -> Array:
        """Displacements for forces on the mesh lines and on the surface between them.

        Parameters
        ----------
        loads : ndarray, shape (lines, 2, order * rows, cases)
            Forces per unit width on the unknowns of the mesh lines, base excluded [N/m].
        between : ndarray, shape (columns, 2, order - 1, cases)
            On those of the columns' upper edges [N/m].
        weights : ndarray, shape (2, order * rows + 1), optional
            By which u and w are added up over the depth; all of them are given if not.

        Returns
        -------
        ndarray, shape (2, order * columns + 1, order * rows + 1 or 1, cases)
            Coefficients of u and w on the tensor grid of shape functions [m].
        """
        lines, between = self._on_lines(loads, between)
        return self._everywhere(self.lines.solve(lines), between, self._recovery(weights))

    def solve_both(
        self, loads: Array, between: Array, weights: Array | None, other: BlockCholesky
    ) -> tuple[Array, Array]:
        """As `solve`, and with other lines, which differ in the last one alone."""
        lines, between = self._on_lines(loads, between)
        recovery = self._recovery(weights)
        here, there = self.lines.solve_both(lines, other)
        return (
            self._everywhere(here, between, recovery),
            self._everywhere(there, between, recovery),
        )

    def _on_lines(self, loads: Array, between: Array) -> tuple[Array, Array]:
        """Forces on the lines, with what those between them push there; and these, flat."""
        cases = loads.shape[-1]
        lines, between = (
            part.reshape(len(part), np.prod(part.shape[1:-1]), cases) for part in (loads, between)
        )
        for c, kind in enumerate(self.kind):
            pushed = self.columns[kind].rungs[self.numbering.top].T @ between[c]
            lines[c : c + 2] += pushed.reshape(2, -1, cases)
        return lines, between

    def _recovery(self, weights: Array | None) -> _Recovery:
        """For each kind of column, from displacements of its lines to all or to their sums."""
        if weights is None:
            return [partial(self._inside, column) for column in self.columns]
        return [partial(self._sums, self._summed(column, weights)) for column in self.columns]

    def _everywhere(self, lines: Array, between: Array, recovery: _Recovery) -> Array:
        """Coefficients as of `solve`, from displacements of the lines."""
        order, cases = self.numbering.order, lines.shape[-1]
        found = [
            recovery[kind](lines[c : c + 2].reshape(-1, cases), between[c])
            for c, kind in enumerate(self.kind)
        ]
        result = np.empty((2, order * len(found) + 1, *found[0].shape[2:]))
        for c, column in enumerate(found):
            result[:, c * order : (c + 1) * order + 1] = column
        return result

    def _inside(self, column: _Column, pair: Array, pushed: Array) -> Array:
        """Displacements of a column, from those of its lines and the forces between them."""
        numbering, cases = self.numbering, pair.shape[-1]
        flat = np.zeros((numbering.grid.size, cases))
        flat[numbering.lines] = pair
        flat[numbering.rungs] = column.rungs @ pair + column.yielding @ pushed
        around = flat[numbering.elements[:, numbering.around]]
        flat[numbering.elements[:, numbering.inside]] = column.inside @ around
        return flat.reshape(*numbering.grid.shape, cases)

    def _summed(self, column: _Column, weights: Array) -> tuple[Array, Array]:
        """What `_inside` and a sum over the depth do, as matrices: its adjoint, row by row."""
        numbering = self.numbering
        rows = np.zeros((2, numbering.order + 1, numbering.grid.size))
        for part, unknowns, weight in zip(rows, numbering.grid, weights, strict=True):
            np.put_along_axis(part, unknowns, weight[None], axis=1)
        rows = rows.reshape(-1, numbering.grid.size)
        for element, inside in zip(numbering.elements, column.inside, strict=True):
            rows[:, element[numbering.around]] += rows[:, element[numbering.inside]] @ inside
        rungs = rows[:, numbering.rungs]
        return rows[:, numbering.lines] + rungs @ column.rungs, rungs @ column.yielding

    def _sums(self, summed: tuple[Array, Array], pair: Array, pushed: Array) -> Array:
        found = summed[0] @ pair + summed[1] @ pushed
        return found.reshape(2, self.numbering.order + 1, 1, -1)


def factorise(
    order: int, widths: Array, heights: Array, c11: Array, c12: Array, held: Mask
) -> TensorSystem:
    """Factorise the stiffness of a strip once, for all loads.

    Parameters
    ----------
    order : int
        Polynomial order of the elements.
    widths : ndarray, shape (columns,)
        Widths of the columns of elements [m].
    heights, c11, c12 : ndarray, shape (rows,)
        Heights [m] and moduli [Pa] of the rows, from the bonded base upwards.
    held : ndarray of bool, shape (columns + 1, 2, order * rows)
        Unknowns of the mesh lines above the base that are held at zero.
    """
    numbering = _Numbering(order, len(heights))
    _, first, kind = np.unique(
        np.log(widths).round(ROUNDING), return_index=True, return_inverse=True
    )
    columns = _columns(numbering, widths[first], heights, c11, c12)
    stiffness = [columns[k].stiffness for k in kind]
    lines = block_cholesky(stiffness, held.reshape(len(held), -1))
    return TensorSystem(numbering, columns, kind, lines)
