"""A picture to the image of a pad: one sparse matrix, made once for a region.

As `sampling`, in two dimensions: a pixel of the image is a local linear regression of the picture's
pixels on their place on the pad (Fan and Gijbels, Local Polynomial Modelling, 1996, section 2.3),
which reproduces what is linear in x and y.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from fringeforce.base.arrays import Array, Index
from fringeforce.base.errors import InputError
from fringeforce.pictures.region import FINEST, Region
from fringeforce.pictures.sampling import COLOURS, Sampler, Weights

SINGULAR = 1e-6
"""Determinant of a regression's moments, relative to even ones, below which it is a mean."""
SITES = 4
"""Pixels of two by two, of which those of a mosaic differ."""

BAND = 32
"""Rows of a picture whose pixels are worked on together."""


@dataclass(frozen=True)
class ImageSampler(Sampler):
    """Takes the images of a pad from pictures.

    Parameters
    ----------
    region : Region
        Where the pad is; its margin is not used, since an image shows all of the pad.
    pixels : (int, int)
        Pixels of the image along x and along y.
    channels : sequence of str
        What to take of the pictures, as `channels_of` names them.
    analysers : bool
        Whether picture and image are mosaics of a polarisation camera, with the same analysers
        before pixels of even and odd rows and columns: each pixel of the image is then taken from
        pixels behind its own analyser.

    Raises
    ------
    InputError
        If the image is finer than the picture.

    Examples
    --------
    >>> from fringeforce.pictures.imaging import ImageSampler
    >>> region = ff.Region([(10, 20), (209, 20), (209, 119), (10, 119)], size=(220, 140))
    >>> row, column = np.mgrid[:140, :220]
    >>> image = ImageSampler(region, (50, 20)).frames([(row + column) / 2], bits=8)[0]
    >>> image.shape, int(image[0, 0]), int(image[-1, -1])
    ((20, 50), 17, 162)
    """

    pixels: tuple[int, int]  # pyrefly: ignore[bad-override]
    analysers: bool = False

    @cached_property
    def _parts(self) -> tuple[tuple[int, Index, Weights], ...]:
        own = list(range(SITES))
        if self.analysers:
            return ((0, *_weights(self.region, self.pixels, {site: [site] for site in own})),)
        sites, found = self.region.sites, []
        for name in self.channels:
            seen = [site for site in own if not sites or sites[site] == name]
            found.append((COLOURS.get(name, 0), *_weights(self.region, self.pixels, {None: seen})))
        return tuple(found)

    @property
    def shape(self) -> tuple[int, ...]:
        """Of one image: (rows, columns) or (channels, rows, columns)."""
        image = self.pixels[::-1]
        return image if len(self.channels) == 1 else (len(self.channels), *image)


@dataclass(frozen=True)
class _Tap:
    """What each of n places gives to a pixel of an image, along x or y or both, shape (n,).

    Attributes
    ----------
    number : ndarray
        Of the pixel, among those of its kind and those beyond the image's ends.
    x, y : ndarray
        Distance from it, over the kernel's half width.
    kernel : ndarray
        Triangular weight.
    """

    number: Index
    x: Array
    y: Array
    kernel: Array


@dataclass(frozen=True)
class _Axis:
    """Pixels of one kind along x or y of an image.

    Attributes
    ----------
    pixels : int
        Of all kinds.
    first, step, count : int
        Number of the first one of the kind, distance between them, and how many there are.
    half : float
        Half width of the kernel, in pixels of all kinds.
    """

    pixels: int
    first: int
    step: int
    count: int
    half: float

    @property
    def taps(self) -> int:
        """How many a kernel reaches at most."""
        return int(np.ceil(2 * self.half / self.step))

    @property
    def places(self) -> Index:
        """Numbers among all pixels, with those beyond both ends that a kernel reaches."""
        return self.first + self.step * np.arange(-self.taps, self.count + self.taps)

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Which of `places` are in the image."""
        return (self.places >= 0) & (self.places < self.pixels)

    def near(self, share: Array) -> list[tuple[Index, Array, Array]]:
        """Number among `places`, distance and weight of those that are near shares of the pad."""
        at = (share * self.pixels - 0.5 - self.first) / self.step + self.taps
        half = self.half / self.step
        begin = np.floor(at - half) + 1
        found = []
        for tap in range(self.taps):
            away = (at - (begin + tap)) / half
            kernel = np.maximum(1 - np.abs(away), 0)
            found.append(((begin + tap).astype(np.intp), away, kernel))
        return found


@dataclass(frozen=True)
class _Kind:
    """Pixels of one kind of an image, and the pixels of a picture that see them.

    Attributes
    ----------
    x, y : _Axis
        Of the image.
    sites : list
        First column and row of the picture's pixels, and their distance.
    reach : ndarray, shape (2,)
        Their largest distance from the pad's middle, as shares.
    """

    x: _Axis
    y: _Axis
    sites: list[tuple[int, int, int]]
    reach: Array


def _weights(
    region: Region, pixels: tuple[int, int], kinds: dict[int | None, list[int]]
) -> tuple[Index, Weights]:
    """Which pixels of a picture make an image, and with which weights.

    Parameters
    ----------
    region : Region
        Where the pad is.
    pixels : (int, int)
        Pixels of the image along x and along y.
    kinds : dict
        Sites of the picture's pixels by that of the image's pixels which are taken from them, None
        for all pixels.
    """
    sources, targets, weights = [], [], []
    for site, seen in kinds.items():
        kind = _kind(region, pixels, site, seen)
        level, slope_x, slope_y = _regression(region, kind)
        number = (kind.y.places[:, None] * pixels[0] + kind.x.places).ravel()
        number = number.clip(0, pixels[0] * pixels[1] - 1).astype(np.int32)
        for source, taps in _bands(region, kind):
            target = np.empty((source.size, len(taps)), np.int32)
            weight = np.empty(target.shape)
            for one, tap in enumerate(taps):
                at, x, y = tap.number, tap.x, tap.y
                target[:, one] = number[at]
                weight[:, one] = tap.kernel * (level[at] + slope_x[at] * x + slope_y[at] * y)
            sources.append(source)
            targets.append(target)
            weights.append(weight)
    source, target, weight = (np.concatenate(parts) for parts in (sources, targets, weights))
    begin = np.arange(0, weight.size + 1, weight.shape[1])
    shape = pixels[0] * pixels[1], source.size
    matrix = csc_array((weight.ravel(), target.ravel(), begin), shape=shape)
    # rows multiply faster than columns of one weight each, and take longer to make of many
    return source, matrix.tocsr() if weight.shape[1] == 1 else matrix


def _kind(region: Region, pixels: tuple[int, int], site: int | None, seen: list[int]) -> _Kind:
    """Pixels of a site of an image, and of some sites of a picture."""
    corners = np.array(region.corners)
    edges = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
    # pixels where the pad is farthest
    finest = np.array([edges[[0, 2]].min(), edges[[1, 3]].min()])
    period = 1 if len(seen) == SITES else 2
    most = (finest * FINEST / (period if region.sites else 1)).astype(int)
    if (np.array(pixels) > most).any():
        raise InputError(
            f"The pad is {finest[0]:.0f} x {finest[1]:.0f} pixels in the picture, too few for "
            f"images of {pixels[0]} x {pixels[1]}; state pixels = [{most[0]}, {most[1]}] or fewer "
            "in the design, or bring the camera nearer."
        )
    first, step = ((0, 0), 1) if site is None else ((site % 2, site // 2), 2)
    x, y = (
        _Axis(own, begin, step, len(range(begin, own, step)), max(1.0, period * own / length))
        for own, begin, length in zip(pixels, first, finest, strict=True)
    )
    sites = [(one % 2, one // 2, period) for one in (seen if period == 2 else [0])]
    return _Kind(x, y, sites, 0.5 * (1 - 1 / finest) + 1e-9)


def _bands(region: Region, kind: _Kind) -> Iterator[tuple[Index, list[_Tap]]]:
    """Pixels of a picture, some rows at a time, and what they give to those of an image."""
    low, high = region.bounds
    for left, top, step in kind.sites:
        column = np.arange(low[0] + (left - low[0]) % step, high[0], step)
        rows = np.arange(low[1] + (top - low[1]) % step, high[1], step)
        for begin in range(0, rows.size, BAND):
            row = rows[begin : begin + BAND, None]
            points = np.stack(np.broadcast_arrays(column, row), axis=-1)
            along, across = np.moveaxis(region.places(points), -1, 0)
            keep = np.abs(along - 0.5) <= kind.reach[0]
            keep &= np.abs(across - 0.5) <= kind.reach[1]
            taps = [
                _Tap(j * kind.x.places.size + i, x, y, by_x * by_y)
                for j, y, by_y in kind.y.near(across[keep])
                for i, x, by_x in kind.x.near(along[keep])
            ]
            yield (row * region.size[0] + column)[keep], taps


def _regression(region: Region, kind: _Kind) -> Array:
    """By what a kernel's weights are multiplied to reproduce planes: level and slopes along x, y.

    For each of the image's pixels of a kind, shape (3, pixels), those beyond its ends included,
    which get nothing: the first row of the inverse of the moments of 1, x and y, by Cramer's rule.
    """
    columns = kind.x.places.size
    moments = np.zeros((6, kind.y.places.size * columns))
    for source, taps in _bands(region, kind):
        for tap in taps if source.size else ():
            begin, by_x, by_y = tap.number.min(), tap.kernel * tap.x, tap.kernel * tap.y
            at = tap.number - begin
            parts = tap.kernel, by_x, by_y, by_x * tap.x, by_x * tap.y, by_y * tap.y
            for sums, part in zip(moments, parts, strict=True):
                found = np.bincount(at, part)
                sums[begin : begin + found.size] += found
    inside = np.logical_and.outer(kind.y.inside, kind.x.inside).ravel()
    total = np.where(inside, moments[0], 1.0)
    if (total <= 0).any():
        row, column = np.divmod(int(np.argmin(total)), columns)
        raise InputError(
            f"No pixel of the picture sees row {kind.y.places[row]}, column "
            f"{kind.x.places[column]} of the image; state fewer pixels in the design, or bring the "
            "camera nearer."
        )
    x, y, xx, xy, yy = moments[1:] / total
    first = np.array([xx * yy - xy**2, y * xy - x * yy, x * xy - y * xx])
    size = first[0] + x * first[1] + y * first[2]
    flat = size < SINGULAR
    size[flat], first[:, flat] = 1.0, [[1.0], [0.0], [0.0]]
    return first / (size * total) * inside
