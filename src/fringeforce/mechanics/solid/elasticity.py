"""Displacements of a block under unit forces on its top surface, class by class of symmetry."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fringeforce.base.arrays import Array, Index
from fringeforce.base.errors import InputError
from fringeforce.base.progress import Progress
from fringeforce.mechanics.moduli import lame_parameters
from fringeforce.mechanics.solid.block import Block
from fringeforce.mechanics.solid.mesh import BoxMesh
from fringeforce.mechanics.solid.section import Section
from fringeforce.mechanics.solid.slabs import slabs
from fringeforce.mechanics.solid.symmetry import EVEN, ODD, Mirror, mirrored_load


@dataclass(frozen=True, eq=False)
class Loads:
    """Rectangles on the top surface, each under a uniform traction that sums up to a unit force.

    Attributes
    ----------
    places : ndarray, shape (n, 2)
        Centres of the loads along x and y [m].
    size : (float, float)
        Size of each load along x and y [m]; zero is a line or a point.
    components : int
        How many of N, T_x and T_y act on each, from the first.
    """

    places: Array
    size: tuple[float, float]
    components: int = 3

    @cached_property
    def _distinct(self) -> tuple[Array, Index]:
        distances = np.abs(self.places).round(12)
        found, image = np.unique(distances, axis=0, return_inverse=True)
        return found, image.reshape(-1)

    @property
    def quarter(self) -> Array:
        """Centres without the mirror images of others, shape (r, 2)."""
        return self._distinct[0]

    @property
    def parities_across(self) -> tuple[int, ...]:
        """Parities in the mirror across y that the loads have; centred ones along x are even."""
        centred = self.components < 3 and not self.places[:, 1].any()
        return (EVEN,) if centred else (EVEN, ODD)

    def images(self, mirrors: tuple[Mirror, Mirror]) -> tuple[Index, Array]:
        """Which load of the quarter each is an image of, (n,), and its signs, (n, components)."""
        signs = np.ones((len(self.places), self.components))
        for mirror in mirrors:
            beyond = self.places[:, mirror.axis] < -1e-12
            for c, component in enumerate((2, 0, 1)[: self.components]):
                signs[beyond, c] *= mirror.of(component)
        return self._distinct[1], signs

    def check(self, block: Block) -> None:
        """Refuse loads that are not all on the block.

        Raises
        ------
        InputError
            Naming the first.
        """
        reach = np.abs(self.places) + np.array(self.size) / 2
        limits = np.array([block.length, block.width]) / 2
        outside = (reach > limits * (1 + 1e-9)).any(axis=1)
        if outside.any():
            x, y = self.places[outside][0] * 1e3
            raise InputError(
                f"The load at x = {x:g} mm, y = {y:g} mm reaches beyond the block of "
                f"{block.length * 1e3:g} x {block.width * 1e3:g} mm; move it inwards or take a "
                "larger block."
            )


@dataclass(frozen=True, eq=False)
class SymmetricPart:
    """Displacements of a quarter of the block under one class of the loads.

    Attributes
    ----------
    mirrors : (Mirror, Mirror)
        The class: its behaviour in the mirrors across x and y.
    coefficients : ndarray, shape (3, along x, along y, along z, r, components)
        Coefficients of u, v and w per newton on each load of the quarter [m/N].
    """

    mirrors: tuple[Mirror, Mirror]
    coefficients: Array


def symmetric_parts(
    block: Block,
    loads: Loads,
    mesh: BoxMesh,
    progress: Progress | None = None,
) -> Iterator[SymmetricPart]:
    """Solve a block one class of symmetry after the other, all unit forces of each at once.

    Parameters
    ----------
    block : Block
        The layers and their sides.
    loads : Loads
        Where unit forces act.
    mesh : BoxMesh
        The bricks of a quarter.
    progress : callable, optional
        Told of every class.
    """
    loads.check(block)
    across = loads.parities_across
    in_cover = mesh.z[:-1] >= block.interface * (1 + 1e-9)
    lame = [lame_parameters(block.compliant if c else block.photoelastic) for c in in_cover]
    side_x, side_y = block.sides, block.across or block.sides
    lines = mesh.order * (len(mesh.y) - 1) + 1
    for k, parity_y in enumerate(across):
        mirror_y = Mirror(1, parity_y)
        held = np.zeros((3, lines), dtype=bool)
        held[:, 0] = mirror_y.held_inside
        held[:, -1] = mirror_y.held_outside(side_y)
        section = Section(mesh.order, np.diff(mesh.y), np.diff(mesh.z), lame, held)
        outside = Mirror(0, EVEN).held_outside(side_x)
        eliminated = slabs(section, np.diff(mesh.x), outside)
        for i, parity_x in enumerate((EVEN, ODD)):
            if progress:
                progress("classes of symmetry", 2 * k + i, 2 * len(across))
            mirror_x = Mirror(0, parity_x)
            solution = eliminated.solve(
                mirror_x.held_inside,
                _surface_forces(loads, mesh, (mirror_x, mirror_y)),
            )
            shape = (*solution.shape[:-1], len(loads.quarter), loads.components)
            yield SymmetricPart((mirror_x, mirror_y), solution.reshape(shape))
    if progress:
        progress("classes of symmetry", 2 * len(across), 2 * len(across))


def _surface_forces(loads: Loads, mesh: BoxMesh, mirrors: tuple[Mirror, Mirror]) -> Array:
    """Nodal forces on the surface, shape (3, along x, along y, r * components)."""
    p, quarter = mesh.order, loads.quarter
    shape = (p * (len(mesh.x) - 1) + 1, p * (len(mesh.y) - 1) + 1)
    forces = np.zeros((3, *shape, len(quarter), loads.components))
    directions = ((2, -1.0), (0, 1.0), (1, 1.0))  # N presses towards -z
    for c, (component, sign) in enumerate(directions[: loads.components]):
        for r, place in enumerate(quarter):
            along_x, along_y = (
                mirrored_load(p, breaks, place[m.axis], loads.size[m.axis], m.of(component))
                for breaks, m in zip((mesh.x, mesh.y), mirrors, strict=True)
            )
            forces[component, :, :, r, c] = sign * np.outer(along_x, along_y)
    return forces.reshape(3, *shape, -1)
