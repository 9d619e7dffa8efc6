"""A picture to the line of a strip: one sparse matrix, made once for a region.

A pixel of the line is a local linear regression, with a triangular kernel, of the picture's pixels
on their place along the strip (Fan and Gijbels, Local Polynomial Modelling, 1996, section 2.3): it
reproduces what is linear in x wherever the picture's pixels happen to lie.  Grey levels are not
decoded: the likelihood of a reading knows the camera's response.  The mean of encoded levels is
the encoded mean only as far as the rows agree, so the light should be even across the strip.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array

from fringeforce.base.arrays import Array, Index
from fringeforce.base.errors import InputError
from fringeforce.design.light import Polariscope
from fringeforce.pictures.region import Region

Weights = csr_array | csc_array
COLOURS = {"R": 0, "G": 1, "B": 2}
FARTHER = 2
"""How much wider the kernel is of the last pixels of a line: with neighbours on one side alone they
extrapolate, and have up to fourteen times the noise where these are as near as of others."""
GREEN, RED = 490e-9, 580e-9
"""Where the green pixels of usual cameras begin to see more than the blue, and red than green."""


def channels_of(polariscope: Polariscope, region: Region, colour: bool) -> tuple[str, ...]:
    """What each picture of the design is in the camera's pictures: "grey", "R", a bias, ...

    Parameters
    ----------
    polariscope : Polariscope
        Its channels are told apart by wavelength in colour pictures and Bayer mosaics, and by bias
        in polarisation mosaics.
    region : Region
        With the mosaic, if there is one.
    colour : bool
        Whether the pictures have planes of red, green and blue.

    Returns
    -------
    tuple of str
        One for each channel.

    Raises
    ------
    InputError
        If the pictures do not tell the design's channels apart.
    """
    wanted = polariscope.pictures
    polarised = bool(region.sites) and not set(region.sites) <= set(COLOURS)
    if polarised:
        biases = {float(site) % 360: site for site in region.sites}
        names = [biases.get(channel.bias % 360, "") for channel in wanted]
        if not all(names):
            raise InputError(
                f"The mosaic {region.mosaic} lacks a bias of the design's channels, "
                f"{[channel.bias for channel in wanted]} degrees."
            )
    elif colour or region.sites:
        waves = [channel.wavelength or polariscope.wavelength for channel in wanted]
        names = ["R" if wave >= RED else "G" if wave >= GREEN else "B" for wave in waves]
    else:
        names = ["grey"] * len(wanted)
    if len(set(names)) < len(names):
        raise InputError(
            f"The pictures do not tell the design's {len(names)} channels apart: {names}. A colour "
            "camera tells wavelengths apart, a polarisation mosaic biases."
        )
    return tuple(names)


@dataclass(frozen=True)
class Sampler:
    """Takes the lines of a strip out of pictures.

    Parameters
    ----------
    region : Region
        Where the strip lies.
    pixels : int
        Pixels of the line.
    channels : sequence of str
        As `channels_of` names them.

    Raises
    ------
    InputError
        If the picture has fewer pixels along the strip than the line, or none for a channel.

    Examples
    --------
    >>> region = ff.Region([(10, 20), (209, 20), (209, 59), (10, 59)], size=(220, 80))
    >>> picture = np.tile(np.arange(220, dtype=np.uint8), (80, 1))
    >>> np.allclose(ff.Sampler(region, 100).line(picture), 10 + 199 * (np.arange(100) + 0.5) / 100)
    True
    """

    region: Region
    pixels: int
    channels: Sequence[str] = ("grey",)

    @cached_property
    def _parts(self) -> tuple[tuple[int, Index, Weights], ...]:
        """Plane, pixels of the picture and weights, for each channel."""
        return tuple(
            (COLOURS.get(name, 0), *_weights(self.region, self.pixels, name))
            for name in self.channels
        )

    @property
    def shape(self) -> tuple[int, ...]:
        """Of one frame: (pixels,) or (channels, pixels)."""
        return (self.pixels,) if len(self.channels) == 1 else (len(self.channels), self.pixels)

    @cached_property
    def spread(self) -> float:
        """Standard deviation of the sampling kernel and the picture's pixel, in pixels of the line.

        They act as a point spread: a triangle of half width h has h^2 / 6, a pixel 1 / 12.
        """
        period = 2 if self.region.sites else 1
        step = self.pixels / self.region.length
        return float(np.sqrt(max(1.0, period * step) ** 2 / 6 + step**2 / 12))

    def line(self, picture: NDArray[Any]) -> Array:
        """The line of a picture, as `shape`, in the picture's grey levels and not rounded.

        Where half of a pixel's weight or more is saturated the true mean is at the top or beyond,
        and the pixel is set to the top.

        Raises
        ------
        InputError
            If the picture is of another size, or its levels exceed the region's bits.
        """
        columns, rows = self.region.size
        if picture.shape[:2] != (rows, columns) or picture.ndim > 3:
            raise InputError(
                f"A picture of shape {picture.shape}; the region was made for {columns} columns "
                f"and {rows} rows. Find the strip anew, or take pictures of that size."
            )
        colour = picture.ndim == 3
        if colour and self.region.sites:
            raise InputError(f"Colour pictures have no mosaic; the region has {self.region.mosaic}")
        top = 2**self.region.bits - 1
        found = []
        for plane, index, weights in self._parts:
            flat = (picture[..., plane] if colour else picture).reshape(-1)
            seen = flat[index]
            brightest = seen.max()
            if brightest > top:
                raise InputError(
                    f"A grey level of {brightest} exceeds {self.region.bits} bits, {top}; state "
                    "the camera's bits with --bits, or bits in the region's file."
                )
            line = weights @ seen.astype(np.float64)
            if brightest >= top:
                line[weights @ (seen >= top).astype(np.float64) >= 0.5] = top
            found.append(np.clip(line, 0, top))
        return found[0] if len(found) == 1 else np.array(found)

    def frames(self, pictures: Iterable[NDArray[Any]], bits: int) -> NDArray[np.unsignedinteger]:
        """Frames as a camera of some bits delivers them, shape (k, *shape).

        The full scale of the pictures becomes that of the frames.
        """
        scale = (2**bits - 1) / (2**self.region.bits - 1)
        dtype = np.uint8 if bits <= 8 else np.uint16
        lines = [np.rint(self.line(picture) * scale).astype(dtype) for picture in pictures]
        return np.array(lines, dtype=dtype).reshape(-1, *self.shape)


def _weights(region: Region, pixels: int, channel: str) -> tuple[Index, csr_array]:
    """Which pixels of a picture make a line, and with which weights."""
    period = 2 if region.sites else 1
    if region.resolution < pixels:
        raise InputError(
            f"The picture has {region.length / period:.0f} pixels along the strip, the design's "
            f"camera {pixels}; state pixels = {int(region.length / period)} or fewer in the "
            "design, or have this camera described in a new one:  fringeforce extract --design FILE"
        )
    columns = region.size[0]
    low, high = region.bounds
    row, column = np.mgrid[low[1] : high[1], low[0] : high[0]]
    if region.sites:
        wanted = np.array([site == channel for site in region.sites])
        keep = wanted[2 * (row % 2) + column % 2]
        row, column = row[keep], column[keep]
    along, across = np.moveaxis(region.places(np.stack([column.ravel(), row.ravel()], -1)), -1, 0)
    # soft edges, so that no row of pixels comes or goes at once along a tilted strip
    reach = np.minimum(across, 1 - across) - region.margin
    cover = np.clip(reach * region.width + 0.5, 0, 1)
    inside = (cover > 0) & (np.abs(along - 0.5) <= 0.5 * (1 - 1 / region.length) + 1e-9)
    cover, along = cover[inside], along[inside] * pixels - 0.5
    half = np.full(pixels, max(1.0, period * pixels / region.length))
    half[[0, -1]] *= FARTHER
    near, steps = np.rint(along).astype(int), np.arange(-FARTHER, FARTHER + 1)[:, None]
    target = (near + steps).ravel()
    source = np.tile(np.arange(near.size), len(steps))
    there = (target >= 0) & (target < pixels)
    target, source = target[there], source[there]
    offset = along[source] - target
    weight = cover[source] * np.maximum(1 - np.abs(offset) / half[target], 0)
    keep = weight > 0
    target, source, offset, weight = target[keep], source[keep], offset[keep], weight[keep]
    zeroth, first, second = (np.bincount(target, weight * offset**k, pixels) for k in range(3))
    if (zeroth <= 0).any():
        raise InputError(
            f"No pixel of the picture sees {channel} at pixel {int(np.argmin(zeroth))} of the "
            f"line; take fewer than {pixels} pixels, a smaller margin, or a mosaic with {channel}."
        )
    spread = zeroth * second - first**2
    flat = spread <= 1e-9 * zeroth**2
    slope = np.where(flat, 0.0, first / np.where(flat, 1.0, spread))
    level = np.where(flat, 1 / zeroth, second / np.where(flat, 1.0, spread))
    weight *= level[target] - slope[target] * offset
    matrix = csr_array((weight, (target, source)), shape=(pixels, near.size))
    used, flat_index = np.unique(source), (row.ravel() * columns + column.ravel())[inside]
    return flat_index[used], csr_array(matrix[:, used])
