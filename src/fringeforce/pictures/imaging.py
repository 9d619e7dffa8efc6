"""A picture to the image of a pad: one sparse matrix, made once for a region.

As `sampling`, in two dimensions: a pixel of the image is a local linear regression of the picture's
pixels on their place on the pad (Fan and Gijbels, Local Polynomial Modelling, 1996, section 2.3),
which reproduces what is linear in x and y.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, vstack

from fringeforce.base.arrays import Array, Index
from fringeforce.base.errors import InputError
from fringeforce.pictures.region import FINEST, Region
from fringeforce.pictures.sampling import COLOURS, Sampler

SINGULAR = 1e-6
"""Determinant of a regression's moments, relative to even ones, below which it is a mean."""
SITES = 4
"""Pixels of two by two, of which those of a mosaic differ."""


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

    pixels: tuple[int, int]  # pyright: ignore[reportIncompatibleVariableOverride]
    analysers: bool = False

    @cached_property
    def _parts(self) -> tuple[tuple[int, Index, csr_array], ...]:
        if self.analysers:
            return ((0, *self._behind_analysers()),)
        sites = self.region.sites
        found = []
        for name in self.channels:
            seen = [not sites or sites[site] == name for site in range(SITES)]
            found.append((COLOURS.get(name, 0), *_weights(self.region, self.pixels, seen)))
        return tuple(found)

    def _behind_analysers(self) -> tuple[Index, csr_array]:
        """Pixels of the picture and weights, each kind of pixel from its own kind."""
        columns, rows = self.pixels
        row, column = np.mgrid[:rows, :columns]
        kinds = (2 * (row % 2) + column % 2).ravel()
        size = self.region.size[0] * self.region.size[1]
        parts, places = [], []
        for kind in range(SITES):
            seen = [site == kind for site in range(SITES)]
            index, weights = _weights(self.region, self.pixels, seen)
            own = np.flatnonzero(kinds == kind)
            part = weights[own].tocoo()
            parts.append(csr_array((part.data, (part.row, index[part.col])), (own.size, size)))
            places.append(own)
        whole = csr_array(vstack(parts))[np.argsort(np.concatenate(places))]
        used = np.unique(whole.indices)
        return used, csr_array(whole[:, used])

    @property
    def shape(self) -> tuple[int, ...]:
        """Of one image: (rows, columns) or (channels, rows, columns)."""
        image = self.pixels[::-1]
        return image if len(self.channels) == 1 else (len(self.channels), *image)


def _weights(region: Region, pixels: tuple[int, int], seen: list[bool]) -> tuple[Index, csr_array]:
    """Which pixels of a picture make an image, and with which weights; `seen` names the sites."""
    corners = np.array(region.corners)
    edges = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
    period = 1 if all(seen) else 2
    finest = np.array(
        [edges[[0, 2]].min(), edges[[1, 3]].min()]
    )  # pixels where the pad is farthest
    most = (finest * FINEST / (period if region.sites else 1)).astype(int)
    if (np.array(pixels) > most).any():
        raise InputError(
            f"The pad is {finest[0]:.0f} x {finest[1]:.0f} pixels in the picture, too few for "
            f"images of {pixels[0]} x {pixels[1]}; state pixels = [{most[0]}, {most[1]}] or fewer "
            "in the design, or bring the camera nearer."
        )
    columns, rows = region.size
    low = np.maximum(np.floor(corners.min(axis=0)).astype(int), 0)
    high = np.minimum(np.ceil(corners.max(axis=0)).astype(int) + 1, (columns, rows))
    row, column = (axis.ravel() for axis in np.mgrid[low[1] : high[1], low[0] : high[0]])
    places = region.places(np.stack([column, row], -1))
    keep = np.array(seen)[2 * (row % 2) + column % 2]
    keep &= (np.abs(places - 0.5) <= 0.5 * (1 - 1 / finest) + 1e-9).all(axis=1)
    row, column = row[keep], column[keep]
    at = places[keep] * pixels - 0.5
    half = np.maximum(1.0, period * np.array(pixels) / finest)
    near, reach = np.rint(at).astype(int), np.ceil(half - 0.5).astype(int)
    source, target, offset, weight = [], [], [], []
    for x in range(-reach[0], reach[0] + 1):
        for y in range(-reach[1], reach[1] + 1):
            there = near + np.array([x, y])
            away = at - there
            kernel = np.maximum(1 - np.abs(away) / half, 0).prod(axis=1)
            used = np.flatnonzero((kernel > 0) & (there >= 0).all(1) & (there < pixels).all(1))
            source.append(used)
            target.append(there[used, 1] * pixels[0] + there[used, 0])
            offset.append(away[used] / half)
            weight.append(kernel[used])
    source, target = np.concatenate(source), np.concatenate(target)
    offset, weight = np.concatenate(offset), np.concatenate(weight)
    weight *= _regression(offset, weight, target, pixels)
    count = pixels[0] * pixels[1]
    matrix = csr_array((weight, (target, source)), shape=(count, row.size))
    used, index = np.unique(source), row * columns + column
    return index[used], csr_array(matrix[:, used])


def _regression(
    offset: Array, weight: Array, target: NDArray[Any], pixels: tuple[int, int]
) -> Array:
    """By what a kernel's weights are multiplied, so that they reproduce planes."""
    count = pixels[0] * pixels[1]
    terms = np.column_stack([np.ones(len(offset)), offset])
    moments = np.empty((count, 3, 3))
    for i in range(3):
        for j in range(3):
            moments[:, i, j] = np.bincount(target, weight * terms[:, i] * terms[:, j], count)
    total = moments[:, 0, 0].copy()
    if (total <= 0).any():
        place = int(np.argmin(total))
        raise InputError(
            f"No pixel of the picture sees row {place // pixels[0]}, column {place % pixels[0]} of "
            "the image; state fewer pixels in the design, or bring the camera nearer."
        )
    moments /= total[:, None, None]
    flat = np.linalg.det(moments) < SINGULAR
    moments[flat] = np.eye(3)
    first = np.linalg.solve(moments, np.broadcast_to(np.eye(3)[:, :1], (count, 3, 1)))[..., 0]
    first[flat] = (1.0, 0.0, 0.0)
    return (first[target] * terms).sum(axis=1) / total[target]
