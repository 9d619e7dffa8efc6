"""Frames whose pixels are taken together in bins, and what makes them.

The fringes of a bin have the mean of its pixels: to the second order in how far the phase runs
along it, those at its middle behind a point spread of its width.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fringeforce.estimation.frame_model import FrameModel, node_weights, pixels_at

Array = NDArray[np.float64]

BIN_SIZES = 4, 2
"""Pixels of a bin that are tried: of more the loops over nodes, not pixels, take the time."""


def binned(model: FrameModel, size: int) -> FrameModel:
    """What makes frames of bins of so many pixels; pixels left over at the end are left out.

    Parameters
    ----------
    model : FrameModel
        Of single pixels.
    size : int
        Pixels in a bin.
    """
    channels, count = len(model.bias), len(model.fixed)
    pixels = len(model.amplitude) // channels
    places = model.first[:pixels] + model.weights[:pixels] @ np.arange(4.0)
    first, weights = node_weights(means(places, size, 1), count)
    return model._replace(
        **pixels_at(first, weights, channels),
        amplitude=means(model.amplitude, size, channels),
        offset=means(model.offset, size, channels),
        blur=float(np.sqrt(model.blur**2 + (size**2 - 1) / 12)) / size,
        blur_std=model.blur_std / size,
        variance=means(model.variance, size, channels) / size,
        broken=min(size * model.broken, 0.5),
    )


def coarsest(model: FrameModel) -> int:
    """Most pixels of a bin: one bin or more must lie between neighbouring nodes."""
    pixels = len(model.amplitude) // len(model.bias)
    return max(pixels // (len(model.fixed) - 3), 1)


def slow_size(model: FrameModel, pace: float, span: float) -> int:
    """Most pixels of a bin through which a phase runs by less than a span, 1 if through none.

    Parameters
    ----------
    model : FrameModel
        Of single pixels.
    pace : float
        Of the phase where it is fastest [rad per pixel].
    span : float
        Limit [rad].
    """
    return next((n for n in BIN_SIZES if n <= coarsest(model) and n * pace < span), 1)


def means(line: Array, size: int, channels: int) -> Array:
    """Means over bins of the pixels of several channels in turn, without those left over."""
    own = line.reshape(channels, -1)
    whole = own[:, : own.shape[1] // size * size]
    return np.asarray(whole.reshape(-1, size).mean(axis=1))


def seen_means(frame: Array, size: int, channels: int) -> Array:
    """The same of the pixels that are finite; not finite where less than half of a bin is."""
    known = np.isfinite(frame)
    if known.all():
        return means(frame, size, channels)
    share = means(known.astype(float), size, channels)
    total = means(np.where(known, frame, 0.0), size, channels)
    return np.where(share >= 0.5, total / np.maximum(share, 0.5), np.nan)
