"""The strip as it is: line loads across its whole width, side faces free."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array

from fringeforce.base.arrays import Array
from fringeforce.base.progress import Progress
from fringeforce.design.strip import Transducer
from fringeforce.mechanics.elements import gauss_interpolation, integrals
from fringeforce.mechanics.mesh import Mesh
from fringeforce.mechanics.moduli import lame_parameters
from fringeforce.mechanics.solid.block import Block
from fringeforce.mechanics.solid.elasticity import Loads, symmetric_parts
from fringeforce.mechanics.solid.influence import light_stresses
from fringeforce.mechanics.solid.mesh import BoxMesh, Grading, box_mesh

STRIP = Grading(order=5, load=1.6, surface=0.6, below=1.2, corner=0.1)
"""Bricks of a strip; the study of its width shows what they leave."""
QUICK = replace(STRIP, order=3)
"""Bricks that solve a strip in a second; phases are within 2.4 % of finer ones, see
docs/measured/solid.txt."""
STRIDE = 5
"""Of line loads in a row, every so many are solved together: few bricks lie between them."""
KEPT = 16
"""Solutions that are kept, some hundred kilobytes each where the light crosses a narrow line."""


@dataclass(frozen=True, eq=False)
class LightLine:
    """What a camera's line sees of a strip in three dimensions, and how finely it is solved.

    Attributes
    ----------
    y, weights : ndarray, shape (ny,)
        Places across the strip that the light crosses [m], and their shares of it.
    like : Transducer, optional
        Strip whose bricks are taken, each as much larger as its layer is.
        Between strips with bricks alike, differences are smooth.
    mesh : Grading
        Sizes of the bricks.
    """

    y: Array
    weights: Array
    like: Transducer | None = None
    mesh: Grading = STRIP


@dataclass(frozen=True, eq=False)
class StripIntegral:
    """Depth integrals of stresses of a strip in three dimensions, per unit tactel force.

    Attributes
    ----------
    breaks : ndarray, shape (e + 1,)
        Boundaries of the elements along the strip [m].
    y : ndarray, shape (ny,)
        Places across the strip [m].
    difference, shear : ndarray, shape (ny, M, n, 2)
        Integrals of sigma_x - sigma_y and of tau_xy over the photoelastic layer, at the elements'
        Gauss points [Pa m / N].
    unknowns, order : int
        Unknowns of the quarter of the strip that was solved, and order of its elements.
    """

    breaks: Array
    y: Array
    difference: Array
    shear: Array
    unknowns: int
    order: int


def strip_block(transducer: Transducer) -> Block:
    """The strip as a block: its ends as designed, its side faces free."""
    return Block(
        transducer.length,
        transducer.width,
        transducer.compliant,
        transducer.photoelastic,
        sides=transducer.edges,
        across="free",
    )


def strip_loads(transducer: Transducer, positions: ArrayLike) -> Loads:
    """Normal and tangential line loads across the width, places of shape (n,) [m]."""
    places = np.asarray(positions, dtype=float)
    return Loads(np.stack([places, np.zeros_like(places)], axis=1), (0.0, transducer.width), 2)


def strip_integral(
    transducer: Transducer,
    positions: ArrayLike,
    y: ArrayLike,
    mesh: BoxMesh | Grading = STRIP,
    progress: Progress | None = None,
) -> StripIntegral:
    """Depth integrals of the stresses that light sees, at given places across the strip.

    Parameters
    ----------
    transducer : Transducer
        The strip; its plane state does not matter.
    positions : array_like, shape (n,)
        Where the tactels' line loads act [m].
    y : array_like, shape (ny,)
        Places across the strip [m].
    mesh : BoxMesh or Grading
        The bricks, or their sizes.
    progress : callable, optional
        Told words, the steps done and their count.
    """
    block = strip_block(transducer)
    if not isinstance(mesh, BoxMesh):
        mesh = box_mesh(block, positions, [], mesh)
    places, across = (np.asarray(values, dtype=float) for values in (positions, y))
    asked = _Asked(_marks(transducer, places, across, mesh), transducer, places, across, mesh)
    return _kept(asked) if progress is None else _solved(asked, progress)


def _marks(transducer: Transducer, places: Array, across: Array, mesh: BoxMesh) -> Hashable:
    """All that stresses depend on: of a layer's material Lame's parameters alone."""
    layers = transducer.compliant, transducer.photoelastic
    whole = transducer.length, transducer.width, transducer.edges, mesh.order
    solid = tuple((layer.thickness, *lame_parameters(layer)) for layer in layers)
    arrays = tuple(one.tobytes() for one in (places, across, mesh.x, mesh.y, mesh.z))
    return whole, solid, arrays


@dataclass(frozen=True)
class _Asked:
    """What stresses are asked for, the same where its marks are."""

    marks: Hashable
    transducer: Transducer = field(compare=False)
    places: Array = field(compare=False)
    across: Array = field(compare=False)
    mesh: BoxMesh = field(compare=False)


@lru_cache(maxsize=KEPT)
def _kept(asked: _Asked) -> StripIntegral:
    """As `_solved`; other tactels, tolerances and optical effects ask for the same again."""
    found = _solved(asked, None)
    for values in (found.difference, found.shear):
        values.flags.writeable = False
    return found


def _solved(asked: _Asked, progress: Progress | None) -> StripIntegral:
    """`strip_integral` on given bricks."""
    transducer, across, mesh = asked.transducer, asked.across, asked.mesh
    block, loads = strip_block(transducer), strip_loads(transducer, asked.places)
    breaks = np.concatenate([-mesh.x[:0:-1], mesh.x])
    stations = Mesh(breaks, np.empty(0), mesh.order).stations
    shape = (len(across), len(stations), len(loads.places), 2)
    totals = np.zeros(shape), np.zeros(shape)
    depth = csr_array(_depth_weights(block, mesh)[None])
    for part in symmetric_parts(block, loads, mesh, progress=progress):
        image, signs = loads.images(part.mirrors)
        for component in (0, 1):
            stresses = light_stresses(block, part, mesh, (stations, across), depth, component)
            for total, stress in zip(totals, stresses, strict=True):
                lines = stress[:, :, 0].transpose(1, 0, 2)
                total[..., component] += lines[..., image] * signs[:, component]
    return StripIntegral(breaks, across, *totals, mesh.unknowns, mesh.order)


def line_stress(transducer: Transducer, places: Array, x: Array, line: LightLine) -> Array:
    """Depth integral of the stress difference that a camera's line sees, under line loads.

    Parameters
    ----------
    transducer : Transducer
        The strip.
    places : ndarray, shape (k,)
        Of the line loads, multiples of one length in a row [m].
    x : ndarray, shape (m,)
        Where it is wanted [m].
    line : LightLine
        Where the light crosses the strip.

    Returns
    -------
    ndarray, shape (m, k, 2)
        Under a normal and a tangential unit force [Pa m / N].
    """
    found = np.empty((len(x), len(places), 2))
    number = np.round(places / np.diff(places).mean()).astype(int)
    group = np.minimum(number % STRIDE, -number % STRIDE)  # with the mirror images
    block, drawn = strip_block(transducer), strip_block(line.like or transducer)
    old, new = ([strip.base, strip.interface, 0.0] for strip in (drawn, block))
    for one in np.unique(group):
        some = places[group == one]
        bricks = box_mesh(drawn, some, [], line.mesh)
        bricks = replace(
            bricks,
            x=np.append(bricks.x[:-1], block.length / 2),
            y=bricks.y * (block.width / drawn.width),
            z=np.interp(bricks.z, old, new),
        )
        solved = strip_integral(transducer, some, line.y, bricks)
        seen = np.tensordot(line.weights, solved.difference, 1)
        at = gauss_interpolation(solved.order, solved.breaks, x)
        found[:, group == one] = (at @ seen.reshape(len(seen), -1)).reshape(len(x), -1, 2)
    return found


def _depth_weights(block: Block, mesh: BoxMesh) -> Array:
    """Integrals of the shape functions along z over the photoelastic layer [m]."""
    rows = int(np.searchsorted(mesh.z, block.interface * (1 + 1e-9)))
    below = integrals(mesh.order, mesh.z[: rows + 1])
    return np.pad(below, (0, mesh.order * (len(mesh.z) - 1 - rows)))
