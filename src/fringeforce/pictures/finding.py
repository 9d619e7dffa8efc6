"""A bright strip on a darker ground: its four edges, to a fraction of a pixel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.optimize import least_squares
from scipy.spatial import ConvexHull

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.pictures.region import MOST_DISTORTION, Region, distorted, undistorted

COARSE = 400
"""Columns or rows, at most, of the picture in which the strip is looked for first."""
LEAST_ROWS = 16
"""Rows or columns below which a picture is none of a strip, but lines of a camera."""
SMALLEST = 0.02
"""Share of all bright pixels from which a bright patch counts as a part of the strip."""
STATIONS = 160
"""Places along an edge where it is looked for."""
REMEDY = (
    "Give a picture in which the whole strip is brighter than what surrounds it (--outline; take "
    "the analyser off, or light the room), or state where it is with --corners."
)
OUTLYING = 0.3
"""Distance of a point from its edge beyond which it counts less and less [pixels]."""
SMOOTHING = 1.0
"""Standard deviation of the smoothing before edges are looked for [pixels]."""
SHARPEST = 0.01
"""Least standard deviation of a point of an edge; drawings without noise leave none [pixels]."""
SURELY = 5.0
"""Standard deviations from which edges tell that the lens distorts: by chance in two million."""
ASPECT = 0.1
"""How far length over width may be from the design's: perspective, and edges that are rounded."""


def find_region(
    pictures: Sequence[NDArray[Any]],
    bits: int = 8,
    margin: float = 0.15,
    mosaic: str = "",
    aspect: float | None = None,
    distortion: float | None = None,
) -> Region:
    """Find a strip that is brighter than what surrounds it.

    The brightest that each pixel saw in all pictures shows the whole strip if its loads differ; the
    rectangle of least area around it is moved to the steepest ascent of light, edge by edge.  Edges
    that bend surely tell how the lens distorts.

    Parameters
    ----------
    pictures : sequence of ndarray, shape (rows, columns) or (rows, columns, 3)
        One in which the whole strip is bright, such as without the analyser or by room light; or
        some under loads that light all of it.
    bits, margin, mosaic
        As of `Region`.
    aspect : float, optional
        Length over width of the strip, to refuse what is another shape by more than 10 %.
    distortion : float, optional
        Of the lens, as of `Region`; as the edges tell if not given.

    Returns
    -------
    Region
        x runs to the right, or downwards along an upright strip.

    Raises
    ------
    InputError
        If no strip stands out, or it has another shape.

    Examples
    --------
    >>> picture = np.full((80, 220), 5, dtype=np.uint8)
    >>> picture[20:60, 10:210] = 200
    >>> region = ff.find_region([picture])
    >>> edges = [(9.5, 19.5), (209.5, 19.5), (209.5, 59.5), (9.5, 59.5)]
    >>> np.allclose(region.corners, edges, atol=0.2)
    True
    """
    given = [np.asarray(picture) for picture in pictures]
    planes: list[NDArray[Any]] = [p.max(axis=2) if p.ndim == 3 else p for p in given]
    if not planes or len({plane.shape for plane in planes}) > 1 or planes[0].ndim != 2:
        shapes = sorted({str(plane.shape) for plane in planes})
        raise InputError(f"Pictures of shapes {shapes}; give some of one size, rows by columns.")
    if min(planes[0].shape) < LEAST_ROWS:
        raise InputError(
            f"Pictures of {planes[0].shape[0]} x {planes[0].shape[1]} pixels show no strip with "
            "its surroundings; lines of a camera are frames already, which read and calibrate take."
        )
    light = ndimage.gaussian_filter(np.max(planes, axis=0).astype(np.float32), SMOOTHING)
    rows, columns = (int(length) for length in light.shape)
    corners = _coarse(light)
    size = columns, rows
    edges = _edges(light, _met(_edges(light, corners)))  # again where they are about right
    bent = _distortion(edges, size) if distortion is None else distortion
    straight = [replace(edge, points=undistorted(edge.points, size, bent)) for edge in edges]
    found = np.clip(_ordered(distorted(_met(straight), size, bent)), -1, size)
    ends = tuple((float(column), float(row)) for column, row in found)
    region = Region(ends, size, bits, margin, mosaic, bent)
    seen = region.length / region.width
    if aspect is not None and abs(np.log(seen / aspect)) > np.log(1 + ASPECT):
        raise InputError(
            f"What stands out is {seen:.3g} times as long as wide, the design's strip "
            f"{aspect:.3g} times: its ends may be dark. {REMEDY}"
        )
    return region


def _coarse(light: NDArray[np.float32]) -> Array:
    """Corners of the rectangle of least area around all that is bright."""
    step = max(1, int(np.ceil(max(light.shape) / COARSE)))
    rows, columns = light.shape[0] // step * step, light.shape[1] // step * step
    small = light[:rows, :columns].reshape(rows // step, step, columns // step, step)
    small = small.mean(axis=(1, 3))
    if np.ptp(small) <= 0:
        raise InputError(f"The pictures are of one grey level all over. {REMEDY}")
    bright = small > _threshold(small)
    patches: Any = ndimage.label(bright, np.ones((3, 3)))
    labels, count = patches
    sizes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    kept = np.isin(labels, 1 + np.flatnonzero(sizes >= SMALLEST * sizes.sum()))
    row, column = np.nonzero(kept)
    if row.size < 20 or kept.mean() > 0.98:
        raise InputError(f"No strip stands out in the pictures. {REMEDY}")
    points = np.stack([column, row], axis=-1).astype(float)
    # corners of the pixels, not centres, so that thin strips have an area
    points = points[:, None] + np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    points = points.reshape(-1, 2)
    hull = points[ConvexHull(points).vertices]
    edges = np.roll(hull, -1, axis=0) - hull
    best, corners = np.inf, hull[:4]
    for along in edges / np.hypot(*edges.T)[:, None]:
        axes = np.array([along, [-along[1], along[0]]])
        low, high = (hull @ axes.T).min(axis=0), (hull @ axes.T).max(axis=0)
        if (area := np.prod(high - low)) < best:
            box = [(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])]
            best, corners = area, np.array(box) @ axes
    return corners * step + (step - 1) / 2


def _threshold(grey: NDArray[np.floating]) -> float:
    """Level that parts dark from bright best (Otsu, IEEE Trans. Syst. Man Cybern. 9, 62, 1979)."""
    counts, edges = np.histogram(grey, 256)
    centres = (edges[1:] + edges[:-1]) / 2
    below, total = np.cumsum(counts), np.cumsum(counts * centres)
    share = below / below[-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        between = (total[-1] / below[-1] * share - total / below[-1]) ** 2 / (share * (1 - share))
    return float(centres[np.nanargmax(np.where(np.isfinite(between), between, np.nan))])


@dataclass(frozen=True, eq=False)
class _Edge:
    """Where light ascends steepest beside a side of a quadrilateral.

    Attributes
    ----------
    start, along, inwards : ndarray, shape (2,)
        Of the side: where it begins, and its directions.
    points : ndarray, shape (k, 2)
        Columns and rows.
    """

    start: Array
    along: Array
    inwards: Array
    points: Array

    @property
    def apart(self) -> tuple[Array, Array]:
        """How far the points are along the side, and from it, shape (k,) each."""
        return (self.points - self.start) @ self.along, (self.points - self.start) @ self.inwards

    @cached_property
    def line(self) -> tuple[Array, float]:
        """Normal n and distance d of the line n . p = d that fits the points."""
        run, off = self.apart
        fit = least_squares(
            lambda p: p[0] + p[1] * run - off, [np.median(off), 0.0],
            loss="soft_l1", f_scale=OUTLYING, x_scale=[1.0, 1 / max(run.max(), 1.0)],
        )  # fmt: skip
        first, second = (
            self.start + s * self.along + (fit.x @ [1, s]) * self.inwards
            for s in (run.min(), run.max())
        )
        line = (second - first) / np.hypot(*(second - first))
        across = np.array([-line[1], line[0]])
        return across, float(across @ first)


def _edges(light: NDArray[np.float32], corners: Array) -> list[_Edge]:
    """Edges beside the sides between corners."""
    centre = corners.mean(axis=0)
    reach = 0.3 * min(np.hypot(*(corners[1] - corners[0])), np.hypot(*(corners[2] - corners[1])))
    return [
        _edge(light, start, end, centre, max(reach, 4.0))
        for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True)
    ]


def _met(edges: list[_Edge]) -> Array:
    """Corners where the lines of edges meet, shape (4, 2)."""
    lines = [edge.line for edge in edges]
    return np.array([_meet(lines[k - 1], lines[k]) for k in range(4)])


def _edge(
    light: NDArray[np.float32], start: Array, end: Array, centre: Array, reach: float
) -> _Edge:
    along = (end - start) / np.hypot(*(end - start))
    normal = np.array([-along[1], along[0]])
    normal *= np.sign(normal @ (centre - start))  # inwards
    depth = np.arange(-reach, reach + 0.25, 0.5)
    share = np.linspace(0.06, 0.94, STATIONS)[:, None]
    points = start + share * (end - start)
    where = points[:, None] + depth[:, None] * normal
    levels = ndimage.map_coordinates(
        light, [where[..., 1], where[..., 0]], order=1, mode="nearest", output=np.float64
    )
    ascent = np.gradient(levels, 0.5, axis=1)
    peak = ascent.argmax(axis=1)
    steep = ascent[np.arange(STATIONS), peak]
    near = np.abs(depth - depth[peak][:, None]) < 3.0
    mass = np.where(near, np.maximum(ascent, 0), 0)
    place = (mass * depth).sum(axis=1) / np.maximum(mass.sum(axis=1), 1e-12)
    good = steep > 0.5 * np.quantile(steep, 0.8)
    if steep.max() <= 0 or good.sum() < 10:
        raise InputError(f"An edge of the strip does not stand out. {REMEDY}")
    return _Edge(start, along, normal, (points + place[:, None] * normal)[good])


def _distortion(edges: list[_Edge], size: tuple[int, int]) -> float:
    """The distortion that leaves edges straight; 0 if they are, as far as they surely tell.

    Edges that do not agree, as rough ones do not, tell less, by Birge's ratio (Phys. Rev. 40, 207,
    1932).
    """
    found, weight = np.array([_bent(edge, size) for edge in edges]).T
    whole = float(weight.sum())
    if not whole > 0:  # a line through the middle of the picture stays straight
        return 0.0
    mean = float(found @ weight) / whole
    ratio = float(np.square(found - mean) @ weight) / (len(edges) - 1)
    return mean if mean**2 * whole > SURELY**2 * max(1.0, ratio) else 0.0


def _bent(edge: _Edge, size: tuple[int, int]) -> tuple[float, float]:
    """The distortion that leaves one edge straight, and the information about it."""
    run = edge.apart[0] / max(float(edge.apart[0].max()), 1.0)

    def left(unknowns: Array) -> Array:
        straight = replace(edge, points=undistorted(edge.points, size, float(unknowns[0])))
        return straight.apart[1] - unknowns[1] - unknowns[2] * run

    most = np.array([MOST_DISTORTION, np.inf, np.inf])
    fit = least_squares(
        left, np.zeros(3), loss="soft_l1", f_scale=OUTLYING, x_scale=most.clip(0, 1),
        bounds=(-most, most),
    )  # fmt: skip
    lines, _ = np.linalg.qr(fit.jac[:, 1:])
    by = fit.jac[:, 0] - lines @ (lines.T @ fit.jac[:, 0])  # that no line follows
    variance = max(2 * fit.cost / len(run), SHARPEST**2)
    # points that are nearer to each other than smoothing reaches err alike
    alike = max(1.0, 2 * np.sqrt(np.pi) * SMOOTHING * len(run) / float(np.ptp(edge.apart[0])))
    return float(fit.x[0]), float(by @ by) / (variance * alike)


def _meet(one: tuple[Array, float], other: tuple[Array, float]) -> Array:
    normals, distances = np.array([one[0], other[0]]), np.array([one[1], other[1]])
    return np.asarray(np.linalg.solve(normals, distances), dtype=float)


def _ordered(corners: Array) -> Array:
    """Clockwise in the picture, from the end of small x of the upper or right long edge."""
    sides = np.roll(corners, -1, axis=0) - corners
    if sides[0, 0] * sides[1, 1] - sides[0, 1] * sides[1, 0] < 0:
        corners = corners[::-1]
        sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.hypot(*sides.T)
    long = 0 if lengths[0] + lengths[2] >= lengths[1] + lengths[3] else 1
    along = sides[long]
    axis = 0 if abs(along[0]) >= abs(along[1]) else 1
    return np.roll(corners, -(long if along[axis] > 0 else long + 2), axis=0)
