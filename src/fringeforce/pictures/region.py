"""Where the strip lies in a picture: four corners, the perspective between them, and the lens."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from fringeforce.base.arrays import Array, Index
from fringeforce.base.errors import InputError
from fringeforce.base.storage import whole_file
from fringeforce.design.text import toml_values

UNIT_SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
FINEST = 1.05
"""Most pixels of a line for each of the picture: what is drawn out has dependent noise."""
KEYS = {"corners", "size", "bits", "margin", "mosaic", "distortion"}
MOST_DISTORTION = 0.2
"""Largest distortion: one term describes lenses that look straight, and no fisheyes."""
OUTLINE = 9
"""Points on each edge that tell how far it bulges."""


@dataclass(frozen=True)
class Region:
    """Where a strip lies in the pictures of a camera, and how the pictures are coded.

    Parameters
    ----------
    corners : sequence of 4 pairs
        Column and row of the strip's corners, counted from the centre of the upper left pixel.
        The first two are the ends of one long edge from small x to large x, the other two those of
        the other edge from large x to small x: clockwise, for x to the right.
    size : pair of int
        Columns and rows of the pictures.
    bits : int
        Bits of a grey level, 1 to 16: a pixel at 2^bits - 1 is saturated.
    margin : float
        Share of the strip's width that is left out on either side, 0 to 0.45; edges reflect.
    mosaic : str
        What the pixels see, if they differ: four letters of R, G and B for a Bayer mosaic, the
        first two in even rows, such as "RGGB"; for a polarisation mosaic the `bias` of each
        pixel [degrees], such as "180,90,270,0".
    distortion : float
        Of the lens: how much farther from the picture's middle its corners are seen than without,
        as a share; below 0 of barrels, -0.2 to 0.2.

    Raises
    ------
    InputError
        If the corners make no convex four-sided figure inside the picture, or a value is beyond
        its limit.

    Examples
    --------
    >>> region = ff.Region([(10, 20), (209, 20), (209, 59), (10, 59)], size=(220, 80))
    >>> region.places([[109.5, 39.5]])  # shares along and across the strip
    array([[0.5, 0.5]])
    >>> region.save("region.toml")
    >>> ff.Region.load("region.toml") == region
    True
    """

    corners: Sequence[Sequence[float]]
    size: tuple[int, int]
    bits: int = 8
    margin: float = 0.15
    mosaic: str = ""
    distortion: float = 0.0

    def __post_init__(self) -> None:
        try:
            points: Array = np.array(self.corners, dtype=float)
        except (TypeError, ValueError):
            points = np.zeros((0, 2))
        if points.shape != (4, 2) or not np.isfinite(points).all():
            raise InputError(
                f"corners = {self.corners}; give four pairs of column and row, finite."
            )
        columns, rows = (int(length) for length in self.size)
        edges = np.roll(points, -1, axis=0) - points
        following = np.roll(edges, -1, axis=0)
        turns = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
        if (turns == 0).any() or np.ptp(np.sign(turns)):
            raise InputError(
                f"The corners {points.tolist()} make no convex four-sided figure; give them in "
                "turn: both ends of one long edge, then those of the other, backwards."
            )
        if (points < -1).any() or (points > (columns, rows)).any():
            raise InputError(
                f"The corners {points.tolist()} leave the picture of {columns} columns and {rows} "
                "rows; give columns and rows of pixels, or move the camera back."
            )
        if not 1 <= self.bits <= 16:
            raise InputError(f"bits = {self.bits} of a region; cameras have 1 to 16.")
        if not 0 <= self.margin <= 0.45:
            raise InputError(f"margin = {self.margin:g} of a region; take 0 to 0.45.")
        if not abs(self.distortion) <= MOST_DISTORTION:
            raise InputError(
                f"distortion = {self.distortion:g} of a region; take -{MOST_DISTORTION:g} to "
                f"{MOST_DISTORTION:g}, or a lens that distorts less."
            )
        object.__setattr__(
            self, "corners", tuple((float(point[0]), float(point[1])) for point in points)
        )
        object.__setattr__(self, "size", (columns, rows))
        _ = self.sites  # refuses what is no mosaic

    @cached_property
    def sites(self) -> tuple[str, ...]:
        """What each pixel of two by two sees, row by row; empty without a mosaic."""
        if not self.mosaic:
            return ()
        sites = tuple(self.mosaic.split(",") if "," in self.mosaic else self.mosaic.upper())
        try:
            known = set(sites) <= set("RGB") or all(np.isfinite(float(site)) for site in sites)
        except ValueError:
            known = False
        if len(sites) != 4 or not known:
            raise InputError(
                f'mosaic = "{self.mosaic}" is none; give four letters such as "RGGB" or four '
                'biases in degrees such as "180,90,270,0".'
            )
        return tuple(site.strip() for site in sites)

    @cached_property
    def to_picture(self) -> Array:
        """Homography from shares along and across the strip to the picture without distortion.

        Of shape (3, 3).  The four corners give eight linear equations (Hartley and Zisserman,
        Multiple View Geometry, 2nd ed., section 2.3).
        """
        rows, right = [], []
        straight = undistorted(self.corners, self.size, self.distortion)
        for (u, v), (column, row) in zip(UNIT_SQUARE, straight, strict=True):
            rows += [[u, v, 1, 0, 0, 0, -u * column, -v * column]]
            rows += [[0, 0, 0, u, v, 1, -u * row, -v * row]]
            right += [column, row]
        return np.append(np.linalg.solve(np.array(rows), np.array(right)), 1.0).reshape(3, 3)

    @cached_property
    def _from_picture(self) -> Array:
        return np.asarray(np.linalg.inv(self.to_picture), dtype=float)

    def points(self, places: ArrayLike) -> Array:
        """Columns and rows of places on the strip, shape (..., 2) of shares along and across."""
        straight = _projected(self.to_picture, places)
        return distorted(straight, self.size, self.distortion)

    def places(self, points: ArrayLike) -> Array:
        """Shares along and across the strip, 0 to 1, of columns and rows, shape (..., 2)."""
        straight = undistorted(points, self.size, self.distortion)
        return _projected(self._from_picture, straight)

    def outline(self, margin: float = 0.0) -> Array:
        """Columns and rows along the edges, or beside the long ones, back to the first, (k, 2).

        Parameters
        ----------
        margin : float
            Share of the width between the long edges and what is outlined.
        """
        corners = np.array(
            [[0, margin], [1, margin], [1, 1 - margin], [0, 1 - margin], [0, margin]]
        )
        share = np.linspace(0, 1, OUTLINE)[:, None]
        return self.points(np.concatenate([a + share * (b - a) for a, b in pairwise(corners)]))

    @cached_property
    def bounds(self) -> tuple[Index, Index]:
        """First column and row of the picture that see the strip, and those behind the last."""
        outline = self.outline()
        low = np.maximum(np.floor(outline.min(axis=0)).astype(np.intp), 0)
        return low, np.minimum(np.ceil(outline.max(axis=0)).astype(np.intp) + 1, self.size)

    @property
    def length(self) -> float:
        """Pixels along the strip, in its middle."""
        ends = self.points([[0.0, 0.5], [1.0, 0.5]])
        return float(np.hypot(*(ends[1] - ends[0])))

    @property
    def resolution(self) -> int:
        """Most pixels of a line: those along the strip, of one kind in a mosaic."""
        return int(self.length / (2 if self.sites else 1) * FINEST)

    @property
    def width(self) -> float:
        """Pixels across the strip, in its middle."""
        sides = self.points([[0.5, 0.0], [0.5, 1.0]])
        return float(np.hypot(*(sides[1] - sides[0])))

    @property
    def tilt(self) -> float:
        """Turn of the strip against the rows of the picture [degrees]."""
        ends = self.points([[0.0, 0.5], [1.0, 0.5]])
        along, down = ends[1] - ends[0]
        return float(np.degrees(np.arctan2(down, along)))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the region to a TOML file."""
        corners = ", ".join(f"[{column!r}, {row!r}]" for column, row in self.corners)
        lines = [
            f"corners = [{corners}]  # column and row",
            f"size = [{self.size[0]}, {self.size[1]}]  # columns and rows of the pictures",
            f"bits = {self.bits}",
            f"margin = {self.margin!r}  # share of the width left out on either side",
            f'mosaic = "{self.mosaic}"',
            f"distortion = {self.distortion!r}  # of the lens, at the picture's corners",
        ]
        with whole_file(path) as unfinished:
            unfinished.write_text("\n".join([*lines, ""]), encoding="utf-8")

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a region that `save` wrote; InputError for anything else."""
        try:
            text = Path(path).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
            raise InputError(
                f"{path} cannot be read as a region: {reason}. Write one with  fringeforce extract "
                "--region FILE."
            ) from None
        values = toml_values(text, str(path))
        if unknown := set(values) - KEYS:
            raise InputError(
                f"{path}: a region has no {', '.join(sorted(unknown))}; it has "
                f"{', '.join(sorted(KEYS))}."
            )
        if missing := {"corners", "size"} - set(values):
            raise InputError(f"{path}: the region lacks {', '.join(sorted(missing))}.")
        try:
            return cls(**values)
        except (TypeError, ValueError) as error:
            raise InputError(f"{path}: {error}") from None


def undistorted(points: ArrayLike, size: tuple[int, int], distortion: float) -> Array:
    """Where a lens without distortion would show what is seen at points, shape (..., 2).

    The division model (Fitzgibbon, CVPR 2001, doi:10.1109/CVPR.2001.990465) about the middle.

    Parameters
    ----------
    points : array_like, shape (..., 2)
        Columns and rows.
    size, distortion
        As of `Region`.
    """
    seen = np.asarray(points, dtype=float)
    if distortion == 0:
        return seen
    middle, square = _from_middle(seen, size)
    return middle + (seen - middle) / (1 + distortion * square)


def distorted(points: Array, size: tuple[int, int], distortion: float) -> Array:
    """Where a lens shows what it would at points without distortion, shape (..., 2)."""
    if distortion == 0:
        return points
    middle, square = _from_middle(points, size)
    return middle + (points - middle) * 2 / (1 + np.sqrt(1 - 4 * distortion * square))


def _from_middle(points: Array, size: tuple[int, int]) -> tuple[Array, Array]:
    """The picture's middle, and squared distances from it in half diagonals, shape (..., 1)."""
    middle = (np.array(size) - 1) / 2
    square = np.square(points - middle).sum(axis=-1, keepdims=True)
    return middle, square / np.square(np.array(size) / 2).sum()


def _projected(homography: Array, points: ArrayLike) -> Array:
    given = np.asarray(points, dtype=float)
    mapped = given @ homography[:, :2].T + homography[:, 2]
    return mapped[..., :2] / mapped[..., 2:]
