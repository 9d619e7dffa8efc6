"""Displacement and stress of a block as a file for ParaView and its kin."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Index
from fringeforce.base.errors import FileFormatError
from fringeforce.base.progress import Progress
from fringeforce.base.storage import whole_file
from fringeforce.contacts.loads import checked_loads
from fringeforce.design.strip import Sensor
from fringeforce.mechanics.mesh import cut
from fringeforce.mechanics.solid.block import Block
from fringeforce.mechanics.solid.elasticity import Loads
from fringeforce.mechanics.solid.fields import displacement, stress, superposed
from fringeforce.mechanics.solid.mesh import BoxMesh, box_mesh
from fringeforce.mechanics.solid.strip import STRIP, strip_block, strip_loads

if TYPE_CHECKING:
    import meshio


def write_vtu(
    path: str | os.PathLike[str],
    block: Block,
    loads: Loads,
    mesh: BoxMesh,
    forces: ArrayLike,
    progress: Progress | None = None,
) -> None:
    """Write the fields of one load, all of them or nothing.

    Every brick is cut by its order in all directions, into cells that programs draw with straight
    edges.  Points carry the displacement [m], cells the stress tensor at their centres [Pa], row by
    row, and the layer: 1 for the cover, 2 for the photoelastic one.

    Parameters
    ----------
    path : path
        File to write, ending in .vtu.
    block, loads, mesh
        What is loaded, where, and its bricks.
    forces : array_like, shape (n, components)
        N, T_x and T_y on every tactel [N].
    progress : callable, optional
        Told words, the steps done and their count.

    Raises
    ------
    FileFormatError
        If the file cannot be written, or has another ending.
    """
    target = Path(path)
    if target.suffix != ".vtu":
        raise FileFormatError(f"{target} must end in .vtu, the format that is written.")
    with whole_file(target) as place:
        _grid(block, loads, mesh, forces, progress).write(place)


def write_strip_vtu(
    path: str | os.PathLike[str],
    sensor: Sensor,
    forces: ArrayLike,
    progress: Progress | None = None,
) -> None:
    """Write the fields of a design's strip in three dimensions, forces of shape (n, 2) [N]."""
    strip, tactels = sensor.transducer, sensor.tactels
    block, loads = strip_block(strip), strip_loads(strip, tactels.positions)
    mesh = box_mesh(block, tactels.positions, [], STRIP)
    write_vtu(path, block, loads, mesh, checked_loads(forces, tactels.count), progress)


def _grid(
    block: Block, loads: Loads, mesh: BoxMesh, forces: ArrayLike, progress: Progress | None
) -> meshio.Mesh:
    """The fields of one load on a grid of hexahedra."""
    import meshio  # takes a while to import, and few need it

    parts = superposed(block, loads, mesh, forces, progress)
    halves = [cut(breaks, mesh.order) for breaks in (mesh.x, mesh.y)]
    x, y = (np.concatenate([-half[:0:-1], half]) for half in halves)
    z = cut(mesh.z, mesh.order)
    moved = displacement(parts, mesh, x, y, z)
    middles = [(breaks[1:] + breaks[:-1]) / 2 for breaks in (x, y, z)]
    tensor = stress(block, parts, mesh, *middles)
    layer = np.broadcast_to(np.where(middles[2] > block.interface, 1, 2), tensor.shape[2:])
    return meshio.Mesh(
        np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3),
        [("hexahedron", _hexahedra(len(x), len(y), len(z)))],
        {"displacement": moved.reshape(3, -1).T},
        {"stress": [tensor.reshape(9, -1).T], "layer": [layer.ravel()]},
    )


def _hexahedra(nx: int, ny: int, nz: int) -> Index:
    """Corners of every cell of a grid of points, in VTK's order, shape (cells, 8)."""
    number = np.arange(nx * ny * nz).reshape(nx, ny, nz)
    ends = slice(None, -1), slice(1, None)
    ring = ((0, 0), (1, 0), (1, 1), (0, 1))
    corners = [number[ends[i], ends[j], ends[k]].ravel() for k in (0, 1) for i, j in ring]
    return np.stack(corners, axis=1)
