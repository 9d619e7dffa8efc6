"""What the camera of a design should say about lines that were averaged from pictures."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d, uniform_filter1d

from fringeforce.base.arrays import Array
from fringeforce.base.errors import InputError
from fringeforce.design.light import CHANNELS
from fringeforce.design.strip import Sensor
from fringeforce.optics.camera import encoded
from fringeforce.pictures.region import Region
from fringeforce.pictures.sampling import Sampler

BANDS = 4
"""Bands across the strip whose lines are compared to find the noise."""
DEGREE = 5
"""Degree of the polynomials along the strip by which light differs from band to band."""
LAGS = 8
"""Pixels over which noise may depend on that of its neighbours: the side of a block of JPEG."""
FINE = 4
"""Grey levels of a line for each standard deviation of its noise, so that rounding adds little."""
DARK = 0.01
"""How far darkness may be off, as a share of the amplitude: the darkest pixels see some light."""
EDGE = 0.3
"""How far an edge of the region may be off [pixels of the picture]."""


class Light(NamedTuple):
    """What one channel of a `LineCamera` sees, grey levels.

    Attributes
    ----------
    amplitude, offset : float
        Brightest less darkest level, and darkest level.
    noise : float
        Standard deviation of white noise that tells as much as the noise of its lines does.
    """

    amplitude: float
    offset: float
    noise: float

    @property
    def stated(self) -> dict[str, str | float]:
        """All three as a design states them."""
        return {
            "amplitude": f"{float(f'{self.amplitude:.3g}'):g} +/- 10 %",
            "offset": f"{float(f'{self.offset:.3g}'):g} +/- {DARK * self.amplitude:.2g}",
            "noise": float(f"{self.noise:.3g}"),
        }


@dataclass(frozen=True)
class LineCamera:
    """A line camera that delivers what a `Sampler` takes from pictures.

    Parameters
    ----------
    pixels, bits : int
        Of the line.
    lights : tuple of Light
        Of each channel.
    blur : float
        Standard deviation of the sampling [m].
    shift, scale : float
        Standard deviations of where the pixels look [m], and of their distance as a share.
    response : str
        As in a design.
    """

    pixels: int
    bits: int
    lights: tuple[Light, ...]
    blur: float
    shift: float
    scale: float
    response: str = "linear"

    @property
    def noise(self) -> float:
        """Of the channel that has most."""
        return max(light.noise for light in self.lights)

    def to_toml(self) -> str:
        """The table [camera] of a design, with what its channels state as comments."""
        brightest = max(self.lights, key=lambda light: light.amplitude + light.offset)
        several = len(self.lights) > 1
        light = brightest.stated
        if several:
            light = {"amplitude": f"{brightest.amplitude:.1f}", "offset": f"{brightest.offset:.1f}"}
        comment = (
            "of the brightest channel; each states its own in [[polariscope.channels]]"
            if several
            else "from the brightest and darkest pixels; calibration finds it"
        )
        own = [
            f"# channel {c}: "
            + ", ".join(f"{key} = {json.dumps(value)}" for key, value in one.stated.items())
            for c, one in enumerate(self.lights, start=1)
            if several
        ]
        quote = "" if several else '"'
        return "\n".join(
            [
                "[camera]",
                f"pixels = {self.pixels}",
                f"bits = {self.bits}",
                f"amplitude = {quote}{light['amplitude']}{quote}  # {comment}",
                f"offset = {quote}{light['offset']}{quote}",
                *own,
                f"noise = {self.noise:.3g}",
                'noise_model = "gaussian"',
                f'response = "{self.response}"',
                f'blur = "{self.blur * 1e6:.3g} +/- {self.blur * 0.5e6:.2g} um"  # without '
                "that of the lens",
                f'shift = "0 +/- {self.shift * 1e3:.2g} mm"',
                f'scale = "1 +/- {self.scale:.2g}"',
            ]
        )

    def put_into(self, sensor: Sensor) -> Sensor:
        """The design with this camera, and with the light of each of several channels."""
        values = tomllib.loads(self.to_toml())["camera"]
        stated = {f"camera.{key}": value for key, value in values.items()}
        if len(self.lights) > 1:
            for c, light in enumerate(self.lights):
                stated |= {f"{CHANNELS}{c}.{key}": value for key, value in light.stated.items()}
        return sensor.replace(**stated)


def line_camera(
    pictures: Sequence[NDArray[Any]],
    region: Region,
    length: float,
    channels: Sequence[str] = ("grey",),
    pixels: int | None = None,
    response: str = "linear",
) -> LineCamera:
    """The camera of a design, from some pictures.

    The noise is what the lines of four bands across the strip differ by, beyond light that differs
    smoothly, with the covariance of neighbours added, along the strip and across: the spectral
    density at long waves, where fringes are.

    Parameters
    ----------
    pictures : sequence of ndarray
        Some pictures.
    region : Region
        Where the strip is.
    length : float
        Of the strip [m].
    channels : sequence of str
        As `channels_of` names them.
    pixels : int, optional
        Of the line; as many as the picture has if not given.
    response : str
        Of the camera, as in a design; amplitude and offset are of the light before it.

    Raises
    ------
    InputError
        If the band is too narrow to tell the noise, or the pictures are dark.
    """
    period = 2 if region.sites else 1
    count = int(region.length / period) if pixels is None else pixels
    sampler = Sampler(region, count, channels)
    lines = np.array([np.atleast_2d(sampler.line(picture)) for picture in pictures])
    # means of neighbours, so that noise does not lower the one and raise the other
    smooth = uniform_filter1d(lines, LAGS, axis=-1, mode="nearest")
    low, high = smooth.min(axis=(0, 2)), smooth.max(axis=(0, 2))
    if (high <= low).any():
        named = [name for name, dark in zip(channels, high <= low, strict=True) if dark]
        lost = f" in {' and '.join(named)}" if len(channels) > 1 else ""
        raise InputError(f"The pictures show no light on the strip{lost}; expose longer.")
    noise = _noise(pictures, region, count, channels)
    top = 2**region.bits - 1
    # bits that resolve the noise, and the levels in them
    finest = max(float(noise.min()), 1e-6)
    bits = int(np.clip(np.ceil(np.log2(max(1.0, FINE * top / finest))), region.bits, 16))
    scale = (2**bits - 1) / top
    grid = np.linspace(0, 1, 4096)
    low, high = top * np.interp(np.array([low, high]) / top, encoded(grid, response), grid)
    amplitude, offset = np.floor(np.array([high - low, low]) * scale * 10) / 10
    step = length / region.length
    return LineCamera(
        pixels=count,
        bits=bits,
        lights=tuple(map(Light, amplitude.tolist(), offset.tolist(), (noise * scale).tolist())),
        blur=sampler.spread * length / count,
        shift=EDGE * step / np.sqrt(2),
        scale=EDGE * np.sqrt(2) / region.length,
        response=response,
    )


def _noise(
    pictures: Sequence[NDArray[Any]], region: Region, pixels: int, channels: Sequence[str]
) -> Array:
    """Standard deviation of a line of each channel [grey levels of the picture]."""
    period = 2 if region.sites else 1
    if region.width * (1 - 2 * region.margin) < 2 * BANDS * period:
        raise InputError(
            f"The strip is {region.width:.0f} pixels wide, too few rows to tell the noise from; "
            "state noise in the design, or bring the camera nearer."
        )
    edges = np.linspace(region.margin, 1 - region.margin, BANDS + 1)
    bands = [Sampler(_band(region, *pair), pixels, channels) for pair in pairwise(edges)]
    top = 2**region.bits - 1
    powers = []
    for picture in pictures:
        lines = np.array([np.atleast_2d(band.line(picture)) for band in bands])
        powers.append([_power(lines[:, channel], top) for channel in range(lines.shape[1])])
    return np.sqrt(np.mean(powers, axis=0))


def _band(region: Region, low: float, high: float) -> Region:
    """A part of a region across the strip, without a margin."""
    corners = region.points([[0, low], [1, low], [1, high], [0, high]])
    ends = tuple((float(column), float(row)) for column, row in corners)
    return replace(region, corners=ends, margin=0.0)


def _power(lines: Array, top: int) -> float:
    """Spectral density at long waves of the noise of the mean of lines, shape (BANDS, n)."""
    n = lines.shape[1]
    mean = lines.mean(axis=0)
    keep = np.all(lines < top, axis=0)
    if keep.sum() < 8 * DEGREE:
        raise InputError("Nearly all pixels of the strip are saturated; expose shorter.")
    smooth = np.polynomial.chebyshev.chebvander(np.linspace(-1, 1, n), DEGREE)
    # light and darkness of a band differ smoothly from those of the mean
    basis = np.hstack([smooth * mean[:, None] / mean.mean(), smooth])
    # an orthonormal basis Q, and T that adds neighbours: of white noise r with Q projected out,
    # the mean of r' T r is (tr T - tr Q' T Q) times the variance
    basis = np.linalg.svd(basis * keep[:, None], full_matrices=False)[0]
    free = np.array([keep.sum() - basis.shape[1], keep.sum() - _together(basis)])
    semivariance = np.zeros((BANDS, 2))
    for apart in range(1, BANDS):
        for differ in (lines[apart:] - lines[:-apart]) * keep:
            rest = (differ - basis @ (basis.T @ differ))[:, None]
            powers = np.array([float((rest**2).sum()), _together(rest)]) / free
            semivariance[apart] += powers / 2 / (BANDS - apart)
    # bands that share blocks of a codec err alike: the variance of their mean from the variogram,
    # zero covariance at the largest distance (Cressie, Statistics for Spatial Data, section 2.4);
    # along the strip it is as for any band, so its share is told from single pixels
    pairs = np.abs(np.subtract.outer(np.arange(BANDS), np.arange(BANDS)))
    alike = float((semivariance[-1] - semivariance[pairs]).mean(axis=(0, 1))[0])
    alone = semivariance[1:].mean(axis=0) / BANDS
    return float(alone.max() * max(1.0, alike / max(float(alone[0]), 1e-300)))


def _together(columns: Array) -> float:
    """Sum of products of all rows with those that are no more than `LAGS` away."""
    beside = correlate1d(columns, np.ones(2 * LAGS + 1), axis=0, mode="constant")
    return float((columns * beside).sum())
